"""What a person is told, and asked, before a long computation is queued."""

import math
import sys
from collections.abc import Callable
from typing import Any

from gaplab.api.clients.progress import in_notebook
from gaplab.schemas.estimates import EstimateRead

Ask = Callable[[str], str]

LONG_S = 3600.0
"""Expected duration above which a person is asked."""

QUESTION = "Submit it? [y/N] "


class NotSubmitted(Exception):
    """The person who was asked declined a long computation; nothing was submitted."""

    def __init__(self) -> None:
        super().__init__("nothing was submitted")


def sentence(estimate: EstimateRead) -> str:
    """Return the cost in words: experiments, repetitions, rollouts, and the expected duration."""
    repetitions = sum(experiment.repetitions for experiment in estimate.experiments)
    size = f"{_count(len(estimate.experiments), 'experiment')}, {_count(repetitions, 'repetition')}"
    measured = all(engine.measured for engine in estimate.engines)
    pace = "" if measured else ", at the engine's usual pace"
    cores = _count(estimate.cores, "core")
    waiting = "" if estimate.supervisors else "; no supervisor runs, so nothing starts yet"
    runs = sum(experiment.runs for experiment in estimate.experiments)
    size += f": {_count(runs, 'run')} of the robot, " if runs else ": "
    return f"{size}at most {estimate.rollouts:,} rollouts, {duration(estimate.seconds)} on {cores}{pace}{waiting}"


def duration(seconds: float) -> str:
    """Return a duration in its two largest units, as in "about 2 h 5 min"."""
    if seconds < 1:
        return "less than a second"
    for unit, length, smaller, part in (("d", 86_400, "h", 3_600), ("h", 3_600, "min", 60), ("min", 60, "s", 1)):
        if seconds >= length:
            whole, rest = divmod(math.floor(seconds / part), length // part)
            return f"about {whole:,} {unit} {rest} {smaller}" if rest else f"about {whole:,} {unit}"
    return f"about {seconds:.0f} s"


def confirm(estimate: EstimateRead, ask: Ask | None) -> bool:
    """Show the cost on standard error, and ask if it is long and a person can answer; return whether one agreed.

    Args:
        estimate: expected cost.
        ask: shows a question and returns the answer; None if no person can answer.

    Raises:
        NotSubmitted: the answer is not yes.
    """
    print(f"{sentence(estimate)}.", file=sys.stderr, flush=True)  # noqa: T201 - for a person
    if estimate.seconds <= LONG_S or ask is None:
        return False
    if not is_yes(ask(QUESTION)):
        raise NotSubmitted
    return True


def is_yes(answer: str) -> bool:
    """Return whether a person agreed."""
    return answer.strip().lower() in {"y", "yes"}


def can_ask() -> bool:
    """Return whether a person can answer this program: in a terminal, or in a notebook that a person runs."""
    if in_notebook():
        kernel: Any = sys.modules["IPython"].get_ipython().kernel
        return bool(getattr(kernel, "_allow_stdin", False))  # false where a program runs the notebook
    return sys.stdin.isatty() and sys.stdout.isatty()


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
