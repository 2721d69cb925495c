"""ftrobopy against the peers of this program.

ftrobopy_client.py WHAT PORT CYCLES: `answer` sets O1 to the value of I1 each millisecond; `cycles` makes exchanges as
fast as it can, and prints how long one takes in ns. The other numbers are ns of processor time, and how often a thread
waited, in each cycle.
"""

import os
import resource
import sys
import threading
import time

import ftrobopy

what, port, cycles = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
exchanges = 0


def count(_txt):
    """Called in each exchange, with the newest inputs."""
    global exchanges
    exchanges += 1


class Client(ftrobopy.ftTXT):
    pass


def usage():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return (used.ru_utime + used.ru_stime) * 1e9, used.ru_nvcsw


txt = Client("127.0.0.1", port, on_data=count)
txt.queryStatus()
interval = 0 if what == "cycles" else 0.001
txt.startOnline(interval)
txt.updateConfig()
txt.incrMotorCmdId(0)
while exchanges < 10:
    time.sleep(0.01)
begin, before, first = time.monotonic_ns(), usage(), exchanges
while exchanges - first < cycles:
    if what == "answer":
        txt.setPwm(0, txt.getCurrentInput(0))
        time.sleep(0.001)
    else:
        time.sleep(0.05)
end, after, last = time.monotonic_ns(), usage(), exchanges
done = last - first
costs = [(now - then) / done for now, then in zip(after, before)]
if what == "cycles":
    costs = [(end - begin) / done]
print(*costs, flush=True)
# Its threads go on otherwise.
os._exit(0)
