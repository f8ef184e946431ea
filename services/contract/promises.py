"""What the contracts of several kinds ask: a description, and answers that repeat.

Each function raises AssertionError with the reason.
"""

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.registry import Plugin
from gaplab.services.world.tasks.base import Task

P = TypeVar("P")


def check_repeats(make: Callable[[], P], questions: Mapping[str, Callable[[P], FloatArray]], advice: str) -> None:
    """Check that a plug-in answers each question as a new one does, whatever it was asked before.

    One plug-in is asked all questions in turn, twice. Answers, by the name of the question, are compared to the last
    bit; nan equals nan. The advice says what an author can do about a difference.
    """
    answers = {name: ask(make()) for name, ask in questions.items()}
    used = make()
    for name, ask in [*questions.items(), *questions.items()]:
        same = np.array_equal(ask(used), answers[name], equal_nan=True)
        assert same, f"{name} differs when it is asked again: {advice}"


def is_described(plugin: type[Plugin]) -> None:
    """Has a docstring of its own, whose first line is a sentence; a task also has a unit."""
    unit: str = getattr(plugin, "unit", "")
    assert unit or not issubclass(plugin, Task), "it has no unit"
    assert (plugin.__doc__ or "").strip(), "it has no docstring of its own; say in a sentence what it does"
    summary = plugin.describe().summary
    assert summary.endswith("."), f"its summary in the catalogue is {summary!r}; end it with a full stop"
