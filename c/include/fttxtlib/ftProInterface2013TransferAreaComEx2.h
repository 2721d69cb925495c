/* FtTxtLib's handler: areas of its own, a thread that exchanges them, and callbacks in that thread, after each
   exchange. A callback may make any call of the handler. While one takes longer than half a second, all outputs
   are off; then they are on again as the program sets them.
   If the environment variable FT_TXT_HOST is set, it replaces the host and the port that the program gives. */
#ifndef FT_FTTXTLIB_TRANSFER_AREA_COM_EX2_H
#define FT_FTTXTLIB_TRANSFER_AREA_COM_EX2_H

#include <type_traits>

#include "ftProInterface2013TransferAreaCom.h"
#include "../detail/ex2_callbacks.h"

namespace fischertechnik {
namespace txt {
namespace remote {
namespace api {

class ftIF2013TransferAreaComHandlerEx2 : public ftIF2013TransferAreaComHandlerEx1
{
public:
    /* (handler, area, input, state): a digital input has changed. */
    typedef detail::InputChanged tCbUniInputDigChanged;
    /* (handler, area, motor, position, messageId): a motor has done its distance. */
    typedef detail::MotorReached tCbMotorReached;
    /* (handler, area, counter, messageId): a counter was reset. */
    typedef detail::CounterChanged tCbCntResetReady;
    /* (handler, area, counter, count): a counter has counted. */
    typedef detail::CounterChanged tCbCount;
    /* (handler): an exchange is done. */
    typedef detail::Completed tCbTaCompleted;
    /* (handler, area, remote, joystick, x, y): a joystick was moved. */
    typedef detail::Joystick tCbTaJoyStick;

    /* FtTxtLib's log file is not written. */
    ftIF2013TransferAreaComHandlerEx2(int nAreas = 1, const char *name = "192.168.7.2",
                                      const char *port = "65000", const char *logMapName = ".\\",
                                      LogLevel logLevel = LogLevel::LvLOGERR)
        : ftIF2013TransferAreaComHandlerEx2(std::make_shared<detail::Callbacks>(nAreas), nAreas, name, port)
    {
        (void)logMapName;
        (void)logLevel;
    }

    /* Ends the transfer. May be called in a callback. */
    virtual ~ftIF2013TransferAreaComHandlerEx2()
    {
        m_callbacks->belong_to(nullptr, nullptr);
        ft_ex2_free(m_handler);
        m_handler = nullptr;
    }

    /* The areas, which stay where they are until the handler is deleted. */
    volatile FISH_X1_TRANSFER *GetTransferAreasArrayAddr() { return m_transferarea; }

    FtErrors ftxStartTransferArea()
    {
        if (!ftxIsTransferActiv()) {
            m_callbacks->begin();
        }
        return code(ft_ex2_start(m_handler));
    }
    FtErrors ftxStopTransferArea() { return code(ft_ex2_stop(m_handler)); }
    bool ftxIsTransferActiv() { return ft_ex2_is_active(m_handler) != 0; }

    /* How many extensions take part. */
    int IsSlaveActive()
    {
        volatile FISH_X1_TRANSFER *master = area(LOCAL_IO);
        int count = 0;
        for (int i = 0; master != nullptr && i < 8; ++i) {
            count += master->ftX1state.io_slave_alive[i] != 0;
        }
        return count;
    }

    /* A bool, or any number, says whether the input is digital. */
    template <typename Digital>
    typename std::enable_if<std::is_arithmetic<Digital>::value, FtErrors>::type
    SetFtUniConfig(ShmIfId_TXT shmId, Input idxIO, InputMode mode, Digital digital)
    {
        return code(ft_ex2_set_uni(m_handler, shmId, idxIO, mode, digital ? 1 : 0));
    }

    /* A digital input with a callback for its changes. A distance is not digital. */
    FtErrors SetFtUniConfig(ShmIfId_TXT shmId, Input idxIO, InputMode mode,
                            tCbUniInputDigChanged callback = nullptr)
    {
        if (mode != MODE_R && mode != MODE_U) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        FtErrors error = code(ft_ex2_set_uni(m_handler, shmId, idxIO, mode, 1));
        return error != FTLIB_ERR_SUCCESS ? error : set(m_callbacks->of(shmId).input[idxIO], callback);
    }

    /* mode: 1 normal, 0 inverted. */
    FtErrors SetFtCntConfig(ShmIfId_TXT shmId, Counter iCnt, int mode, tCbCount callbackCount = nullptr,
                            tCbCntResetReady callbackCnt = nullptr)
    {
        FtErrors error = code(ft_ex2_set_counter(m_handler, shmId, iCnt, mode));
        if (error != FTLIB_ERR_SUCCESS) {
            return error;
        }
        set(m_callbacks->of(shmId).count[iCnt], callbackCount);
        return set(m_callbacks->of(shmId).reset[iCnt], callbackCnt);
    }

    /* status: true a motor, false two single outputs. */
    FtErrors SetFtMotorConfig(ShmIfId_TXT shmId, Motor idxMotor, bool status,
                              tCbMotorReached callback = nullptr)
    {
        FtErrors error = code(ft_ex2_set_motor(m_handler, shmId, idxMotor, status ? 1 : 0));
        return error != FTLIB_ERR_SUCCESS ? error : set(m_callbacks->of(shmId).motor[idxMotor], callback);
    }

    FtErrors SetFtTaCompleted(tCbTaCompleted callback = nullptr)
    {
        return set(m_callbacks->completed, callback);
    }

    FtErrors SetFtCbJoyStick(ShmIfId_TXT shmId, IrDev id, tCbTaJoyStick callbackJsX = nullptr,
                             tCbTaJoyStick callbackJsY = nullptr)
    {
        if (area(shmId) == nullptr || id > IR_ON_ON) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        set(m_callbacks->of(shmId).joystick_x[id], callbackJsX);
        return set(m_callbacks->of(shmId).joystick_y[id], callbackJsY);
    }

    /* duty: 0 to 512. */
    FtErrors SetOutMotorValues(ShmIfId_TXT shmId, Motor motorId, int duty, Direction direction)
    {
        return code(ft_ex2_motor_values(m_handler, shmId, motorId, duty, direction));
    }

    /* power: -512 counterclockwise to 512 clockwise. */
    FtErrors SetOutMotorValues(ShmIfId_TXT shmId, Motor motorId, int power)
    {
        return code(ft_ex2_motor_power(m_handler, shmId, motorId, power));
    }

    FtErrors SetOutMotorInverse(ShmIfId_TXT shmId, Motor motorId)
    {
        return code(ft_ex2_motor_inverse(m_handler, shmId, motorId));
    }

    FtErrors GetOutMotorValues(ShmIfId_TXT shmId, Motor motorId, int &power)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        if (from == nullptr || motorId > M4) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        power = from->ftX1out.duty[2 * motorId] - from->ftX1out.duty[2 * motorId + 1];
        return FTLIB_ERR_SUCCESS;
    }

    FtErrors SetOutPwmValues(ShmIfId_TXT shmId, Output outId, int duty)
    {
        return code(ft_ex2_set_pwm(m_handler, shmId, outId, duty));
    }

    FtErrors GetOutPwmValues(ShmIfId_TXT shmId, Output outId, int &duty)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        if (from == nullptr || outId > O8) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        duty = from->ftX1out.duty[outId];
        return FTLIB_ERR_SUCCESS;
    }

    /* Turns a motor for some pulses, alone or with one or three others. NoMotor is none. With 0 pulses they
       turn without end. */
    FtErrors StartMotorExCmd(ShmIfId_TXT shmId, Motor mIdx, int duty, Direction mDirection, int pulses)
    {
        return StartMotorExCmd(shmId, mIdx, duty, mDirection, NoMotor, NoDirection, pulses);
    }

    FtErrors StartMotorExCmd(ShmIfId_TXT shmId, Motor mIdx, int duty, Direction mDirection, Motor sIdx,
                             Direction sDirection, int pulses)
    {
        return StartMotorExCmd(shmId, mIdx, duty, mDirection, sIdx, sDirection, NoMotor, NoDirection, NoMotor,
                               NoDirection, pulses);
    }

    FtErrors StartMotorExCmd(ShmIfId_TXT shmId, Motor mIdx, int duty, Direction mDirection, Motor s1Idx,
                             Direction s1Direction, Motor s2Idx, Direction s2Direction, Motor s3Idx,
                             Direction s3Direction, int pulses)
    {
        return code(ft_ex2_start_motor_ex(m_handler, shmId, mIdx, duty, mDirection, s1Idx, s1Direction, s2Idx,
                                          s2Direction, s3Idx, s3Direction, pulses));
    }

    bool IsMotorExReady(ShmIfId_TXT shmId, Motor mIdx)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && mIdx <= M4
               && from->ftX1in.motor_ex_cmd_id[mIdx] == from->ftX1out.motor_ex_cmd_id[mIdx];
    }

    FtErrors StopMotorExCmd(ShmIfId_TXT shmId, Motor mIdx)
    {
        return code(ft_ex2_stop_motor_ex(m_handler, shmId, mIdx));
    }

    FtErrors StopAllMotorExCmd(ShmIfId_TXT shmId) { return code(ft_ex2_stop_all_motor_ex(m_handler, shmId)); }

    FtErrors StartCounterReset(ShmIfId_TXT shmId, Counter cntId)
    {
        return code(ft_ex2_reset_counter(m_handler, shmId, cntId));
    }

    bool IsCntResetReady(ShmIfId_TXT shmId, Counter cntId)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && cntId <= C4
               && from->ftX1in.cnt_reset_cmd_id[cntId] == from->ftX1out.cnt_reset_cmd_id[cntId];
    }

    FtErrors GetInCounterValue(ShmIfId_TXT shmId, Counter cntId, INT16 &count, bool &state)
    {
        if (area(shmId) == nullptr || cntId > C4) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        count = (INT16)GetInCntCount(shmId, cntId);
        state = GetInCntState(shmId, cntId);
        return FTLIB_ERR_SUCCESS;
    }

    UINT16 GetInCntCount(ShmIfId_TXT shmId, Counter cntId)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && cntId <= C4 ? (UINT16)from->ftX1in.counter[cntId] : 0;
    }

    bool GetInCntState(ShmIfId_TXT shmId, Counter cntId)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && cntId <= C4 && from->ftX1in.cnt_in[cntId] != 0;
    }

    FtErrors GetInIOValue(ShmIfId_TXT shmId, Input idxIO, INT16 &value, bool &overrun)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        if (from == nullptr || idxIO > I8) {
            return FTLIB_ERR_INVALID_PARAM;
        }
        value = from->ftX1in.uni[idxIO];
        int limit = 0;
        switch (from->ftX1config.uni[idxIO].mode) {
        case MODE_U: limit = U_OVR; break;
        case MODE_R: limit = R_OVR; break;
        case MODE_ULTRASONIC: limit = ULTRASONIC_OVR; break;
        default: limit = R2_OVR; break;
        }
        overrun = from->ftX1config.uni[idxIO].digital == 0 && value >= limit;
        return FTLIB_ERR_SUCCESS;
    }

    bool GetInIOValueBinary(ShmIfId_TXT shmId, Input idxIO)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && idxIO <= I8 && from->ftX1in.uni[idxIO] != 0;
    }

    INT16 GetInIOValueAnalogue(ShmIfId_TXT shmId, Input idxIO)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && idxIO <= I8 ? from->ftX1in.uni[idxIO] : (INT16)INVALID_VALUE;
    }

    UINT16 GetJoystickPart(ShmIfId_TXT shmId, IrDev id, IrAxisP axis)
    {
        volatile KE_IR_INPUT_V01 *ir = remote(shmId, id);
        switch (ir != nullptr ? (int)axis : 0) {
        case JoyLeftXtoLeft: return ir->u16JoyLeftXtoLeft;
        case JoyLeftXtoRight: return ir->u16JoyLeftXtoRight;
        case JoyLeftYtoForward: return ir->u16JoyLeftYtoForward;
        case JoyLeftYtoBackwards: return ir->u16JoyLeftYtoBackwards;
        case JoyRightXtoLeft: return ir->u16JoyRightXtoLeft;
        case JoyRightXtoRight: return ir->u16JoyRightXtoRight;
        case JoyRightYtoForward: return ir->u16JoyRightYtoForward;
        case JoyRightYtoBackwards: return ir->u16JoyRightYtoBackwards;
        default: return 0;
        }
    }

    INT16 GetJoystickFull(ShmIfId_TXT shmId, IrDev id, IrAxisF axis)
    {
        volatile KE_IR_INPUT_V01 *ir = remote(shmId, id);
        switch (ir != nullptr ? (int)axis : 0) {
        case JoyLeftX: return ir->i16JoyLeftX;
        case JoyLeftY: return ir->i16JoyLeftY;
        case JoyRightX: return ir->i16JoyRightX;
        case JoyRightY: return ir->i16JoyRightY;
        default: return 0;
        }
    }

    bool GetJoystickButSwi(ShmIfId_TXT shmId, IrDev id, IrButSwi button)
    {
        volatile KE_IR_INPUT_V01 *ir = remote(shmId, id);
        switch (ir != nullptr ? (int)button : -1) {
        case ButtonOn: return ir->u16ButtonOn != 0;
        case ButtonOff: return ir->u16ButtonOff != 0;
        case DipSwitch1: return ir->u16DipSwitch1 != 0;
        case DipSwitch2: return ir->u16DipSwitch2 != 0;
        default: return false;
        }
    }

    /* index: 1 to 29 as delivered, 0 stops the sound. repeat: how often it is played; 0 is once, too. */
    FtErrors SetSound(ShmIfId_TXT shmId, UINT16 index, UINT16 repeat)
    {
        return code(ft_ex2_set_sound(m_handler, shmId, index, repeat));
    }

    bool IsSoundReady(ShmIfId_TXT shmId)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && from->sTxtInputs.u16SoundCmdId == from->sTxtOutputs.u16SoundCmdId;
    }

    UINT16 GetMicLin(ShmIfId_TXT shmId)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr ? from->sTxtInputs2.u16MicLin : 0;
    }

    UINT16 GetMicLog(ShmIfId_TXT shmId)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr ? from->sTxtInputs2.u16MicLog : 0;
    }

private:
    ftIF2013TransferAreaComHandlerEx2(std::shared_ptr<detail::Callbacks> callbacks, int nAreas,
                                      const char *name, const char *port)
        : ftIF2013TransferAreaComHandlerEx1(nAreas, name, port, &detail::Callbacks::cycle, callbacks.get()),
          m_callbacks(callbacks)
    {
        m_callbacks->belong_to(this, m_transferarea);
    }

    static FtErrors code(uint32_t value) { return static_cast<FtErrors>(value); }

    template <typename Callback>
    FtErrors set(Callback &place, const Callback &callback)
    {
        m_callbacks->set(place, callback);
        return FTLIB_ERR_SUCCESS;
    }

    /* What a remote sends; nullptr when there is no such one. */
    volatile KE_IR_INPUT_V01 *remote(int shmId, int id)
    {
        volatile FISH_X1_TRANSFER *from = area(shmId);
        return from != nullptr && id >= IR_ALL_DATA && id <= IR_ON_ON ? &from->sTxtInputs.sIrInput[id] : nullptr;
    }

    std::shared_ptr<detail::Callbacks> m_callbacks;
};

} // namespace api
} // namespace remote
} // namespace txt
} // namespace fischertechnik

using namespace fischertechnik::txt::remote;
using namespace fischertechnik::txt::remote::api;

#endif
