"""What ftrobopy does with a simulated TXT, and what it reads.

usage: ftrobopy_scenarios.py PORT SCENARIO simple|compressed

A line on stdout that begins with TYPE is typed into the simulated TXT. The line that begins with
RESULT has the values read, as JSON. Every wait has a limit, after which the script fails.
"""

import faulthandler
import sys
import time

from ftrobopy_client import (
    SETTLED,
    close,
    configure,
    connect,
    cycles,
    disconnect,
    give_result,
    remote,
    snapshot,
    together,
    type_line,
    wait_until,
)

# All modes, as pairs of mode and digital. In this order no input goes from more than 1 to 0.
MODES = [(0, 1), (1, 1), (2, 1), (0, 0), (1, 0), (2, 0), (3, 1), (3, 0)]


def inputs(port, exchange):
    """The value of each input of each controller in each mode, and those of ftrobopy's objects."""
    txt = connect(port, exchange)
    objects = {
        "switches": [txt.input(number).state() for number in (1, 2)],
        "resistor": txt.resistor(3).value(),
        "voltage": txt.voltage(5).voltage(),
        "ultrasonic": txt.ultrasonic(7).distance(),
    }
    if exchange == "compressed":
        # By ftrobopy's own formula.
        objects["celsius"] = round(txt.resistor(4, ext=1).ntcTemperature())
        objects["trail"] = txt.trailfollower(5, ext=1).state()
        objects["colour"] = txt.colorsensor(6, ext=1).value()
    disconnect(txt)

    txt = connect(port, exchange)
    modes = []
    for mode in MODES:
        for ext in txt.controllers:
            configure(txt, 8 * [mode], ext)
        cycles(txt)
        modes.append([txt.getCurrentInput(ext=ext) for ext in txt.controllers])
    disconnect(txt)
    return {"modes": modes, "objects": objects}


def order(txt, ext, motors, distance, paired):
    """Commands a distance. Two motors follow each other if they are paired."""
    if not paired:
        for motor in motors:
            motor.setDistance(distance)
    elif ext == 0:
        motors[0].setDistance(distance, syncto=motors[1])
    else:
        # On an extension, setDistance commands an error instead, see injected_error below.
        for index, master in ((0, 2), (1, 1)):
            txt.setMotorDistance(index, distance, ext)
            txt.setMotorSyncMaster(index, master, ext)
            txt.incrMotorCmdId(index, ext)


def drive(txt, ext, motors, speed, distance, paired=False):
    """Turns motors by a distance: their counts in the end, whether all were reported as done with
    the last pulse and not before, and how far they were apart at most."""
    with together(txt):
        order(txt, ext, motors, distance, paired)
        for motor in motors:
            motor.setSpeed(speed)
    in_time, apart = [True], [0]

    def finished():
        counts, done = snapshot(motors)
        in_time[0] &= done == [count >= distance for count in counts]
        apart[0] = max(apart[0], max(counts) - min(counts))
        return all(done)

    wait_until("the distance", finished)
    cycles(txt, SETTLED)
    return [snapshot(motors)[0], in_time[0], apart[0]]


def leave(txt, motors):
    """Lets the first motor leave its distance and turn on: whether that is done immediately, and
    how far the others turned meanwhile. All motors are stopped in the end."""
    before, _ = snapshot(motors)
    with together(txt):
        motors[0].setDistance(0)
    _, done = snapshot(motors)
    wait_until("pulses", lambda: motors[0].getCurrentDistance() >= before[0] + 50)
    after, _ = snapshot(motors)
    with together(txt):
        for motor in motors:
            motor.stop()
    cycles(txt, SETTLED)
    stopped = snapshot(motors)
    cycles(txt)
    others = [now - then for now, then in zip(after[1:], before[1:])]
    return [done[0], others, stopped == snapshot(motors)]


def count_and_reset(txt, ext):
    """C4 after M4 has turned forward and backwards by 60 pulses at least, and after a reset."""
    motor = txt.motor(4, ext)
    for speed in (300, -512):
        goal = motor.getCurrentDistance() + 60
        with together(txt):
            motor.setSpeed(speed)
        wait_until("pulses", lambda: motor.getCurrentDistance() >= goal)
    with together(txt):
        motor.setSpeed(0)
    cycles(txt, SETTLED)
    before = txt.getCurrentCounterValue(3, ext)
    txt.incrCounterCmdId(3, ext)
    done = txt.getCounterCmdId(3, ext)
    wait_until("the reset", lambda: txt.getCurrentCounterCmdId(3, ext) == done)
    return [before, txt.getCurrentCounterValue(3, ext)]


def slide(txt):
    """Moves the slide to its end switch and back by a distance: I1, I2 and I4 before, between and
    after, and the result of the distance."""
    configure(txt, [(1, 1), (1, 1), (1, 1), (3, 0)] + 4 * [(1, 1)], 0)
    motor = txt.motor(3)

    def sensors():
        return [txt.getCurrentInput(index) for index in (0, 1, 3)]

    with together(txt):
        motor.setSpeed(512)
    before = sensors()
    wait_until("the end switch", lambda: txt.getCurrentInput(1) == 1)
    with together(txt):
        motor.setSpeed(0)
    cycles(txt, SETTLED)
    between = sensors()
    back = drive(txt, 0, [motor], -512, 400)
    return [before[:2], between, sensors(), back[:2]]


def motors(port, exchange):
    txt = connect(port, exchange)
    result = {"slide": slide(txt), "alone": [], "unpaired": [], "paired": [], "left": [], "c4": []}
    for ext in txt.controllers:
        pair = [txt.motor(number, ext) for number in (1, 2)]
        result["alone"].append(
            [drive(txt, ext, pair[:1], 512, 150), drive(txt, ext, pair[:1], -400, 90)]
        )
        result["unpaired"].append(drive(txt, ext, pair, 512, 200))
        result["paired"].append(drive(txt, ext, pair, 512, 200, paired=True))
        # From here on, the distances depend on time.
        result["left"].append(leave(txt, pair))
        result["c4"].append(count_and_reset(txt, ext))
    disconnect(txt)
    return result


def speeds(port, exchange):
    """What M1 counts at full speed in three seconds with ftrobopy's usual update interval and with a
    longer one, each with the shortest and the longest time that this can have taken, in seconds."""
    result = []
    for update_interval in (0.01, 0.02):
        txt = connect(port, exchange, update_interval)
        motor = txt.motor(1)
        motor.setSpeed(512)
        time.sleep(1)  # until it has its speed
        looks = []
        for pause in (3, 0):
            begin = time.monotonic()
            cycles(txt)
            looks.append((begin, motor.getCurrentDistance(), time.monotonic()))
            time.sleep(pause)
        (begin1, count1, end1), (begin2, count2, end2) = looks
        result.append([count2 - count1, begin2 - end1, end2 - begin1])
        disconnect(txt)
    return result


def light(txt, ext):
    """Switches the lamp on; only the simulated TXT sees it."""
    with together(txt):
        txt.setPwm(6, 300 + ext, ext)


def counter_input(txt, ext):
    """The level of C4 while it is 1 and while it is 0."""
    levels = []
    for level in (1, 0):
        type_line("%sC4 %d" % ("E1." if ext else "", level))
        wait_until("C4", lambda: txt.getCurrentCounterInput(3, ext) == level)
        levels.append(txt.getCurrentCounterInput(3, ext))
    return levels


def sounds(txt):
    """Whether a sound lasts at least about a second, and whether one is still playing after a fifth
    of that, when it is stopped."""
    begin = time.monotonic()
    with together(txt):
        txt.play_sound(3, 1)
    wait_until("the sound", txt.sound_finished)
    lasted = time.monotonic() - begin >= 0.9
    with together(txt):
        txt.play_sound(5, 0)
    cycles(txt, 20)
    went_on = not txt.sound_finished()
    with together(txt):
        txt.stop_sound()
    wait_until("the end of the sound", txt.sound_finished)
    return [lasted, went_on]


def remotes(txt):
    """What each remote sends, at its own place and as any remote."""
    cycles(txt)
    seen = [remote(txt, 3) + remote(txt, 0)]
    before = 3
    for number in (1, 2, 4):
        values = [3 + number, -3 - number, 7 + number, -7 - number]
        type_line("IR%d %d %d %d %d %d" % (number, *values, 2 + 4 * (number - 1)))
        type_line("IR%d 0 0 0 0 %d" % (before, 4 * (before - 1)))
        wait_until("the remote", lambda: remote(txt, 0)[0] == values[0])
        cycles(txt)  # ftrobopy takes over one value after the other
        seen.append(remote(txt, number) + remote(txt, 0))
        before = number
    return seen


def pictures(txt):
    """Three frames of the camera, in hexadecimal."""
    txt.startCameraOnline(320, 240, 15)
    frames = []

    def taken():
        if not txt.cameraIsOnline():
            sys.exit("the camera's connection is lost")
        frame = txt.getCameraFrame()
        if frame:
            frames.append(bytes(frame).hex())
        return len(frames) >= 3

    wait_until("three pictures", taken)
    txt.stopCameraOnline()
    return frames


def i2c(txt):
    """Registers of a device, one register that is written, and a device that does not exist."""
    for register, value in enumerate((200, 0, 1), 0x3F):
        type_line("I2C 24 %d %d" % (register, value))
    there = []

    def plugged_in():
        there[:] = txt.i2c_read(0x18, 0x3F, data_len=3) or []
        return there[2:] == [1]

    wait_until("the I2C device", plugged_in)
    written = txt.i2c_write(0x18, 0x10, 7)
    return [there, written, list(txt.i2c_read(0x18, 0x10)), txt.i2c_read(0x19, 0x3F)]


def services(port, exchange):
    txt = connect(port, exchange)
    for ext in txt.controllers:
        light(txt, ext)
    cycles(txt)
    result = {
        "name": txt.getDevicename(),
        "version": txt.getVersionNumber(),
        "firmware": txt.getFirmwareVersion(),
        "c4": [counter_input(txt, ext) for ext in txt.controllers],
        "sounds": sounds(txt),
        "remotes": remotes(txt),
        "pictures": pictures(txt),
        "i2c": i2c(txt),
    }
    disconnect(txt)
    return result


def reconnect(port, exchange):
    """Goes online and offline a hundred times; the values of I3."""
    values = set()
    for _ in range(100):
        txt = connect(port, exchange)
        cycles(txt)
        values.add(txt.getCurrentInput(2))
        disconnect(txt)
    return sorted(values)


def analog(txt):
    """I3 of each controller as a resistance up to 15 kOhm."""
    for ext in txt.controllers:
        configure(txt, 8 * [(2, 0)], ext)
    cycles(txt)
    return [txt.getCurrentInput(2, ext) for ext in txt.controllers]


def extension(port, exchange):
    """The values read before an extension is disconnected, without it, and when it is back."""
    result = []
    txt = connect(port, exchange)
    result.append(analog(txt))
    type_line("E1 0")
    wait_until("the end", lambda: not txt.isOnline())
    close(txt)

    txt = connect(port, exchange)
    wait_until("the end of a new connection", lambda: not txt.isOnline())
    close(txt)

    txt = connect(port, "simple")
    result.append(analog(txt))
    type_line("E1 1")
    type_line("I3 2300")  # Lines are carried out in their order.
    wait_until("I3", lambda: txt.getCurrentInput(2) == 2300)
    disconnect(txt)

    txt = connect(port, exchange)
    result.append(analog(txt))
    disconnect(txt)
    return result


def toggle(port, exchange):
    """Changes an output, the repeat of a sound, from 2 to 1; whether ftrobopy stays online."""
    txt = connect(port, exchange)
    with together(txt):
        txt.play_sound(3, 2)
    txt.stop_sound()
    wait_until("an end", lambda: not txt.isOnline() or txt.sound_finished())
    survived = txt.isOnline()
    close(txt)
    return survived


def injected_error(port, exchange):
    """Pairs two motors of an extension; whether they are done after a second."""
    txt = connect(port, exchange)
    pair = [txt.motor(number, 1) for number in (1, 2)]
    with together(txt):
        pair[0].setDistance(20, syncto=pair[1])
        for motor in pair:
            motor.setSpeed(512)
    cycles(txt, 100)
    _, done = snapshot(pair)
    disconnect(txt)
    return done


def eighth_command(port, exchange):
    """Gives a motor eight commands that are done immediately; the ids that it sent and read."""
    txt = connect(port, exchange)
    motor = txt.motor(1)
    ids = []
    for _ in range(8):
        cycles(txt, 3)
        ids.append([txt.getMotorCmdId(0), txt.getCurrentMotorCmdId(0)])
        with together(txt):
            motor.setDistance(0)
    disconnect(txt)
    return ids


def main():
    # No call of ftrobopy waits forever.
    faulthandler.dump_traceback_later(180, exit=True)
    port, name, exchange = int(sys.argv[1]), sys.argv[2], sys.argv[3]
    scenarios = (
        inputs,
        motors,
        speeds,
        services,
        reconnect,
        extension,
        toggle,
        injected_error,
        eighth_command,
    )
    scenario = {scenario.__name__: scenario for scenario in scenarios}[name]
    give_result(scenario(port, exchange))


main()
