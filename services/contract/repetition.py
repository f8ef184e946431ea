"""What the contracts of all kinds ask of repetition: a resumed repetition asks a new plug-in, and gets the same."""

from collections.abc import Callable, Mapping
from typing import TypeVar

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
