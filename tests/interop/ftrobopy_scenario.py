"""What ftrobopy does with a simulated TXT, and what it reads.

usage: ftrobopy_scenario.py PORT simple|extension|toggle|reconnect

The last line on stdout is RESULT and what was read, as JSON. ftrobopy prints lines of its own.
Every wait has a limit, after which the script fails.
"""

import json
import sys
import time

import ftrobopy

HOST = "127.0.0.1"
LIMIT = 30  # seconds, far more than anything takes
MODES = [  # the inputs of a controller: (mode, digital)
    (1, 1),  # I1: switch
    (0, 1),  # I2: trail sensor
    (0, 0),  # I3: voltage
    (1, 0),  # I4: resistor up to 5 kOhm
    (2, 0),  # I5: resistor up to 15 kOhm
    (3, 0),  # I6: ultrasonic
    (1, 1),  # I7
    (0, 0),  # I8: sees the lamp on O5
]


def wait_until(what, condition):
    deadline = time.monotonic() + LIMIT
    while not condition():
        if time.monotonic() > deadline:
            sys.exit("waited in vain for " + what)
        time.sleep(0.002)


def connect(port, use_extension=False):
    txt = ftrobopy.ftrobopy(HOST, port, update_interval=0.001, use_extension=use_extension)
    if not txt.isOnline():
        sys.exit("ftrobopy is not online")
    return txt


def disconnect(txt):
    txt.stopOnline()
    # It leaves its connections open until they are collected.
    txt._sock.close()
    txt._i2c_sock.close()


def cycles(txt):
    """Waits for two exchanges, of which the second began after this call."""
    for _ in range(2):
        online = [True]

        def finished():
            online[0] = txt.isOnline()
            return txt._update_status != 0 or not online[0]

        txt._update_status = 0
        wait_until("an exchange", finished)
        if not online[0]:
            sys.exit("ftrobopy went offline")


def read_inputs(txt, ext):
    txt.setConfig([1, 1, 0, 0], MODES, ext)
    txt.updateConfig(ext)
    cycles(txt)
    return [txt.getCurrentInput(index, ext) for index in range(7)]


def light(txt, ext, level):
    txt.setPwm(4, level, ext)
    wait_until("the lamp", lambda: txt.getCurrentInput(7, ext) == level)
    return txt.getCurrentInput(7, ext)


def drive(txt, ext, distance):
    """Lets M1 turn for so many pulses; how many it made."""
    motor = txt.motor(1, ext)
    wait_until("the motor", motor.finished)
    motor.setDistance(distance)
    if motor.finished():
        sys.exit("the distance is done before it began")
    motor.setSpeed(512)
    wait_until("the distance", motor.finished)
    return motor.getCurrentDistance()


def drive_both(txt, distance):
    """Lets M1 and M2 turn together for so many pulses; how many each made."""
    motors = [txt.motor(1), txt.motor(2)]
    wait_until("the motors", lambda: all(motor.finished() for motor in motors))
    motors[0].setDistance(distance, syncto=motors[1])
    for motor in motors:
        motor.setSpeed(400)
    wait_until("the distance of both", lambda: all(motor.finished() for motor in motors))
    return [motor.getCurrentDistance() for motor in motors]


def reset_counter(txt, ext):
    """C4 before and after a reset."""
    before = txt.getCurrentCounterValue(3, ext)
    txt.incrCounterCmdId(3, ext)
    done = txt.getCounterCmdId(3, ext)
    wait_until("the reset", lambda: txt.getCurrentCounterCmdId(3, ext) == done)
    return [before, txt.getCurrentCounterValue(3, ext)]


def play(txt):
    """Whether a sound plays for a while and then is done."""
    txt.play_sound(3, 1)
    cycles(txt)
    played = not txt.sound_finished()
    wait_until("the sound", txt.sound_finished)
    return played


def read_remote(txt, number):
    left, right = txt.joystick(0, number), txt.joystick(1, number)
    axes = [left.leftright(), left.updown(), right.leftright(), right.updown()]
    buttons = [txt.joybutton(button, number).pressed() for button in (0, 1)]
    return [round(15 * axis) for axis in axes] + [int(pressed) for pressed in buttons]


def picture_size(jpeg):
    """Width and height as the picture's own frame header has them."""
    if jpeg[:2] != b"\xff\xd8":
        sys.exit("a picture does not begin like a JPEG file: %r" % jpeg[:8])
    at = 2
    while jpeg[at] == 0xFF and jpeg[at + 1] != 0xC0:
        at += 2 + int.from_bytes(jpeg[at + 2 : at + 4], "big")
    if jpeg[at : at + 2] != b"\xff\xc0":
        sys.exit("a picture has no frame header")
    height, width = (int.from_bytes(jpeg[at + 5 + 2 * n : at + 7 + 2 * n], "big") for n in (0, 1))
    return [width, height]


def take_picture(txt):
    frames = []

    def taken():
        if not txt.cameraIsOnline():
            sys.exit("the camera's connection is lost")
        frame = txt._camera_thread.getCameraFrame() if txt._camera_thread else None
        if frame:
            frames.append(bytes(frame))
        return len(frames) >= 3

    txt.startCameraOnline(320, 240, 15)
    wait_until("three pictures", taken)
    txt.stopCameraOnline()
    sizes = [picture_size(frame) for frame in frames]
    if sizes != 3 * sizes[:1]:
        sys.exit("the pictures differ in size: %r" % sizes)
    return sizes[0]


def use_i2c(txt):
    """Registers that were there, one that was written, and a device that isn't there."""
    there = list(txt.i2c_read(0x18, 0x3F, data_len=3))
    written = txt.i2c_write(0x18, 0x10, 7)
    return [there, written, list(txt.i2c_read(0x18, 0x10)), txt.i2c_read(0x19, 0x3F)]


def simple(port):
    txt = connect(port)
    result = {
        "i2c": use_i2c(txt),
        "name": txt.getDevicename(),
        "version": txt.getVersionNumber(),
        "inputs": [read_inputs(txt, 0)],
        "lamp": [light(txt, 0, 300)],
        "c4_input": [txt.getCurrentCounterInput(3)],
        "c4": [reset_counter(txt, 0)],
        "distance": [drive(txt, 0, 30)],
        "both": drive_both(txt, 40),
        "sound": play(txt),
        "remote": read_remote(txt, 3),
        "any_remote": read_remote(txt, 0),
        "picture": take_picture(txt),
    }
    disconnect(txt)
    return result


def extension(port):
    txt = connect(port, use_extension=True)
    result = {
        "name": txt.getDevicename(),
        "version": txt.getVersionNumber(),
        "inputs": [read_inputs(txt, ext) for ext in (0, 1)],
        "lamp": [light(txt, ext, 300 + ext) for ext in (0, 1)],
        "c4_input": [txt.getCurrentCounterInput(3, ext) for ext in (0, 1)],
        "c4": [reset_counter(txt, ext) for ext in (0, 1)],
        "distance": [drive(txt, ext, 30 + ext) for ext in (0, 1)],
        "both": drive_both(txt, 40),
        "sound": play(txt),
    }
    disconnect(txt)
    return result


def toggle(port):
    """Changes an output, the repeat of a sound, from 2 to 1; whether ftrobopy survives it."""
    txt = connect(port, use_extension=True)
    txt.play_sound(3, 2)
    cycles(txt)
    txt.stop_sound()
    stopped = txt.getSoundCmdId()
    wait_until("an end", lambda: not txt.isOnline() or txt.getCurrentSoundCmdId() == stopped)
    survived = txt.isOnline()
    txt._sock.close()
    txt._i2c_sock.close()
    return survived


def reconnect(port):
    """Goes online and offline a hundred times; what I1 was each time."""
    values = set()
    for _ in range(100):
        txt = connect(port)
        cycles(txt)
        values.add(txt.getCurrentInput(0))
        disconnect(txt)
    return sorted(values)


def main():
    port, scenario = int(sys.argv[1]), sys.argv[2]
    scenarios = {f.__name__: f for f in (simple, extension, toggle, reconnect)}
    print("RESULT " + json.dumps(scenarios[scenario](port)))


main()
