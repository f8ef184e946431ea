"""A process that ends with its parent: `python -m gaplab.api.process.child_process PID MODULE ARGUMENT...`.

A service that is killed cannot end its children itself; on Linux the kernel does it.
"""

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import IO

PR_SET_PDEATHSIG = 1  # Source: man 2 prctl


def start(
    module: str,
    *arguments: str,
    environment: Mapping[str, str] | None = None,
    log: IO[bytes] | None = None,
    keep_open: tuple[int, ...] = (),
) -> "subprocess.Popen[bytes]":
    """Start a Python module in a separate process and session, which gets SIGTERM if the calling thread ends.

    It has the environment of the caller and these variables, its output unless there is a log, and inherits these
    descriptors.
    """
    command = [sys.executable, "-m", "gaplab.api.process.child_process", str(os.getpid()), module, *arguments]
    return subprocess.Popen(  # noqa: S603 - our own modules
        command,
        env=os.environ | dict(environment or {}),
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=subprocess.STDOUT if log else None,
        pass_fds=keep_open,
        start_new_session=True,  # Ctrl-C reaches the caller alone, which then ends this process in order
    )


def end(process: "subprocess.Popen[bytes]", *, patience_s: float = 30.0) -> None:
    """Ask the process to end, and kill it if it has not ended after `patience_s`."""
    if process.poll() is None:
        process.terminate()
    try:
        process.wait(patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def kill(process: "subprocess.Popen[bytes]") -> None:
    """Kill the process and what it started, even if it stands still, and wait for its end."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)  # it leads a group of its own
    process.wait()


def _become(parent: int, module: str, arguments: list[str]) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:  # the parent died before the call to prctl
        sys.exit(1)
    os.execv(sys.executable, [sys.executable, "-m", module, *arguments])  # noqa: S606 - our own modules


if __name__ == "__main__":
    _become(int(sys.argv[1]), sys.argv[2], sys.argv[3:])
