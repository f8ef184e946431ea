"""The contract of a tunable."""

from dataclasses import asdict
from typing import Any

from gaplab.services.core.robots.quadruped import Quadruped
from gaplab.services.core.tunables.base import Tunable

Plugin = type[Tunable]
DETAILS = {"field", "unit", "lower", "upper", "least", "greatest"}


def reads_back_what_it_wrote(plugin: Plugin) -> None:
    """Reads back the value that it wrote."""
    tunable = plugin()
    value = (tunable.lower + tunable.upper) / 2
    read = tunable.read(tunable.edit(Quadruped().world, value))
    assert read == value, f"it wrote {value} and reads {read}"


def edits_its_field_alone(plugin: Plugin) -> None:
    """Edits the field of the world that it declares, and no other."""
    tunable, world = plugin(), Quadruped().world
    before = flattened(asdict(world))
    after = flattened(asdict(tunable.edit(world, _another(tunable, tunable.read(world)))))
    changed = sorted({_field(place) for place in before if before[place] != after.get(place)})
    ends = tunable.field.rpartition(".")[2]
    same = bool(changed) and all(field.endswith(ends) for field in changed)
    assert same, f"it declares the field {tunable.field!r}, and changes {', '.join(changed) or 'nothing'}"


def leaves_the_given_world(plugin: Plugin) -> None:
    """Leaves the world that it was given unchanged."""
    tunable, world = plugin(), Quadruped().world
    before = tunable.read(world)
    tunable.edit(world, _another(tunable, before))
    assert tunable.read(world) == before, "it changes the given world; return a copy by dataclasses.replace"


def has_bounds_that_mean_something(plugin: Plugin) -> None:
    """Has bounds that ascend, within the limits of meaningful values."""
    bounds = (plugin.least, plugin.lower, plugin.upper, plugin.greatest)
    ascend = bounds[0] <= bounds[1] < bounds[2] <= bounds[3]
    assert ascend, f"least, lower, upper and greatest must ascend, and are {bounds}"


def is_described(plugin: Plugin) -> None:
    """Has a docstring whose first line is a sentence."""
    described = plugin.describe()
    assert described.summary.endswith("."), f"its summary is {described.summary!r}; end it with a full stop"
    assert set(described.details) == DETAILS, f"its details are {sorted(described.details)}"


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
    """Return a place without the numbers of items."""
    return ".".join(part for part in place.split(".") if not part.isdigit())


def _another(tunable: Tunable, value: float) -> float:
    return tunable.lower if value != tunable.lower else tunable.upper


CHECKS = (
    reads_back_what_it_wrote,
    edits_its_field_alone,
    leaves_the_given_world,
    has_bounds_that_mean_something,
    is_described,
)
