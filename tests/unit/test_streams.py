"""Randomness by address."""

from itertools import combinations
from typing import Any

import numpy as np
import pytest

from gaplab.services.core.streams import stream

PATHS = [
    ("simulated_fit", 0, 0, "tune"),
    ("simulated_fit", 0, 1, "tune"),
    ("simulated_fit", 1, 0, "tune"),
    ("simulated_fit", 0, 0, "search"),
    ("random", 0, 0, "tune"),
    ("random",),
    (),
]


def test_an_address_gives_the_same_stream_whatever_was_drawn_before() -> None:
    first = stream(7, "informative", 3, 2, "search").random(5)
    stream(7, "informative", 3, 1, "search").random(1000)

    again = stream(7, "informative", 3, 2, "search").random(5)

    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize(("one", "other"), list(combinations(PATHS, 2)))
def test_different_addresses_give_different_streams(one: Any, other: Any) -> None:
    assert stream(0, *one).random() != stream(0, *other).random()


def test_different_seeds_give_different_streams() -> None:
    assert stream(0, "a").random() != stream(2**64 - 1, "a").random()


def test_what_an_address_draws_never_changes_for_stored_results_depend_on_it() -> None:
    assert stream(2012, "known_fit", 39, 10, "select").integers(2**63) == 770803245668245200
