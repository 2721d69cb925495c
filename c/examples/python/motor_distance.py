"""Turns M1 for 100 pulses of its counter, as programs with ftMscLib and ctypes did for the ROBO TX.

Plug an encoder motor into M1 and C1, and a button into I1. Then

    python3 motor_distance.py COM1

with COM1 for USB, COM2 for Wi-Fi, COM3 for Bluetooth, or with a host: 192.168.7.2, 127.0.0.1:65000.
FTMSCLIB names the library's file if the system does not find it.
"""

import ctypes
import os
import sys
import threading
from ctypes import POINTER, byref, c_char_p, c_int, c_int16, c_uint32, c_void_p

if sys.platform == "win32":
    NAME, CALLBACK = "ftMscLib.dll", ctypes.WINFUNCTYPE
elif sys.platform == "darwin":
    NAME, CALLBACK = "libftMscLib.dylib", ctypes.CFUNCTYPE
else:
    NAME, CALLBACK = "libftMscLib.so", ctypes.CFUNCTYPE

SUCCESS = 0
MODE_R = 1
MASTER, M1, I1, C1 = 0, 0, 0, 0
CLOCKWISE, NO_SLAVE = 0, -1

EventCallback = CALLBACK(None, c_uint32, c_uint32)

library = ctypes.CDLL(os.environ.get("FTMSCLIB", NAME))
library.ftxOpenComDevice.restype = c_void_p
library.ftxOpenComDevice.argtypes = [c_char_p, c_uint32, POINTER(c_uint32)]
for name, arguments in {
    "ftxStartTransferArea": [],
    "ftxStopTransferArea": [],
    "ftxCloseDevice": [],
    "SetFtUniConfig": [c_int, c_int, c_int, ctypes.c_bool],
    "StartCounterReset": [c_int, c_int],
    "StartMotorExCmd": [c_int] * 7,
    "StopMotorExCmd": [c_int, c_int],
    "GetInIOValue": [c_int, c_int, POINTER(c_int16), POINTER(c_uint32)],
    "GetInCounterValue": [c_int, c_int, POINTER(c_int16), POINTER(c_int16)],
    "GetRoboTxFwStr": [c_int, c_char_p, c_uint32],
}.items():
    # All return a DWORD. A handle is as wide as a pointer, so its type must be told.
    function = getattr(library, name)
    function.restype, function.argtypes = c_uint32, [c_void_p] + arguments
library.ftxGetLibErrorString.argtypes = [c_uint32, c_uint32, c_char_p, c_uint32]
library.SetCBMotorExReached.argtypes = [EventCallback]
library.SetCBMotorExReached.restype = None


def check(code):
    """Ends the program with the text of an error."""
    if code & 0xFFFFFFFF != SUCCESS:
        text = ctypes.create_string_buffer(100)
        library.ftxGetLibErrorString(code, 1, text, len(text))
        sys.exit(f"{text.value.decode()} ({code & 0xFFFFFFFF:#010x})")


arrived = threading.Event()


@EventCallback
def on_arrived(controller, motor):
    """Is called in the library's thread. It must live as long as it is set."""
    print(f"M{motor + 1} has arrived")
    arrived.set()


def drive(device):
    """Turns the motor until it has arrived."""
    check(library.SetFtUniConfig(device, MASTER, I1, MODE_R, True))
    library.SetCBMotorExReached(on_arrived)
    check(library.StartMotorExCmd(device, MASTER, M1, 512, CLOCKWISE, NO_SLAVE, 0, 100))
    arrived.wait(30)
    value, overrun, count, level = c_int16(), c_uint32(), c_int16(), c_int16()
    check(library.GetInIOValue(device, MASTER, I1, byref(value), byref(overrun)))
    check(library.GetInCounterValue(device, MASTER, C1, byref(count), byref(level)))
    # Taken away before it is gone.
    library.SetCBMotorExReached(EventCallback())
    return f"C1 has counted {count.value} pulses, I1 is {value.value}"


def main():
    port = sys.argv[1] if len(sys.argv) > 1 else "COM1"
    check(library.ftxInitLib())
    error = c_uint32()
    device = library.ftxOpenComDevice(port.encode(), 38400, byref(error))
    if not device:
        check(error.value)
    firmware = ctypes.create_string_buffer(20)
    library.GetRoboTxFwStr(device, MASTER, firmware, len(firmware))
    print(f"{port}: firmware {firmware.value.decode()}")
    check(library.ftxStartTransferArea(device))
    try:
        driven = drive(device)
    finally:
        # Also after Ctrl-C and after an error.
        library.ftxStopTransferArea(device)
        library.ftxCloseDevice(device)
        library.ftxCloseLib()
    # Nobody may read it, so it comes last.
    print(driven)
    print("all motors off")


if __name__ == "__main__":
    main()
