"""MuJoCo's warnings, which it prints and appends to a file in the working folder."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType


@contextmanager
def unlogged(mujoco: ModuleType) -> Iterator[None]:
    """Stop MuJoCo from printing warnings or writing them to a file; the setting is process-wide, so it is restored."""
    log, silent = mujoco.MjLogConfig.get(), mujoco.MjLogConfig.get()
    silent.logto_console = silent.logto_file = False
    silent.set()
    try:
        yield
    finally:
        log.set()
