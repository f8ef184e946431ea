"""Import of pools: tables and files that a robot's sensors filled are checked line by line, and become recordings."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from gaplab.api.clients.trace_files import lerobot_tables, mapped, recording
from gaplab.api.library.robots import AnyRobot, invalid, read_robot
from gaplab.schemas.robots import MOST_LOSSES
from gaplab.schemas.traces import TRACE_COLUMNS, heading_parts
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.csv_tables import Row, Table, finite
from gaplab.services.world.logs import ANGLES, LENGTHS, Trace, read_trace
from gaplab.services.world.motions import Start
from gaplab.services.world.pools import DIRECTIONS, PLACES, Channel, Pool, Recorded, said
from gaplab.services.world.sensing import JOINTS
from gaplab.services.world.traces import unlikely_joints
from gaplab.services.world.world import World

NOISES = {"place": 0.002, "direction": 0.02, "angle": 0.002, "speed": 0.05, "torque": 0.05}
"""Standard deviations of sensors by default: m, no unit, rad, rad/s and N·m."""

DECIMALS = 6
"""Decimals that a pool keeps."""

GAP = 4.0
"""How many usual intervals without a line are a gap, in which nothing is read."""

LONGEST = 200
"""Most characters of the name of a recording."""

USUAL = ("base", "angle")
"""Groups of sensors that are read by default, where there are such columns."""

_VELOCITIES = "vx", "vy", "vz"
_TURNING = "wx", "wy", "wz"
_BASE = re.compile(rf"({'|'.join((*TRACE_COLUMNS, *_VELOCITIES, *_TURNING))})(?:_(mm|cm|m|rad|deg))?(?:_s)?")
"""A column of the base, whose name may end in its unit."""

_UNITS: Mapping[tuple[str, ...], Mapping[str, float]] = {_VELOCITIES: LENGTHS, _TURNING: ANGLES}
"""Units of velocities, each per second."""


@dataclass(frozen=True)
class PoolOptions:
    """What becomes of a table or a folder.

    Attributes:
        columns: by joint, or `*` for all others, its name in the tables, and how it counts; see `Bench.attach_trace`.
        recording: the column that names the recording of a line.
        sensors: groups to read: `base`, or of it `place` or `direction` alone, and `angle`, `speed`, `torque`; empty:
            the base if it moves, and angles.
        noises: standard deviations in place of `NOISES`, perhaps as texts.
        seconds: longest part of a recording, from its beginning; None: all.
        every_s: interval of the readings; None: that of the lines.
        confirmed: take unlikely recordings.
        skip: leave recordings with errors out, and say so, instead of refusing all.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    recording: str = "recording"
    sensors: Sequence[str] = ()
    noises: Mapping[str, float | str] = field(default_factory=dict)
    seconds: float | None = None
    every_s: float | None = None
    confirmed: bool = False
    skip: bool = False


class _Read(NamedTuple):
    """A recording that was read, and the velocities with which its base begins."""

    name: str
    trace: Trace
    velocity_m_s: Any
    turning_rad_s: Any


def import_pool(source: str | Path, robot: AnyRobot, name: str, options: PoolOptions | None = None) -> Pool:
    """Return the pool of a table with a line for each time and a column that names the recording, or of a folder.

    A table is CSV or Parquet. A folder has a file for each recording, in CSV or MCAP, or is a LeRobot data set.

    Raises:
        InvalidSpec: with every error, at the recording that has it; messages have the line and what is permitted.
        ExtraMissing: what reads Parquet or MCAP is not installed.
        ValueError: a file cannot be read.
    """
    chosen, world, path = options or PoolOptions(), read_robot(robot).world, Path(source)
    if unfit := list(_unfit(chosen)):
        raise InvalidSpec(unfit)
    found, errors, names = list[_Read](), list[Violation](), set[str]()
    for part, table in _recordings(path, chosen.recording):
        try:
            read = _read(part, table, chosen, world)
            told = [] if chosen.confirmed else list(unlikely_joints(read.trace, world))
            told += [f"two motions are named {part}"] * (part in names)
            told += _unlike(read, found[0] if found else read, chosen)
            found += [] if told else [read]
            errors += (Violation(f"/{part}", None, each) for each in told)
        except InvalidSpec as error:
            errors += error.violations
        names.add(part)
    if errors and not (chosen.skip and found):
        raise InvalidSpec([*{each.message: each for each in reversed(errors)}.values()][::-1])
    if not found:
        wanted = "a CSV or MCAP file for each recording in a folder, or a line for each time in a table"
        raise InvalidSpec([Violation("/", path.name, f"{path.name} has no recording: it needs {wanted}", wanted)])
    lost = sorted({f"{each.pointer[1:]} is left out: {each.message}"[:900] for each in errors})
    try:
        pool = _pool(found, world, chosen, name, path.name, lost)
    except ValidationError as error:
        raise invalid(error, {}) from error
    return Pool.read(pool.text.encode())  # as whoever gets it will


def _unfit(options: PoolOptions) -> Iterator[Violation]:
    noises = {f"noises/{each}": value for each, value in options.noises.items()}
    for name, value in {"seconds": options.seconds, "every_s": options.every_s, **noises}.items():
        if value is not None and not (finite(value) or 0.0) > 0:
            yield Violation(f"/{name}", value, f"must be a number above 0, not {value}", "above 0")
    named = ("/sensors", options.sensors, ["base", *NOISES]), ("/noises", options.noises, [*NOISES])
    for pointer, groups, permitted in named:
        for group in groups:
            if group not in permitted:
                yield Violation(pointer, group, f"unknown {group!r}; permitted: {', '.join(permitted)}", permitted)


def _unlike(read: _Read, first: _Read, options: PoolOptions) -> Iterator[str]:
    """Yield that a recording has no name, other columns than the first, or ends before anything is read."""
    trace, size = read.trace, len(read.name)
    if not 0 < size <= LONGEST:
        yield f"line {trace.lines[0]}: the name of a recording has 1 to {LONGEST} characters, not {size}"
    if differ := {*(trace.headings or ())} ^ {*(first.trace.headings or ())}:
        yield f"its columns are not those of {first.name}: {', '.join(sorted(differ))}"
    every_s, lasts = _interval(first.trace, options), trace.times_s[-1] - trace.times_s[0]
    if round(every_s, DECIMALS) > lasts + 1e-9:
        yield f"it lasts {lasts:g} s, and the interval of readings, {every_s:g} s, is longer"


def _interval(first: Trace, options: PoolOptions) -> float:
    return options.every_s or float(np.median(np.diff(first.times_s)))


def _recordings(path: Path, column: str) -> Iterator[tuple[str, Table]]:
    """Yield each recording by its name: an episode, a file of a folder, or the lines of a table with this name."""
    if (path / "meta" / "info.json").is_file():
        yield from ((f"episode {number}", table) for number, table in lerobot_tables(path).items())
    elif path.is_dir():
        files = sorted(each for each in path.iterdir() if each.suffix.lower() in {".csv", ".mcap"})
        yield from ((file.stem, recording(file)) for file in files)
    else:
        header, rows, _ = recording(path)
        if column not in header.cells:
            columns = ", ".join(header.cells)[:500]
            raise InvalidSpec([Violation("/", column, f"line 1: no column {column!r} names the recordings", columns)])
        place = header.cells.index(column)
        others = header._replace(cells=["" if each == column else each for each in header.cells])
        for name, lines in groupby(rows, key=lambda row: "".join(map(str, row.cells[place : place + 1]))):
            some = [*lines]
            yield name, Table(others, some, len(some) + 1)


def _read(name: str, table: Table, options: PoolOptions, world: World) -> _Read:
    """Return a recording; its base is read only if it moves."""
    columns = [_column(each) for each in table.header.cells]
    unread = {*_VELOCITIES, *_TURNING, *(TRACE_COLUMNS[1:] if world.fixed else ())}
    bare = ["" if each in unread else f"{each} [{unit}]" if unit else each for each, unit in columns]
    place = bare.index("time_s") if "time_s" in bare else len(bare)
    rows = [*_until(table.rows, place, options.seconds or np.inf)]
    found = mapped(Table(table.header._replace(cells=bare), rows, len(rows) + 1), options.columns)
    trace = read_trace(found, f"/{name}", world)
    return _Read(name, trace, *(None if world.fixed else _velocity(name, axes, columns, rows[0]) for axes in _UNITS))


def _column(heading: str) -> tuple[str, str]:
    """Return the name and the unit of a column of the base, "" if that is SI's; of another, its whole heading."""
    name, unit = heading_parts(heading)
    if (match := _BASE.fullmatch(name)) is None:
        return heading, ""
    return match[1], unit or ("" if match[2] in {None, "m", "rad"} else match[2])


def _velocity(name: str, axes: tuple[str, ...], columns: Sequence[tuple[str, str]], first: Row) -> Any:  # noqa: ANN401 - three numbers, or None
    """Return the velocity along axes that the first row of a recording says, in SI; None if no column does.

    Raises:
        InvalidSpec: a column is missing, its unit is unknown, or its number is not finite.
    """
    places, found, errors = {each: place for place, (each, _) in enumerate(columns)}, list[float](), list[str]()
    for axis in axes if {*axes} & {*places} else ():
        if axis not in places:
            errors.append(f"{axis} has no column, beside others of {', '.join(axes)}")
            continue
        unit, cell = columns[places[axis]][1], "".join(map(str, first.cells[places[axis] :][:1]))
        if (share := _UNITS[axes].get(unit.removesuffix("/s"))) is None:
            permitted = ", ".join(f"{each}/s" for each in _UNITS[axes] if each)
            errors.append(f"{axis}: the unit {unit!r} is not known; permitted: {permitted}")
        elif (number := finite(cell)) is None:
            errors.append(f"line {first.line}, {axis}: {cell!r} is not a finite number")
        else:
            found.append(number / share)
    if errors:
        raise InvalidSpec(Violation(f"/{name}", None, each) for each in errors)
    return tuple(found) or None


def _until(rows: Iterable[Row], place: int, seconds: float) -> Iterator[Row]:
    """Yield the rows up to the first one after so many seconds, which readings are interpolated to."""
    begun = None
    for number, row in enumerate(rows):
        yield row
        at = finite(row.cells[place]) if place < len(row.cells) else None
        begun = at if number == 0 else begun
        if begun is not None and at is not None and at - begun > seconds:
            return


def _pool(found: Sequence[_Read], world: World, options: PoolOptions, name: str, source: str, lost: list[str]) -> Pool:
    spans = [each.trace.times_s[-1] - each.trace.times_s[0] for each in found]
    every_s = _interval(found[0].trace, options)
    longest_s = min(max(spans), options.seconds or np.inf)
    times_s = np.round(every_s * np.arange(1, np.floor(longest_s / every_s + 1e-6) + 1), DECIMALS)
    first = found[0].trace
    driven, joints = _whole(first.commands), _whole(first.angles_rad)
    channels = _channels(options, world, first, joints)
    if not len(times_s) or not channels:
        message = f"nothing is read: {len(channels)} sensors, every {every_s:g} s for {longest_s:g} s"
        raise InvalidSpec([Violation("/", None, message, "a sensor, and an interval below the longest recording")])
    recordings = tuple(_recorded(each, world, channels, (driven, joints), times_s, lost) for each in found)
    return Pool(
        name=name,
        source=source,
        lost=tuple(lost[: MOST_LOSSES - 1] + [f"and {len(lost) - MOST_LOSSES + 1} more"] * (len(lost) >= MOST_LOSSES)),
        sensors=channels,
        times_s=tuple(times_s.tolist()),
        joints=tuple(world.joints[place].name for place in joints),
        actuators=tuple(world.actuators[place].name for place in driven),
        recordings=recordings,
    )


def _channels(options: PoolOptions, world: World, first: Trace, joints: Sequence[int]) -> tuple[Channel, ...]:
    """Return the sensors of which a recording has columns, in the groups that are read.

    Raises:
        InvalidSpec: it has none of a group that is read, unless that is usual.
    """
    groups, there = options.sensors or USUAL, dict[str, list[tuple[str, str]]]()
    if first.positions_m is not None:
        there = {"place": [(each, "m") for each in PLACES], "direction": [(each, "") for each in DIRECTIONS]}
    for group, (field_, units) in JOINTS.items():
        read = [world.joints[place] for place in _whole(getattr(first, field_)) if place in joints]
        there[group] = [(f"{group} {joint.name}", units[joint.slides]) for joint in read]
    for group in groups:
        if group not in USUAL and not there.get(group):
            permitted = [each for each, found in there.items() if found]
            message = f"no column says the {group}; there are columns of {', '.join(permitted) or 'nothing'}"
            raise InvalidSpec([Violation("/sensors", group, message, permitted)])
    noises = {**NOISES, **options.noises}
    chosen = {*groups, *(("place", "direction") if "base" in groups else ())}
    each = ((noises[group], *channel) for group, found in there.items() if group in chosen for channel in found)
    return tuple(Channel(name=name, unit=unit, noise=float(noise)) for noise, name, unit in each)


def _recorded(
    read: _Read,
    world: World,
    channels: Sequence[Channel],
    places: tuple[Sequence[int], Sequence[int]],
    times_s: FloatArray,
    lost: list[str],
) -> Recorded:
    trace, (driven, joints) = read.trace, places
    own_s = trace.times_s - trace.times_s[0]
    at_s = times_s[times_s <= own_s[-1] + 1e-9]
    seen = said([each.name for each in channels], trace.at(trace.times_s[0] + np.minimum(at_s, own_s[-1])), world)
    steps = np.diff(own_s)
    gaps = steps > GAP * np.median(steps)
    within = np.minimum(np.searchsorted(own_s, at_s), len(own_s) - 1)
    seen[gaps[np.maximum(within - 1, 0)] & (own_s[within] != at_s)] = np.nan
    lost += [f"{read.name}: nothing for {steps[each]:.3g} s after {own_s[each]:.3g} s" for each in np.flatnonzero(gaps)]
    start = Start(
        position_m=_row(trace.positions_m),
        turn=_row(trace.orientations),
        velocity_m_s=read.velocity_m_s,
        turning_rad_s=read.turning_rad_s,
        angles_rad=_row(trace.angles_rad, joints),
        speeds_rad_s=_row(trace.speeds_rad_s, joints),
    )
    commands = trace.commands[:, driven] if trace.commands is not None and len(driven) else np.empty((len(own_s), 0))
    changed = np.concatenate([[len(driven) > 0], (commands[1:] != commands[:-1]).any(axis=1)]) & (own_s <= times_s[-1])
    return Recorded(
        name=read.name,
        start=start,
        times_s=tuple(_rounded(own_s[changed])),
        commands=tuple(map(tuple, _rounded(commands[changed]))),
        readings=tuple(tuple(None if np.isnan(x) else x for x in row) for row in _rounded(seen)),
    )


def _whole(values: FloatArray | None) -> list[int]:
    """Return the columns of values in which none is missing; nothing without values."""
    there = [] if values is None else np.flatnonzero(np.isfinite(values).all(axis=0)).tolist()
    return [int(each) for each in there]


def _rounded(values: FloatArray) -> list[Any]:
    return list((np.round(values, DECIMALS) + 0.0).tolist())  # without negative zero


def _row(values: FloatArray | None, places: Any = slice(None)) -> Any:  # noqa: ANN401 - a tuple of some length
    """Return the first row of values, some places of it; None without values."""
    return None if values is None else tuple(_rounded(np.nan_to_num(values[0, places])))
