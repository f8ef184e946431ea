"""The checks of systems from elsewhere: what they count as shown, and studies that can be computed."""

from typing import Any

import numpy as np
import pytest

from benchmarks.systems import SYSTEMS, above, not_above
from gaplab.schemas.spec import StudySpec
from gaplab.services.specs.resolution import resolve

HIGH, LOW = np.array([2.0, 2.1, 2.2, np.nan]), np.array([1.0, 1.1, 1.2])


@pytest.mark.parametrize(
    ("first", "second", "least", "holds"),
    [
        (HIGH, LOW, 0.0, True),
        (LOW, HIGH, 0.0, False),
        (LOW, LOW, 0.0, None),
        (HIGH, LOW, 2.0, False),
        (LOW, LOW, -0.5, True),
    ],
)
def test_a_claim_holds_if_the_whole_interval_is_on_its_side(first: Any, second: Any, least: float, holds: Any) -> None:
    assert above("more", first, second, least).holds is holds


def test_what_is_not_shown_to_be_above_is_not() -> None:
    assert [not_above("no more", first, LOW).holds for first in (HIGH, LOW)] == [False, True]


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_studies_of_each_check_can_be_computed(name: str) -> None:
    for spec in SYSTEMS[name].studies.values():
        assert resolve(StudySpec.model_validate(spec))
