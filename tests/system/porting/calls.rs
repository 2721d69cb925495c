//! Each call of the C libraries, and the same call of this crate as a program writes it.
//!
//! It is compiled with the test, and never run. The test reads it as text: each comment at the start
//! of a paragraph is a row, with the C call and its result. The code after the comments is the Rust
//! side. Paragraphs without a comment are not rows.

use std::io;
use std::ops::ControlFlow;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::transfer_area::{CounterMode, InputValues, OutputValues};
use ft_transfer_area::tx::{IoValue, IrDevice, JoystickAxis, JoystickPart, JoystickSwitch};
use ft_transfer_area::wire::crc_of_words;
use ft_transfer_area::{
    CameraOptions, Error, EventKind, Exchange, FirmwareVersion, FishX1Transfer, I2cClient,
    Statistics, TimeLimits, TransferAreaComHandler, TransferAreaGuard, TransferMode, TxtClient,
};

/// The TXT's kit: `ftIF2013TransferAreaComHandler`
fn kit(areas: &mut [FishX1Transfer], words: &[u16], elapsed: Duration) -> Result<(), Error> {
    // new ftIF2013TransferAreaComHandler(areas, 2, "192.168.7.2", "65000")
    let handler = TransferAreaComHandler::builder("192.168.7.2:65000").areas(2).build()?;

    // BeginTransfer() → bool
    handler.begin_transfer()?;

    // GetVersion() → UINT32
    let version: Option<FirmwareVersion> = handler.version();

    // UpdateConfig() → bool
    handler.areas().update_config()?;

    // StartCamera(320, 240, 15, 50, "65001") → bool
    let frames = handler.start_camera(CameraOptions::default())?;

    let Ok(frame) = frames.recv() else { return Ok(()) };

    // GetCameraFrameJpeg(&buffer, &size) → bool
    let jpeg: &[u8] = &frame.jpeg()?;

    // ftProJpegDec(buffer, size, yuv)
    let yuv: Vec<u8> = frame.to_yuv422()?.data;

    // StopCamera()
    handler.stop_camera()?;

    // EndTransfer()
    handler.end_transfer()?;

    // BeginTransfer() → bool, in a loop of its own
    let mut client = TxtClient::connect("192.168.7.2", TimeLimits::default())?;
    client.start_online()?;

    // GetVersion() → UINT32, in a loop of its own
    let firmware: FirmwareVersion = client.query_status()?.version;

    // SetTransferMode(true), in a loop of its own
    let mut exchange = Exchange::new(TransferMode::Compressed, firmware);

    // DoTransferCompressed() → bool
    // DoTransfer() → bool
    client.do_transfer(&mut exchange, areas)?;

    let firmware = client.query_status()?.version;

    // DoTransferSimple() → bool
    let mut exchange = Exchange::new(TransferMode::Simple, firmware);
    client.do_transfer(&mut exchange, areas)?;

    // PrintIO(LOCAL_IO)
    let area: &mut FishX1Transfer = &mut areas[LOCAL_IO];
    println!("{area}");

    // SetDefaultConfig()
    *area = FishX1Transfer::default();

    // UpdateTimers(), in a loop of its own
    area.timer.set_elapsed(elapsed);

    // StopMotors()
    area.output.stop_motors();

    // GetCrc(words, count) → UINT32
    let crc: u32 = crc_of_words(words);

    // EndTransfer(), in a loop of its own
    client.stop_online()?;
    Ok(())
}

/// FtTxtLib: `ftIF2013TransferAreaComHandlerEx2`
fn ft_txt_lib(area: &mut FishX1Transfer, (mode, m, d): (i32, i32, i32)) -> Result<(), Error> {
    let limits = TimeLimits::default();

    // new ftIF2013TransferAreaComHandlerEx2(1, "192.168.7.2")
    let handler = TransferAreaComHandler::builder("192.168.7.2").build()?;

    let areas = handler.areas();
    let builder = TransferAreaComHandler::builder("192.168.7.2");

    // SetTransferMode(true)
    let builder = builder.mode(TransferMode::Compressed);

    // ftxStartTransferArea() → FtErrors
    handler.begin_transfer()?;

    // ftxStopTransferArea() → FtErrors
    handler.end_transfer()?;

    // ftxIsTransferActiv() → bool
    let running: bool = areas.is_running();

    // GetTransferAreasArrayAddr() → FISH_X1_TRANSFER*
    let mut now: TransferAreaGuard = areas.lock();

    // SetFtUniConfig(LOCAL_IO, I1, MODE_ULTRASONIC, false) → FtErrors
    area.set_ft_uni_config(I1, InputMode::Ultrasonic, false);

    // SetFtCntConfig(LOCAL_IO, C1, 1) → FtErrors
    area.set_ft_cnt_config(C1, CounterMode::Normal);

    // SetFtCntConfig(LOCAL_IO, C1, mode) → FtErrors
    area.set_ft_cnt_config(C1, CounterMode::try_from(mode)?);

    // SetFtMotorConfig(LOCAL_IO, M1, true) → FtErrors
    area.set_ft_motor_config(M1, true);

    // SetOutMotorValues(LOCAL_IO, M1, 512, CW) → FtErrors
    area.set_out_motor_values(M1, 512, Direction::Cw)?;

    // SetOutMotorValues(LOCAL_IO, (Motor)m, 512, (Direction)d) → FtErrors
    area.set_out_motor_values(Motor::try_from(m)?, 512, Direction::try_from(d)?)?;

    // SetOutMotorValues(LOCAL_IO, M1, -512) → FtErrors
    area.set_out_motor_power(M1, -512)?;

    // SetOutMotorInverse(LOCAL_IO, M1) → FtErrors
    area.set_out_motor_inverse(M1)?;

    // GetOutMotorValues(LOCAL_IO, M1, power) → FtErrors
    let power: i16 = area.get_out_motor_values(M1)?;

    // SetOutPwmValues(LOCAL_IO, O7, 300) → FtErrors
    area.set_out_pwm_values(O7, 300)?;

    // GetOutPwmValues(LOCAL_IO, O7, duty) → FtErrors
    let duty: i16 = area.get_out_pwm_values(O7)?;

    // StartMotorExCmd(LOCAL_IO, M1, 400, CW, 200) → FtErrors
    area.start_motor_ex_cmd(M1, 400, Direction::Cw, &[], 200)?;

    // StartMotorExCmd(LOCAL_IO, M1, 400, CW, M2, CCW, 200) → FtErrors
    let slaves = [(M2, Direction::Ccw)];
    area.start_motor_ex_cmd(M1, 400, Direction::Cw, &slaves, 200)?;

    // IsMotorExReady(LOCAL_IO, M1) → bool
    let ready: bool = area.is_motor_ex_ready(M1);

    // StopMotorExCmd(LOCAL_IO, M1) → FtErrors
    area.stop_motor_ex_cmd(M1)?;

    // StopAllMotorExCmd(LOCAL_IO) → FtErrors
    area.stop_all_motor_ex_cmd();

    // StartCounterReset(LOCAL_IO, C1) → FtErrors
    area.start_counter_reset(C1);

    // IsCntResetReady(LOCAL_IO, C1) → bool
    let ready: bool = area.is_cnt_reset_ready(C1);

    // GetInCounterValue(LOCAL_IO, C1, count, state) → FtErrors
    let (count, state): (u16, bool) = area.get_in_counter_value(C1);

    // GetInCntCount(LOCAL_IO, C1) → UINT16
    let count: u16 = area.get_in_cnt_count(C1);

    // GetInCntState(LOCAL_IO, C1) → bool
    let state: bool = area.get_in_cnt_state(C1);

    // GetInIOValue(LOCAL_IO, I1, value, overrun) → FtErrors
    let IoValue { value, over_range } = area.get_in_io_value(I1);

    // GetInIOValueBinary(LOCAL_IO, I1) → bool
    let pressed: bool = area.get_in_io_value_binary(I1)?;

    // GetInIOValueAnalogue(LOCAL_IO, I1) → INT16
    let value: i16 = area.get_in_io_value_analogue(I1)?;

    // GetJoystickPart(LOCAL_IO, IR_ALL_DATA, JoyLeftXtoLeft) → UINT16
    let part: u16 = area.get_joystick_part(IrDevice::Any, JoystickPart::LeftXToLeft);

    // GetJoystickFull(LOCAL_IO, IR_ALL_DATA, JoyLeftX) → INT16
    let x: i16 = area.get_joystick_full(IrDevice::Any, JoystickAxis::LeftX);

    // GetJoystickButSwi(LOCAL_IO, IR_ALL_DATA, ButtonOn) → bool
    let on: bool = area.get_joystick_but_swi(IrDevice::Any, JoystickSwitch::On);

    // SetSound(LOCAL_IO, 1, 2) → FtErrors
    area.set_sound(1, 2)?;

    // IsSoundReady(LOCAL_IO) → bool
    let ready: bool = area.is_sound_ready();

    // GetMicLin(LOCAL_IO) → UINT16
    let loudness: u16 = area.get_mic_lin();

    // GetMicLog(LOCAL_IO) → UINT16
    let loudness: u16 = area.get_mic_log();

    // IsSlaveActive() → int
    let extensions: usize = area.slaves_alive();

    // SetFtTaCompleted(callback) → FtErrors
    // tCbTaCompleted(handler)
    handler.set_cycle_hook(|now| ControlFlow::Continue(()))?;

    // SetFtCbJoyStick(LOCAL_IO, IR_ALL_DATA, x, y) → FtErrors
    // tCbTaJoyStick(handler, area, device, group, x, y)
    let events = areas.events(&[EventKind::JoystickMoved], 100)?;

    // tCbUniInputDigChanged(handler, area, input, pressed)
    let events = areas.events(&[EventKind::InputChanged], 100)?;

    // tCbMotorReached(handler, area, motor, position, messageId)
    let events = areas.events(&[EventKind::MotorReached], 100)?;

    // tCbCntResetReady(handler, area, counter, messageId)
    let events = areas.events(&[EventKind::CounterReset], 100)?;

    // tCbCount(handler, area, counter, count)
    let events = areas.events(&[EventKind::CounterChanged], 100)?;

    // StartI2C() → bool
    let i2c: I2cClient = handler.i2c()?;

    Ok(())
}

/// The ROBO TX's library: `ftMscLib`
fn ft_msc_lib(
    area: &mut FishX1Transfer,
    (mode, duty_p, duty_m): (i32, i16, i16),
) -> Result<(), Error> {
    // ftxOpenComDevice("COM4", 38400, &error) → HANDLE
    // ftxOpenComDeviceNr(4, 38400, &error) → HANDLE
    let handler = TransferAreaComHandler::builder("192.168.7.2").build()?;

    let areas = handler.areas();

    // ftxStartTransferArea(h) → u32
    handler.begin_transfer()?;

    // ftxStopTransferArea(h) → u32
    // ftxCloseDevice(h) → u32
    handler.end_transfer()?;

    // ftxIsTransferActiv(h) → u32
    let running: bool = areas.is_running();

    // ftxGetLibErrorString(code, 1, text, size) → u32
    let text: Option<String> = areas.error().map(|error: Error| error.to_string());

    // GetTransferAreasArrayAddr(h) → TA_ARRAY*
    let mut now: TransferAreaGuard = areas.lock();

    // SetFtUniConfig(h, TA_LOCAL, 0, MODE_R, true) → u32
    area.set_ft_uni_config(I1, InputMode::Resistance, true);

    // SetFtUniConfig(h, TA_LOCAL, 0, mode, true) → u32
    area.set_ft_uni_config(I1, InputMode::try_from(mode)?, true);

    // SetFtCntConfig(h, TA_LOCAL, 0, 0) → u32
    area.set_ft_cnt_config(C1, CounterMode::Normal);

    // SetFtMotorConfig(h, TA_LOCAL, 0, TRUE) → u32
    area.set_ft_motor_config(M1, true);

    // StartCounterReset(h, TA_LOCAL, 0) → u32
    area.start_counter_reset(C1);

    // SetOutMotorValues(h, TA_LOCAL, 0, 512, 0) → u32
    area.set_out_motor_values(M1, 512, Direction::Cw)?;

    // SetOutMotorValues(h, TA_LOCAL, 0, 0, 512) → u32
    area.set_out_motor_values(M1, 512, Direction::Ccw)?;

    // SetOutMotorValues(h, TA_LOCAL, 0, duty_p, duty_m) → u32, one of the duties 0
    area.set_out_motor_power(M1, duty_p - duty_m)?;

    // SetOutPwmValues(h, TA_LOCAL, 6, 300) → u32
    area.set_out_pwm_values(O7, 300)?;

    // StartMotorExCmd(h, TA_LOCAL, 0, 400, 0, 255, 0, 200) → u32
    area.start_motor_ex_cmd(M1, 400, Direction::Cw, &[], 200)?;

    // StartMotorExCmd(h, TA_LOCAL, 0, 400, 0, 1, 1, 200) → u32
    let slaves = [(M2, Direction::Ccw)];
    area.start_motor_ex_cmd(M1, 400, Direction::Cw, &slaves, 200)?;

    // StartMotorExCmd(h, TA_LOCAL, 0, 400, 0, 1, 1, 0) → u32
    let slaves = [(M2, Direction::Ccw)];
    area.start_synchronised(M1, 400, Direction::Cw, &slaves)?;

    // StartMotorExCmd4(h, TA_LOCAL, 0, 400, 0, 1, 0, 2, 0, 3, 0, 200) → u32
    let slaves = [M2, M3, M4].map(|motor| (motor, Direction::Cw));
    area.start_motor_ex_cmd(M1, 400, Direction::Cw, &slaves, 200)?;

    // StopMotorExCmd(h, TA_LOCAL, 0) → u32
    area.stop_motor_ex_cmd(M1)?;

    // StopAllMotorExCmd(h, TA_LOCAL) → u32
    area.stop_all_motor_ex_cmd();

    // GetInIOValue(h, TA_LOCAL, 0, &value, &overrun) → u32
    let IoValue { value, over_range } = area.get_in_io_value(I1);

    // GetInCounterValue(h, TA_LOCAL, 0, &count, &state) → u32
    let (count, state): (u16, bool) = area.get_in_counter_value(C1);

    // SetCBCounterResetted(callback)
    let events = areas.events(&[EventKind::CounterReset], 100)?;

    // SetCBMotorExReached(callback)
    let events = areas.events(&[EventKind::MotorReached], 100)?;

    // SetCBRoboExtState(callback)
    let events = areas.events(&[EventKind::ExtensionChanged], 100)?;

    // GetRoboTxSlaveState(h, states) → u32
    let states: [u8; 8] = area.state.io_slave_alive;

    // GetRoboTxSlaveAlive(h, 0, &alive) → u32
    let alive: bool = area.state.io_slave_alive[0] != 0;

    // GetRoboTxDevName(h, TA_LOCAL, text, size) → u32
    let name: Option<String> = handler.device_name();

    // GetRoboTxFwStr(h, TA_LOCAL, text, size) → u32
    // GetRoboTxFwVal(h, TA_LOCAL, &version) → u32
    let version: Option<FirmwareVersion> = handler.version();

    // GetTrapStatistic(h, …) → u32
    let figures: Statistics = areas.statistics();

    let mut i2c = handler.i2c()?;

    // ftxI2cRead(h, 0x18, 0x02, 0x85, callback) → u32
    let mut value = [0];
    i2c.read(0x18, 0x02, &mut value)?;

    // ftxI2cWrite(h, 0x18, 0x0F, 0x0C, 0x85, callback) → u32
    i2c.write(0x18, 0x0F, &[0x0C])?;
    Ok(())
}

/// Programs on the TXT: `KeLibTxtDl`
fn ke_lib(handler: &TransferAreaComHandler, limits: TimeLimits) -> Result<(), Error> {
    let areas = handler.areas();

    // StartTxtDownloadProg() → uint32_t
    handler.begin_transfer()?;

    // StopTxtDownloadProg() → uint32_t
    handler.end_transfer()?;

    // MotorIOLib_ThreadIsRunning() → bool
    let running: bool = areas.is_running();

    // SetTransferAreaCompleteCallback(TransferAreaCallbackFunction)
    // TransferAreaCallbackFunction(areas, count) → bool
    handler.set_cycle_hook(|now| ControlFlow::Continue(()))?;

    // GetKeLibTransferAreaMainAddress() → FISH_X1_TRANSFER*
    let mut now: TransferAreaGuard = areas.lock();

    // InitI2C() → uint32_t
    let mut i2c = handler.i2c()?;

    // KeLibI2cTransfer(0x18, 1, write, 6, read, I2C_SPEED_400_KHZ) → uint32_t
    let mut read = [0; 6];
    i2c.write_read(0x18, &[0x02], &mut read)?;
    Ok(())
}

/// Programs on the ROBO TX: `ROBO_TX_PRG`
fn robo_tx_prg(handler: &TransferAreaComHandler, area: &FishX1Transfer) -> Result<(), Error> {
    let mut i2c = handler.i2c()?;
    let areas = handler.areas();

    // PrgTic(p_ta_array, ta_count) → int
    let mut now: TransferAreaGuard = areas.wait_cycle()?;

    // I2cRead(0x18, 0x02, 0x85, callback) → BOOL32
    let mut value = [0];
    i2c.read(0x18, 0x02, &mut value)?;

    // I2cWrite(0x18, 0x0F, 0x0C, 0x85, callback) → BOOL32
    i2c.write(0x18, 0x0F, &[0x0C])?;

    // memcpy(bytes, area, 1024)
    let bytes: [u8; 1024] = area.to_bytes();
    Ok(())
}

/// Around the libraries
fn around(area: &mut FishX1Transfer, bytes: [u8; 1024]) -> Result<(), Error> {
    // Sleep(10)
    // sleep_ms(10)
    // usleep(10000)
    thread::sleep(Duration::from_millis(10));

    // memcpy(area, bytes, 1024)
    *area = FishX1Transfer::from_bytes(&bytes);

    // memcpy(&before, &area->ftX1in, sizeof(before))
    let before: InputValues = area.input;

    // memcmp(&before, &area->ftX1in, sizeof(before)) → int
    let changed: bool = before != area.input;

    // memset(&area->ftX1out, 0, sizeof(area->ftX1out))
    area.output = OutputValues::default();

    // area->ftX1config.uni[0].mode = MODE_ULTRASONIC
    area.config.uni[I1].mode = InputMode::Ultrasonic.into();

    // area->ftX1state.config_id++
    area.raise_config_id();

    // area->ftX1out.motor_ex_cmd_id[0]++
    area.raise_motor_ex_cmd_id(M1);

    // area->sTxtOutputs.u16SoundCmdId++
    area.raise_sound_cmd_id();

    // _getch() → int, with Enter after the key
    let line = io::stdin().lines().next();

    let (sender, keys) = mpsc::channel();
    thread::spawn(move || io::stdin().lines().try_for_each(|line| sender.send(line)));

    // _kbhit() → int, with the thread of “The keyboard”
    let typed: bool = keys.try_recv().is_ok();
    Ok(())
}
