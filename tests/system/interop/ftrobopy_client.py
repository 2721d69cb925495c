"""ftrobopy, used step by step, and workarounds for its mistakes."""

import contextlib
import json
import os
import sys
import time

import ftrobopy

HOST = "127.0.0.1"
LIMIT = 60  # seconds, much longer than any wait
SETTLED = 150  # exchanges until a motor has stopped


class Expansion(ftrobopy.compBuffer):
    """ftrobopy's expansion of compressed words, which also remembers the words.

    ftrobopy expands the words of the infrared remotes, but reads them from simple exchanges only.
    """

    def __init__(self):
        self.newest = 77 * [0]  # the number of words that it expands
        super().__init__()

    def Reset(self):
        super().Reset()
        self.next = 0

    def GetWord(self):
        word = super().GetWord()
        if word == 1:
            self.newest[self.next] = 0 if self.newest[self.next] == 1 else 1
        elif word != 0:
            self.newest[self.next] = word
        self.next += 1
        return word


ftrobopy.compBuffer = Expansion


def connect(port, exchange, update_interval=0.001):
    use_extension = exchange == "compressed"
    txt = ftrobopy.ftrobopy(
        HOST, port, update_interval=update_interval, use_extension=use_extension
    )
    txt.controllers = (0, 1) if use_extension else (0,)
    return txt


def disconnect(txt):
    txt.stopOnline()
    close(txt)


def close(txt):
    """Closes the connections, which stopOnline leaves open until they are collected."""
    txt._sock.close()
    txt._i2c_sock.close()


def wait_until(what, condition):
    deadline = time.monotonic() + LIMIT
    while not condition():
        if time.monotonic() > deadline:
            sys.exit("waited too long for " + what)
        time.sleep(0.002)


def cycles(txt, count=2):
    """Waits for `count` exchanges; the second one begins after this call."""
    for _ in range(count):
        txt._update_status = 0
        wait_until("an exchange", lambda: txt._update_status != 0 or not txt.isOnline())
        if not txt.isOnline():
            sys.exit("ftrobopy went offline")


@contextlib.contextmanager
def together(txt):
    """All that is set in here goes out in one exchange, and at the end that exchange is over.

    ftrobopy may forget values that are set while it compresses an earlier change, so this waits for
    earlier changes first.
    """
    cycles(txt)
    txt.SyncDataBegin()
    try:
        yield
    finally:
        txt.SyncDataEnd()
    cycles(txt)


# All that ftrobopy prints goes to stderr.
answers = os.fdopen(os.dup(1), "w", buffering=1)
os.dup2(2, 1)


def type_line(line):
    """Asks for a line to be typed into the simulated TXT."""
    answers.write("TYPE %s\n" % line)


def give_result(result):
    answers.write("RESULT %s\n" % json.dumps(result))


def configure(txt, inputs, ext):
    """Sets the inputs to these modes, pairs of mode and digital."""
    txt.setConfig([1, 1, 1, 1], inputs, ext)
    txt.updateConfig(ext)


def snapshot(motors):
    """The counts of these motors, and which motors are done, from the same exchange."""
    with motors[0]._outer._exchange_data_lock:
        return (
            [motor.getCurrentDistance() for motor in motors],
            [motor.finished() for motor in motors],
        )


def remote(txt, number):
    """Both joysticks and both buttons of a remote, 0 for any."""
    if len(txt.controllers) == 1:
        left, right = txt.joystick(0, number), txt.joystick(1, number)
        axes = [left.leftright(), left.updown(), right.leftright(), right.updown()]
        buttons = [txt.joybutton(button, number).pressed() for button in (0, 1)]
        return [round(15 * axis) for axis in axes] + [int(pressed) for pressed in buttons]
    words = txt._txt_thread.compBuffer.newest[25 + 5 * number : 30 + 5 * number]
    axes = [word - 65536 if word > 32767 else word for word in words[:4]]
    return axes + [words[4] & 1, words[4] >> 1 & 1]
