"""What the contracts of all kinds ask: a description, and that a new plug-in answers as one that was used."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np

from gaplab.services.core.arrays import FloatArray

P = TypeVar("P")


def check_repeats(make: Callable[[], P], questions: Mapping[str, Callable[[P], FloatArray]], advice: str) -> None:
    """Check that a plug-in answers each question as a new one does, whatever it was asked before.

    One plug-in is asked all questions in turn, twice. Answers are compared to the last bit; nan equals nan.

    Args:
        make: returns a new plug-in.
        questions: functions of a plug-in that return its answer, an array of any shape, by the answer's name.
        advice: what an author can do about a difference.

    Raises:
        AssertionError: an answer differs.
    """
    answers = {name: ask(make()) for name, ask in questions.items()}
    used = make()
    for name, ask in [*questions.items(), *questions.items()]:
        same = np.array_equal(ask(used), answers[name], equal_nan=True)
        assert same, f"{name} differs when it is asked again: {advice}"


def is_described(plugin: type[Any]) -> None:
    """Has a docstring of its own, whose first line is a sentence."""
    assert (plugin.__doc__ or "").strip(), "it has no docstring of its own; say in a sentence what it does"
    summary = plugin.describe().summary
    assert summary.endswith("."), f"its summary in the catalogue is {summary!r}; end it with a full stop"
