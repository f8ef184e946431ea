"""Checks of plug-ins, by kind, and their results."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from inspect import getdoc
from pathlib import Path
from traceback import walk_tb
from typing import Any

from gaplab.services.contract import (
    controllers,
    discrepancies,
    engines,
    optimizers,
    robots,
    strategies,
    tasks,
    tunables,
    tuners,
)

Check = Callable[[type[Any]], None]

CHECKS: dict[str, tuple[Check, ...]] = {
    "strategy": strategies.CHECKS,
    "robot": robots.CHECKS,
    "controller": controllers.CHECKS,
    "task": tasks.CHECKS,
    "engine": engines.CHECKS,
    "tunable": tunables.CHECKS,
    "optimizer": optimizers.CHECKS,
    "discrepancy": discrepancies.CHECKS,
    "tuner": tuners.CHECKS,
}
"""The checks of each kind of plug-in."""


@dataclass(frozen=True)
class Result:
    """The result of one check.

    Attributes:
        promise: what a plug-in of this kind does, in words.
        reason: why this plug-in does not; None if it does.
    """

    promise: str
    reason: str | None


def promise_of(check: Check) -> str:
    """Return what a check checks, in words."""
    return (getdoc(check) or check.__name__).partition("\n")[0].rstrip(".")


def results(kind: str, plugin: type[Any]) -> Iterator[Result]:
    """Yield the result of each check of a plug-in of this kind."""
    for check in CHECKS[kind]:
        try:
            check(plugin)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
            yield Result(promise_of(check), _reason(error))
        else:
            yield Result(promise_of(check), None)


def _reason(error: BaseException) -> str:
    """Return the message of a failed check; for an error of the plug-in, its kind and line too."""
    message = str(error).strip().partition("\n")[0]
    (*_, (frame, line)) = walk_tb(error.__traceback__)
    if isinstance(error, AssertionError) and frame.f_globals.get("__name__", "").startswith(f"{__package__}."):
        return message
    told = f"{type(error).__name__}: {message} ({Path(frame.f_code.co_filename).name}, line {line})"
    changes = isinstance(error, ValueError) and "read-only" in message
    return f"{told}: it changes an array that it was given; change a copy" if changes else told
