"""The contract of a tunable, without options, in a robot that has what it edits."""

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import asdict
from math import isclose
from typing import Any

from gaplab.services.contract.controllers import arm
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.tunables.base import Tunable
from gaplab.services.world.world import World

Plugin = type[Tunable]
DETAILS = {"field", "unit", "lower", "upper", "least", "greatest"}
OF_NO_FIELD = ("origin", "edits")
"""Places of a world in which `World.edited` remembers what was edited."""


def subject(tunable: Tunable) -> World:
    """Return the first robot that has what a tunable edits."""
    world = next((world for world in _worlds() if tunable.lack(world) is None), None)
    if world is None:
        lack, _ = tunable.lack(Quadruped().world) or ("", ())
        raise AssertionError(f"neither an arm nor {', '.join(robots)} has what it edits: {lack}")
    return world


def _worlds() -> Iterator[World]:
    """Yield the quadruped, an arm, and then an example of every robot."""
    yield Quadruped().world
    yield arm()
    for robot in robots.values():
        yield robot.example().world


def reads_back_what_it_wrote(plugin: Plugin) -> None:
    """Reads back the value that it wrote; if it is relative, the value that changes nothing."""
    tunable = plugin()
    world = subject(tunable)
    value = tunable.lower + 0.6 * (tunable.upper - tunable.lower)
    expected = tunable.read(world) if tunable.relative else value
    read = tunable.read(tunable.edit(world, value))
    assert isclose(read, expected, rel_tol=1e-12), f"it wrote {value} and reads {read}, not {expected}"


def changes_nothing_by_the_value_that_it_reads(plugin: Plugin) -> None:
    """Changes nothing if it writes the value that it reads."""
    tunable = plugin()
    world = subject(tunable)
    assert tunable.edit(world, tunable.read(world)) == world, (
        f"it reads {tunable.read(world)}, and writing that changes it"
    )


def edits_its_field_alone(plugin: Plugin) -> None:
    """Edits the field of the world that it declares, and no other but those of `also`."""
    tunable = plugin()
    world = subject(tunable)
    before = flattened(asdict(world))
    after = flattened(asdict(tunable.edit(world, _another(tunable, tunable.read(world)))))
    places = [place for place in before if place.split(".")[0] not in OF_NO_FIELD]
    changed = sorted({_field(place) for place in places if before[place] != after.get(place)})
    permitted = {tunable.field.rpartition(".")[2], *tunable.also}
    same = bool(changed) and all(permitted & set(field.split(".")) for field in changed)
    assert same, f"it declares the field {tunable.field!r}, and changes {', '.join(changed) or 'nothing'}"


def leaves_the_given_world(plugin: Plugin) -> None:
    """Leaves the world that it was given unchanged."""
    tunable = plugin()
    world = subject(tunable)
    same = deepcopy(world)
    tunable.edit(world, _another(tunable, tunable.read(world)))
    assert world == same, "it changes the given world; return a copy by dataclasses.replace"


def is_built_as_it_says(plugin: Plugin) -> None:
    """Edits a world that engines would build as it is, if they set nothing in place."""
    tunable = plugin()
    world = subject(tunable)
    edited = tunable.edit(world, _another(tunable, tunable.read(world)))
    assert edited.built(frozenset()) == edited.kind, "an engine would build another world; use World.edited, or replace"


def has_bounds_that_mean_something(plugin: Plugin) -> None:
    """Has bounds that ascend, within the limits of meaningful values."""
    tunable = plugin()
    bounds = (tunable.least, tunable.lower, tunable.upper, tunable.greatest)
    ascend = bounds[0] <= bounds[1] < bounds[2] <= bounds[3]
    assert ascend, f"least, lower, upper and greatest must ascend, and are {bounds}"


def has_the_details_of_every_tunable(plugin: Plugin) -> None:
    """Has the details of every tunable in the catalogue."""
    details = plugin.describe().details
    assert set(details) == DETAILS, f"its details are {sorted(details)}"


def flattened(value: Any, prefix: str = "") -> dict[str, Any]:  # noqa: ANN401 - nested
    """Return every leaf of a nested value by its dotted place."""
    if isinstance(value, dict):
        items = list(value.items())
    elif isinstance(value, tuple | list):
        items = list(enumerate(value))
    else:
        return {prefix.removeprefix("."): value}
    return {place: leaf for name, each in items for place, leaf in flattened(each, f"{prefix}.{name}").items()}


def _field(place: str) -> str:
    return ".".join(part for part in place.split(".") if not part.isdigit())


def _another(tunable: Tunable, value: float) -> float:
    return tunable.lower if value != tunable.lower else tunable.upper
