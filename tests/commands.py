"""The commands and a service in a thread, for the tests of both."""

import runpy
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout
from io import StringIO
from typing import Any, NamedTuple

import uvicorn

from gaplab.api.process.server import listen


class Said(NamedTuple):
    code: int
    out: str
    err: str


Gaplab = Callable[..., Said]


@contextmanager
def served(app: Callable[..., Any]) -> Iterator[str]:
    """The address of a service of this app in a thread."""
    listener = listen("127.0.0.1", 0)
    server = uvicorn.Server(uvicorn.Config(app, log_level="critical", lifespan="off"))
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    server.should_exit = True
    thread.join()
    listener.close()


def module(name: str, *arguments: object) -> str:
    """What `python -m` prints of a module, which runs in this process.

    Raises:
        SystemExit: it refuses.
    """
    out, before = StringIO(), sys.argv
    sys.argv = [name, *map(str, arguments)]
    try:
        with redirect_stdout(out):
            runpy.run_module(name, run_name="__main__")
    finally:
        sys.argv = before
    return out.getvalue()
