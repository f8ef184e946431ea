"""Start a program that ends with its parent: `python -m gaplab.api.process.child_process PID MODULE ARGUMENT...`.

A service that is killed outright can end nothing itself; on Linux the kernel then ends what it started.
"""

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from typing import IO

PR_SET_PDEATHSIG = 1  # Source: man 2 prctl


def start(
    module: str, *arguments: str, environment: Mapping[str, str] | None = None, log: IO[bytes] | None = None
) -> "subprocess.Popen[bytes]":
    """Run a Python module in a process and a session of its own, which gets SIGTERM if the calling thread ends.

    Args:
        module: as in `python -m`.
        arguments: for it.
        environment: added to the caller's own.
        log: takes its output; left out: the caller's.
    """
    command = [sys.executable, "-m", "gaplab.api.process.child_process", str(os.getpid()), module, *arguments]
    return subprocess.Popen(  # noqa: S603 - our own modules
        command,
        env=os.environ | dict(environment or {}),
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=subprocess.STDOUT if log else None,
        start_new_session=True,  # Ctrl-C is for the caller, who then ends this in order
    )


def end(process: "subprocess.Popen[bytes]", *, patience_s: float = 30.0) -> None:
    """Ask the process to end, wait for it, and after that kill it."""
    if process.poll() is None:
        process.terminate()
    try:
        process.wait(patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _become(parent: int, module: str, arguments: list[str]) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # it died before the kernel was asked
        sys.exit(1)
    os.execv(sys.executable, [sys.executable, "-m", module, *arguments])  # noqa: S606 - our own modules


if __name__ == "__main__":
    _become(int(sys.argv[1]), sys.argv[2], sys.argv[3:])
