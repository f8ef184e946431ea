"""What draws of truths say of intervals, in words."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.space import Space
from gaplab.services.findings.recovery import FEWEST, Draw, recovered, sentences

SPACE = Space.box([0.0, 0.0], [2.0, 10.0])
NAMES = ["sharp", "dull"]


def draw(*, inside: bool = True, identified: bool = True, unreproduced: bool = False) -> Draw:
    """A truth of which the first tunable is found to a tenth of its bounds, and the second not at all."""
    middle = 1.0 if inside else 1.5
    ends = np.array([[middle - 0.1, middle + 0.1], [0.0, 10.0]])
    return Draw(np.array([1.0, 4.0]), np.array([middle, 5.0]), ends, (identified, False), unreproduced)


def said(draws: Any) -> tuple[Any, str]:
    found = tuple(recovered(draws, NAMES, SPACE))
    return found, " ".join(sentences(found, draws, samples=3))


def test_a_truth_within_is_counted_and_widths_are_shares_of_the_bounds() -> None:
    (sharp, dull), told = said([draw()] * 38 + [draw(inside=False)] * 2)

    assert (sharp.covered, sharp.identified, sharp.right) == (0.95, 40, 38)
    assert sharp.interval == pytest.approx((0.8350, 0.9862), abs=1e-4)  # Wilson's, of 38 in 40
    assert (sharp.width, sharp.error) == pytest.approx((0.1, 0.0))
    assert (dull.covered, dull.width, dull.error) == (1.0, 1.0, 0.1)
    assert told.startswith("Identified with 3 random motions: sharp (40 of 40 draws). Never identified")
    assert "dull" in told
    assert "as often as they say" in told


def test_intervals_that_are_too_narrow_are_not_to_be_trusted_but_chance_is_granted() -> None:
    few, many = [draw()] * (FEWEST - 2) + [draw(inside=False)] * 2, [draw()] * 30 + [draw(inside=False)] * 10

    assert "Do not trust" not in said(few)[1]
    assert "Do not trust the intervals of sharp: they contain the truth in 75 % (95 % interval" in said(many)[1]
    assert "as often as they say" not in said(many)[1]


def test_few_draws_say_that_they_are_and_how_many_are_not_reproduced() -> None:
    told = said([draw(identified=False), draw(unreproduced=True)])[1]

    assert told.startswith("Identified with 3 random motions: sharp (1 of 2 draws).")
    assert "2 draws say little" in told
    assert "In 1 of 2 draws, no simulator is said to reproduce the samples." in told
