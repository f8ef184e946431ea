"""Progress in words and colours."""

from gaplab.api.clients.progress.text import COLORS
from gaplab.schemas.lifecycle import State


def test_every_state_has_a_colour() -> None:
    assert set(COLORS) == set(State)
