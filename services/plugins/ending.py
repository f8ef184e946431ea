"""The end of a process with external plug-ins: no thread that one of them started keeps it."""

import atexit
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn


def end_after(main: Callable[[], object]) -> NoReturn:
    """Run the main function of this process, and end it as Python does, but for waiting for threads."""
    try:
        code = main()
    except SystemExit as ended:
        code = ended.code
    if not isinstance(code, int | None):
        sys.stderr.write(f"{code}\n")
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # nobody reads it any more
            stream.flush()
    os._exit(code or 0 if isinstance(code, int | None) else 1)
