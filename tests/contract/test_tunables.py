"""What every tunable promises, the day its file is there."""

from dataclasses import asdict
from typing import Any

import pytest

from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.tunables import tunables


def flattened(value: Any, prefix: Any = "") -> Any:
    """Every leaf of a nested value by its dotted place."""
    if isinstance(value, dict):
        return {k: v for name, each in value.items() for k, v in flattened(each, f"{prefix}.{name}").items()}
    return {prefix.removeprefix("."): value}


@pytest.mark.parametrize("name", sorted(tunables))
class TestEveryTunable:
    def test_reads_back_what_it_wrote(self, name: Any) -> None:
        tunable = tunables[name]()
        value = (tunable.lower + tunable.upper) / 2

        assert tunable.read(tunable.edit(Quadruped().world, value)) == value

    def test_edits_the_field_that_it_declares_and_no_other(self, name: Any) -> None:
        tunable, world = tunables[name](), Quadruped().world

        before = flattened(asdict(world))
        after = flattened(asdict(tunable.edit(world, tunable.read(world) + 0.01)))

        assert [place for place in before if before[place] != after[place]] == [tunable.field]

    def test_leaves_the_world_it_was_given_as_it_was(self, name: Any) -> None:
        tunable, world = tunables[name](), Quadruped().world
        before = tunable.read(world)

        tunable.edit(world, 0.123)

        assert tunable.read(world) == before

    def test_has_bounds_within_what_it_means(self, name: Any) -> None:
        tunable = tunables[name]

        assert tunable.least <= tunable.lower < tunable.upper <= tunable.greatest

    def test_describes_itself_for_the_catalogue(self, name: Any) -> None:
        described = tunables[name].describe()

        assert described.summary.endswith(".")
        assert set(described.details) == {"field", "unit", "lower", "upper", "least", "greatest"}


def test_the_papers_three_coefficients_are_there() -> None:
    assert {"static_friction", "dynamic_friction", "restitution"} <= set(tunables)
