"""Boxes of real vectors."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaplab.services.core.space import Space

SPACE = Space.box([0.0, -1.0], [1.0, 3.0], [True, False])


def test_periodic_coordinates_wrap_and_others_clip() -> None:
    contained = SPACE.contain(np.array([[1.25, 9.0], [-0.25, -9.0], [0.5, 2.0]]))

    np.testing.assert_allclose(contained, [[0.25, 3.0], [0.75, -1.0], [0.5, 2.0]])


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2))
def test_whatever_is_contained_lies_in_the_box(vector: Any) -> None:
    contained = SPACE.contain(np.array(vector))

    assert np.all(contained >= SPACE.lower)
    assert np.all(contained <= SPACE.upper)


def test_drawn_vectors_fill_the_box_evenly() -> None:
    drawn = SPACE.draw(4000, np.random.default_rng(0))

    np.testing.assert_allclose(drawn.mean(axis=0), [0.5, 1.0], atol=0.05)
    np.testing.assert_allclose(drawn.std(axis=0), SPACE.extent / 12**0.5, rtol=0.05)


def test_rounding_carries_no_vector_over_a_bound() -> None:
    """0.3 + (0.9 - 0.3) is above 0.9, and 0.03 + (0.29 - 0.03) above 0.29."""
    clips, wraps = Space.box([0.3], [0.9]), Space.box([0.03], [0.29], [True])

    assert clips.at(np.array([0.0])) == 0.3
    assert clips.at(np.array([1.0])) == 0.9
    assert wraps.contain(np.nextafter(wraps.lower, 0.0)) == 0.29


def test_reversed_bounds_are_refused_with_their_place_and_values() -> None:
    with pytest.raises(ValueError, match=r"coordinate 1 has 5\.0 and 2\.0"):
        Space.box([0.0, 5.0], [1.0, 2.0])


def test_vectors_of_different_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="one length"):
        Space.box([0.0], [1.0, 2.0])


def test_a_space_cannot_be_changed() -> None:
    with pytest.raises(ValueError, match="read-only"):
        SPACE.lower[0] = 5.0
