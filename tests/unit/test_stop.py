"""A request to stop, made by signals."""

import os
import signal
import subprocess
import sys

from gaplab.workers.supervisor import Stop

MANY_SIGNALS = """
import os, signal, threading
from gaplab.workers.supervisor import Stop

stop = Stop()
signal.signal(signal.SIGTERM, lambda *_: stop.set())
signals = threading.Thread(target=lambda: [os.kill(os.getpid(), signal.SIGTERM) for _ in range(20_000)])
signals.start()
while signals.is_alive():
    stop.set()
    stop.wait(0.0)
print(stop.is_set())
"""


def test_signals_that_interrupt_each_other_do_not_block() -> None:
    said = subprocess.run([sys.executable, "-c", MANY_SIGNALS], capture_output=True, text=True, timeout=300, check=True)

    assert said.stdout == "True\n"


def test_a_wait_ends_with_the_request() -> None:
    stop = Stop()
    before = signal.signal(signal.SIGUSR1, lambda *_: stop.set())
    try:
        os.kill(os.getpid(), signal.SIGUSR1)
        stop.wait(3600.0)
    finally:
        signal.signal(signal.SIGUSR1, before)

    assert stop.is_set()
