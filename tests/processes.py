"""The processes of a Ray that a test started, so that it can end one."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def processes_of_ray(task: Any) -> Any:
    """Processes that run this task or actor now and descend from this one."""
    name = f"ray::{task}".encode()
    return [pid for pid, command in processes() if command.startswith(name) and is_ours(pid)]


def processes() -> Iterator[Any]:
    for path in Path("/proc").glob("[0-9]*"):
        try:
            yield int(path.name), (path / "cmdline").read_bytes()
        except OSError:  # it has ended
            continue


def processes_with(variable: Any) -> Any:
    """Processes that have this in their environment, as `NAME=value`."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if variable.encode() in (path / "environ").read_bytes().split(b"\0"):
                found.append(int(path.name))
        except OSError:  # it has ended
            continue
    return found


def is_ours(pid: Any) -> bool:
    """Whether the process descends from this one."""
    while pid > 1 and pid != os.getpid():
        try:
            pid = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            return False
    return pid == os.getpid()
