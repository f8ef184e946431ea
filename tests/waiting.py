"""Waits for what another process, a thread or a page does in its own time."""

import time
from collections.abc import Callable
from typing import Any

LONGEST_S = 600.0
"""Longest time of a wait: ample, as no test may fail because a machine is slow."""


def wait_until(
    holds: Callable[[], Any],
    *,
    within_s: float = LONGEST_S,
    meanwhile: Callable[[], object] = lambda: time.sleep(0.05),
    otherwise: Callable[[], object] = lambda: "the condition does not hold",
) -> Any:
    """Return what a condition returns once that is true; fail if it is not in time.

    Args:
        holds: the condition; an error that it raises ends the wait.
        within_s: time that it may take.
        meanwhile: called between two checks of the condition: a pause, or a step of what it depends on.
        otherwise: returns what the failure says, such as a log.
    """
    __tracebackhide__ = True  # pytest shows the caller's condition
    deadline = time.monotonic() + within_s
    while not (found := holds()):
        assert time.monotonic() < deadline, f"after {within_s:g} s: {otherwise()}"
        meanwhile()
    return found
