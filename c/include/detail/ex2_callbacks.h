/* The callbacks of a FtTxtLib handler, and what they are compared with after each exchange. */
#ifndef FT_EX2_CALLBACKS_H
#define FT_EX2_CALLBACKS_H

#include <cstddef>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "../fttxtlib/ftProInterface2013TransferAreaCom.h"

namespace fischertechnik {
namespace txt {
namespace remote {
namespace api {

class ftIF2013TransferAreaComHandlerEx2;

namespace detail {

typedef ftIF2013TransferAreaComHandlerEx2 Handler;
typedef std::function<void(Handler *, ShmIfId_TXT, Input, bool)> InputChanged;
typedef std::function<void(Handler *, ShmIfId_TXT, Motor, uint16_t, uint16_t)> MotorReached;
typedef std::function<void(Handler *, ShmIfId_TXT, Counter, uint16_t)> CounterChanged;
typedef std::function<void(Handler *)> Completed;
typedef std::function<void(Handler *, ShmIfId_TXT, IrDev, IrDevGroup, int16_t, int16_t)> Joystick;

/* The callbacks for one area. */
struct AreaCallbacks {
    InputChanged input[IZ_UNI_INPUT];
    CounterChanged count[IZ_COUNTER];
    CounterChanged reset[IZ_COUNTER];
    MotorReached motor[IZ_MOTOR];
    Joystick joystick_x[IZ_IR_RECEIVER + 1];
    Joystick joystick_y[IZ_IR_RECEIVER + 1];
};

/* They live as long as one of them runs, also when it deletes the handler. */
class Callbacks : public std::enable_shared_from_this<Callbacks>
{
public:
    explicit Callbacks(int areas) : m_areas(areas > 0 ? areas : 0) {}

    /* From now on there is this handler, or none. */
    void belong_to(Handler *handler, FISH_X1_TRANSFER *transferarea)
    {
        std::lock_guard<std::mutex> lock(m_mutex);
        m_handler = handler;
        m_transferarea = transferarea;
    }

    /* Replaces one of the callbacks. */
    template <typename Callback>
    void set(Callback &place, const Callback &callback)
    {
        std::lock_guard<std::mutex> lock(m_mutex);
        place = callback;
    }

    AreaCallbacks &of(int area) { return m_areas[area]; }

    /* A transfer begins. Its first values are compared with those that the areas have now. */
    void begin()
    {
        FISH_X1_TRANSFER *areas = transferarea();
        std::vector<Values> now = values(areas, areas != nullptr ? m_areas.size() : 0);
        std::lock_guard<std::mutex> lock(m_mutex);
        m_before.swap(now);
    }

    /* This is an ft_ex2_cycle. */
    static int cycle(void *callbacks, char *sentence, std::size_t size)
    {
        try {
            std::shared_ptr<Callbacks> here = static_cast<Callbacks *>(callbacks)->shared_from_this();
            here->compare();
            return 1;
        } catch (const std::exception &exception) {
            std::snprintf(sentence, size, "a callback has thrown: %s", exception.what());
        } catch (...) {
            std::snprintf(sentence, size, "a callback has thrown");
        }
        return 0;
    }

    Completed completed;

private:
    struct Values {
        FTX1_INPUT input;
        TXT_SPECIAL_INPUTS txt;
        UINT16 distance[IZ_MOTOR];
        UINT16 motor_id[IZ_MOTOR];
    };

    static std::vector<Values> values(const FISH_X1_TRANSFER *areas, std::size_t count)
    {
        std::vector<Values> now(count);
        for (std::size_t i = 0; i < count; ++i) {
            now[i].input = areas[i].ftX1in;
            now[i].txt = areas[i].sTxtInputs;
            for (int motor = 0; motor < IZ_MOTOR; ++motor) {
                now[i].distance[motor] = areas[i].ftX1out.distance[motor];
                now[i].motor_id[motor] = areas[i].ftX1out.motor_ex_cmd_id[motor];
            }
        }
        return now;
    }

    void compare()
    {
        FISH_X1_TRANSFER *areas = transferarea();
        if (areas == nullptr) {
            return;
        }
        std::vector<Values> now = values(areas, m_areas.size());
        std::vector<Values> before;
        {
            std::lock_guard<std::mutex> lock(m_mutex);
            before.swap(m_before);
            m_before = now;
        }
        for (std::size_t i = 0; i < before.size(); ++i) {
            compare_area(static_cast<ShmIfId_TXT>(i), before[i], now[i]);
        }
        call(completed);
    }

    void compare_area(ShmIfId_TXT id, const Values &before, const Values &now)
    {
        AreaCallbacks &area = m_areas[id];
        for (int i = 0; i < IZ_UNI_INPUT; ++i) {
            if (before.input.uni[i] != now.input.uni[i]) {
                call(area.input[i], id, static_cast<Input>(i), now.input.uni[i] != 0);
            }
        }
        for (int i = 0; i < IZ_COUNTER; ++i) {
            uint16_t count = static_cast<uint16_t>(now.input.counter[i]);
            uint16_t reset = now.input.cnt_reset_cmd_id[i], done = now.input.motor_ex_cmd_id[i];
            if (before.input.counter[i] != now.input.counter[i]) {
                call(area.count[i], id, static_cast<Counter>(i), count);
            }
            if (before.input.cnt_reset_cmd_id[i] != reset) {
                call(area.reset[i], id, static_cast<Counter>(i), reset);
            }
            /* The end of the extended mode is a command without a distance. The program may give it as soon as it sees
               that this one is done, so its outputs are those of the exchange before. */
            if (before.input.motor_ex_cmd_id[i] != done && done == before.motor_id[i] && before.distance[i] != 0) {
                call(area.motor[i], id, static_cast<Motor>(i), count, done);
            }
        }
        for (int i = 0; i <= IZ_IR_RECEIVER; ++i) {
            const KE_IR_INPUT_V01 &old = before.txt.sIrInput[i], &ir = now.txt.sIrInput[i];
            IrDev remote = static_cast<IrDev>(i);
            if (old.i16JoyLeftX != ir.i16JoyLeftX) {
                call(area.joystick_x[i], id, remote, JoystickLeft, ir.i16JoyLeftX, ir.i16JoyLeftY);
            }
            if (old.i16JoyRightX != ir.i16JoyRightX) {
                call(area.joystick_x[i], id, remote, JoystickRight, ir.i16JoyRightX, ir.i16JoyRightY);
            }
            if (old.i16JoyLeftY != ir.i16JoyLeftY) {
                call(area.joystick_y[i], id, remote, JoystickLeft, ir.i16JoyLeftX, ir.i16JoyLeftY);
            }
            if (old.i16JoyRightY != ir.i16JoyRightY) {
                call(area.joystick_y[i], id, remote, JoystickRight, ir.i16JoyRightX, ir.i16JoyRightY);
            }
        }
    }

    /* Calls one if it is there. A copy, because it may replace itself, or delete the handler. */
    template <typename Callback, typename... Arguments>
    void call(const Callback &place, Arguments... arguments)
    {
        Callback callback;
        Handler *handler;
        {
            std::lock_guard<std::mutex> lock(m_mutex);
            callback = place;
            handler = m_handler;
        }
        if (callback && handler != nullptr) {
            callback(handler, arguments...);
        }
    }

    FISH_X1_TRANSFER *transferarea()
    {
        std::lock_guard<std::mutex> lock(m_mutex);
        return m_handler != nullptr ? m_transferarea : nullptr;
    }

    std::mutex m_mutex;
    Handler *m_handler = nullptr;
    FISH_X1_TRANSFER *m_transferarea = nullptr;
    std::vector<AreaCallbacks> m_areas;
    std::vector<Values> m_before;
};

} // namespace detail
} // namespace api
} // namespace remote
} // namespace txt
} // namespace fischertechnik

#endif
