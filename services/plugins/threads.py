"""Threads of plug-ins, which must not keep a process from ending."""

import threading


def leave_threads() -> None:
    """Let this process end as soon as its own code has: a plug-in may have started a thread that never ends."""
    threading._shutdown = lambda: None  # type: ignore[attr-defined]  # which waits for them
