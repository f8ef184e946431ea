"""Differences between resolved specs, setting by setting."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gaplab.schemas.differences import DiffColumn, SettingRead, SpecDiff, Values
from gaplab.schemas.mistakes import pointer_to
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.specs.stored_specs import spec_of

NO_SETTINGS = {"name", "priority", "max_parallel"}
"""Fields of a spec that change no number."""

UNSPOKEN = {"name", "options", "parameters"}
"""Parts of a pointer that its words leave out."""

WORDS = {"lower": "lower bound", "upper": "upper bound"}

Path = tuple[str, ...]
"""Place of a setting. A tunable has its name in it, not its position."""


@dataclass(frozen=True)
class SpecColumn:
    """The resolved specs of a study's experiments, or of one experiment, as stored.

    A null parameter of reality is hidden.
    """

    id: str
    name: str
    specs: tuple[Mapping[str, Any], ...]


def differences(columns: Sequence[SpecColumn]) -> SpecDiff:
    """Return the settings that differ between the columns.

    A setting that some columns lack differs only if the others differ. Its absence follows from another setting that
    differs: options from their plug-in, bounds from the list of tunables.

    Raises:
        InvalidSpec: there are fewer than two columns.
    """
    if len(columns) < 2:
        message = "a comparison of settings needs two experiments or studies, or one study with several experiments"
        raise InvalidSpec([Violation("experiment", [column.id for column in columns], message)])
    tables = [[dict(_settings(spec)) for spec in column.specs] for column in columns]
    pointers = _pointers(settings for table in tables for settings in table)
    values = {path: tuple(_distinct(path, table) for table in tables) for path in pointers}
    hidden = {path for path in values if any(_is_hidden(path, cell) for cell in values[path])}
    differing = {path for path in values if _differs([cell for cell in values[path] if not _is_hidden(path, cell)])}
    if ("task",) not in values and ("task", "name") not in differing:  # a spec of the same task lacks what nobody gave
        differing |= {path for path in values if path[:2] == ("task", "options") and not all(values[path])}
    equal, concealed = len(values) - len(differing | hidden), sorted(hidden - differing, key=_order)
    later = f" Parameters of reality are compared once they may be shown: {len(concealed)} are hidden."
    return SpecDiff(
        columns=tuple(DiffColumn(id=column.id, name=column.name, experiments=len(column.specs)) for column in columns),
        settings=tuple(
            SettingRead(
                pointer=pointers[path],
                setting=in_words(path),
                values=values[path],
                texts=tuple(map(text_of, values[path])),
            )
            for path in sorted(differing, key=_order)
        ),
        equal=equal,
        note=f"{equal} other settings are equal.{later if concealed else ''}",
        hidden=tuple(pointers[path] for path in concealed),
    )


def all_settings(column: SpecColumn) -> tuple[tuple[str, str, str], ...]:
    """Return the pointer of each setting of a column, the setting and its values in words, in the order of reading."""
    table = [dict(_settings(spec)) for spec in column.specs]
    pointers = _pointers(table)
    return tuple(
        (pointers[path], in_words(path), text_of(_distinct(path, table))) for path in sorted(pointers, key=_order)
    )


def in_words(path: Path) -> str:
    """Return a setting in words: `simulator evaluations of the budget`."""
    spoken = [WORDS.get(part, part).replace("_", " ") for part in path if part not in UNSPOKEN]
    if path[0] in {"tunables", "reality"}:
        return " of ".join(reversed(spoken[1:] if path[0] == "tunables" and len(spoken) > 1 else spoken))
    return " of the ".join(reversed(spoken))


def text_of(values: Values) -> str:
    """Return the distinct values of a setting in words; a dash where there is none."""
    return ", ".join(map(_value, values)) or "\N{EN DASH}"


def _value(value: Any) -> str:  # noqa: ANN401 - JSON
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return f"{len(value):,}, listed in the spec"
    if isinstance(value, list):
        return " + ".join(map(_value, value)) or "none"
    if value is None or isinstance(value, bool):
        return {None: "none or hidden", True: "yes", False: "no"}[value]
    return f"{value:g}" if isinstance(value, float) else str(value)


def _settings(stored: Mapping[str, Any]) -> Iterator[tuple[Path, tuple[str, Any]]]:
    spec = spec_of(stored).model_dump(mode="json", exclude=NO_SETTINGS)
    spec["reality"]["parameters"] = stored["reality"]["parameters"]
    tunables = spec.pop("tunables")
    yield from _leaves((), "", spec)
    yield ("tunables",), ("/tunables", [tunable["name"] for tunable in tunables])
    for position, tunable in enumerate(tunables):
        for bound in ("lower", "upper"):
            yield ("tunables", tunable["name"], bound), (f"/tunables/{position}/{bound}", tunable[bound])


def _leaves(path: Path, pointer: str, value: Any) -> Iterator[tuple[Path, tuple[str, Any]]]:  # noqa: ANN401 - JSON
    if not isinstance(value, dict):
        yield path, (pointer, value)
        return
    for name, inner in value.items():
        yield from _leaves((*path, name), pointer + pointer_to([name]), inner)


def _pointers(table: Iterable[Mapping[Path, tuple[str, Any]]]) -> dict[Path, str]:
    found: dict[Path, str] = {}
    for settings in table:
        for path, (pointer, _) in settings.items():
            found.setdefault(path, pointer)
    return found


def _distinct(path: Path, table: Sequence[Mapping[Path, tuple[str, Any]]]) -> Values:
    found: list[Any] = []
    for settings in table:
        if path in settings and settings[path][1] not in found:
            found.append(settings[path][1])
    return tuple(found)


def _differs(values: Sequence[Values]) -> bool:
    """Return whether two columns that have the setting have other values."""
    first, *others = [cell for cell in values if cell] or [()]
    return any(any(value not in other for value in first) or len(other) != len(first) for other in others)


def _is_hidden(path: Path, cell: Values) -> bool:
    return path[:2] == ("reality", "parameters") and None in cell


def _order(path: Path) -> tuple[int, Path]:
    """Return the place of a setting: what people compare most comes first."""
    sections = ("strategy", "robot", "engine", "tunables", "reality", "iterations", "repetitions", "budget", "seed")
    return (sections.index(path[0]) if path[0] in sections else len(sections)), path
