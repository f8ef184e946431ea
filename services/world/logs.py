"""Traces: what sensors of a physical robot said during a motion, read from a table.

A line is a moment, a column the pose of the base or one quantity of one joint: `elbow` or `angle elbow`, `speed elbow`,
`torque elbow`, `command elbow`. In brackets, a heading may say how the column relates to the joint:
`elbow [-deg @ 90]` counts against the joint, in degrees, from 90° where the joint is at zero.

Source: gaplab.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np
import scipy

from gaplab.schemas.traces import QUANTITIES, TRACE_COLUMNS, heading_parts, how_parts, said_of
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.csv_tables import Row, Table, finite, read_csv
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.world import Joint, World

MOST_LINES = 500_000
"""Most lines of a trace: 500 s at a kilohertz."""

MOST_NUMBERS = 8 * MOST_LINES
"""Most numbers of a trace: those of the longest trace of a base."""

LONGEST_S = 3_600.0
"""Longest trace."""

MOST_ERRORS = 100
"""Most errors that are told of one trace."""

TICKS = 4096.0
"""Ticks of a turn: the encoders of most hobby servos have 12 bits."""

_TIMES = {"": 1.0, "s": 1.0, "ms": 1000.0}
LENGTHS = {"": 1.0, "m": 1.0, "cm": 100.0, "mm": 1000.0}
ANGLES = {"": 1.0, "rad": 1.0, "deg": 180 / np.pi, "°": 180 / np.pi}
_TURNS = {**ANGLES, "ticks": TICKS / 2 / np.pi}
_TORQUES = {"": 1.0, "N·m": 1.0, "Nm": 1.0, "N": 1.0, "mN·m": 1000.0}
_POSE = {"time_s": _TIMES} | dict.fromkeys("xyz", LENGTHS) | {name: {"": 1.0, "1": 1.0} for name in TRACE_COLUMNS[4:]}
"""Units that a heading may state, with how many of each are one in SI."""


@dataclass(frozen=True, eq=False)
class Trace:
    """What a recording of a robot says, on a clock of its own; None for what it does not say.

    Attributes:
        times_s: `(k,)`, ascending.
        positions_m: `(k, 3)`, of the base.
        orientations: `(k, 4)`: quaternions x, y, z, w of the base.
        angles_rad: `(k, joints)`, in the world's order; m for a joint that slides; nan for one without a column.
        speeds_rad_s: `(k, joints)`, likewise.
        torques_nm: `(k, joints)`, likewise.
        commands: `(k, a)`: targets of the actuators, in the unit of what each motor follows.
        headings: heading of each column by what it says, like `angle elbow`.
        lines: `(k,)`: line of each moment; empty if it was not read from a file.
    """

    times_s: FloatArray
    positions_m: FloatArray | None = None
    orientations: FloatArray | None = None
    angles_rad: FloatArray | None = None
    speeds_rad_s: FloatArray | None = None
    torques_nm: FloatArray | None = None
    commands: FloatArray | None = None
    headings: Mapping[str, str] | None = None
    lines: Sequence[int] = ()

    @cached_property
    def _turns(self) -> "scipy.spatial.transform.Slerp":
        transform = scipy.spatial.transform
        return transform.Slerp(self.times_s, transform.Rotation.from_quat(self.orientations))

    def at(self, times_s: FloatArray) -> Trajectory:
        """Return what it says at times `(t,)`, interpolated; poses that it does not say are nan.

        Before and after the trace, it is as at its ends.
        """
        inside_s = np.clip(times_s, self.times_s[0], self.times_s[-1])
        turns = np.full((len(times_s), 4), np.nan) if self.orientations is None else self._turns(inside_s).as_quat()
        place = self._between(times_s, self.positions_m)
        others = (self.angles_rad, self.speeds_rad_s, self.torques_nm, self.commands)
        found = (self._between(times_s, each) for each in others)
        return Trajectory(times_s, np.full((len(times_s), 3), np.nan) if place is None else place, turns, *found)

    def _between(self, times_s: FloatArray, values: FloatArray | None) -> FloatArray | None:
        if values is None or not values.size:
            return None
        return np.stack([np.interp(times_s, self.times_s, column) for column in values.T], axis=-1)


class _Column(NamedTuple):
    """A column that is read: what it says, and value = (number − zero) / share + base."""

    what: str
    name: str
    heading: str
    place: int
    zero: float = 0.0
    share: float = 1.0
    base: float = 0.0
    wrong: str = ""


def read_trace(table: str | Table, pointer: str, world: World) -> Trace:
    """Return the trace of a robot from a table, or from one in CSV; further columns do not matter.

    It has the pose of the base, all joints that have a motor, or both.

    Raises:
        InvalidSpec: with every error, each with its line and column, at the pointer.
    """
    header, rows, lines = read_csv(table) if isinstance(table, str) else table
    columns = list(_columns(header.cells or [""], world))
    if lines > MOST_LINES or lines * len(columns) > MOST_NUMBERS:
        message, most = f"the trace has {lines:,} lines", min(MOST_LINES, MOST_NUMBERS // max(1, len(columns)))
        raise InvalidSpec([Violation(pointer, f"{lines:,} lines", message, f"at most {most:,}")])
    if (problem := _lacking(columns, world)) is not None:
        message, permitted = problem
        found = ",".join(header.cells)[:200]
        raise InvalidSpec([Violation(pointer, found, f"line {header.line}: {header.error or message}", permitted)])
    numbers, places, errors = _table(rows, columns)
    errors = [*(f"line {header.line}, {each.name}: {each.wrong}" for each in columns if each.wrong), *errors]
    if not errors:
        zeros, shares, bases = np.array([(each.zero, each.share, each.base) for each in columns]).T
        values = (np.array(numbers).reshape(-1, len(columns)) - zeros) / shares + bases
        by_name = {each.what: values[:, place] for place, each in enumerate(columns)}
        errors = list(islice(_nonsense(by_name, places, world), MOST_ERRORS))
    if errors:
        raise InvalidSpec([Violation(pointer, None, message) for message in errors[:MOST_ERRORS]])
    return _traced(by_name, {each.what: each.heading for each in columns}, places, world)


def _traced(
    columns: Mapping[str, FloatArray], headings: Mapping[str, str], lines: Sequence[int], world: World
) -> Trace:
    nothing = np.full(len(columns["time_s"]), np.nan)

    def joined(quantity: str, joints: Sequence[Joint]) -> FloatArray | None:
        found = [columns.get(f"{quantity} {joint.name}", nothing) for joint in joints]
        return frozen(np.column_stack(found)) if any(each is not nothing for each in found) else None

    place, turn = (
        frozen(np.column_stack([columns[name] for name in names])) if "x" in columns else None
        for names in (TRACE_COLUMNS[1:4], TRACE_COLUMNS[4:])
    )
    angles, speeds, torques = (joined(quantity, world.joints) for quantity in ("angle", "speed", "torque"))
    commands = joined("command", world.actuators)
    times_s = frozen(columns["time_s"])
    return Trace(times_s, place, turn, angles, speeds, torques, commands, headings, tuple(lines))


def _columns(headings: Sequence[str], world: World) -> Iterator[_Column]:
    """Yield the columns that say something; one that names a joint that the robot lacks is wrong."""
    joints = {joint.name: joint for joint in world.joints}
    for place, heading in enumerate(headings):
        name, how = heading_parts(heading)
        quantity, rest = ("angle", name) if name in joints else said_of(name)
        if name in TRACE_COLUMNS:
            yield _counted(_Column(name, name, heading, place), how, _POSE[name], None)
        elif rest in joints:
            joint, what = joints[rest], quantity or "angle"
            yield _counted(_Column(f"{what} {rest}", name, heading, place), how, _units(what, joint), joint.limits)
        elif name.startswith(f"{quantity} "):
            wrong = f"the robot has no joint {rest!r}; permitted: {', '.join(joints) or 'none'}"
            yield _Column(name, name, heading, place, wrong=wrong)


def _units(quantity: str, joint: Joint) -> Mapping[str, float]:
    """Return the units in which a quantity of a joint may be, with how many of each are one in the joint's own."""
    if quantity == "command":
        quantity = {"position": "angle", "velocity": "speed", "torque": "torque"}[joint.follows]
    own, (low, high) = LENGTHS if joint.slides else _TURNS, joint.limits or (0.0, 0.0)
    if low < high:
        own = {**own, "%": 100.0 / (high - low), "±%": 200.0 / (high - low)}
    speeds = {f"{unit}/s" if unit else "": share for unit, share in own.items()}
    return {"angle": own, "speed": speeds, "torque": _TORQUES}[quantity]


def _counted(column: _Column, how: str, units: Mapping[str, float], limits: tuple[float, float] | None) -> _Column:
    """Return a column with sign, unit and zero from its heading; percent are of the limits of its joint."""
    sign, unit, text = how_parts(how)
    zero, (low, high) = 0.0 if text is None else finite(text), limits or (0.0, 0.0)
    base = {"%": high if sign else low, "±%": (low + high) / 2}.get(unit, 0.0)
    if zero is None:
        return column._replace(wrong=f"{text!r} is not a number, where the joint is at zero")
    if unit not in units:
        return column._replace(wrong=f"the unit {unit!r} is not known; permitted: {', '.join(filter(None, units))}")
    return column._replace(zero=zero, share=-units[unit] if sign else units[unit], base=base)


def _lacking(columns: Sequence[_Column], world: World) -> tuple[str, str] | None:
    """Return what a trace lacks or has twice, and what is permitted; None if nothing."""
    names = [each.what for each in columns if not each.wrong.startswith("the robot")]
    angles = [f"angle {joint.name}" for joint in world.actuators]
    joints = any(name.partition(" ")[0] in QUANTITIES for name in names)
    pose = TRACE_COLUMNS[1:] if not joints or any(name in TRACE_COLUMNS[1:] for name in names) else ()
    needed = ["time_s", *pose, *(angles if joints else ())]
    twice = {name for name in names if names.count(name) > 1}
    if not (missing := [name for name in needed if name not in names or name in twice] or sorted(twice)):
        return None
    ways = [", ".join(TRACE_COLUMNS), *([", ".join(["time_s", *angles])] if angles else [])]
    return f"the trace needs one column each of {', '.join(missing)}", "; or ".join(ways)


def _table(rows: Iterable[Row], columns: Sequence[_Column]) -> tuple[list[list[float]], list[int], list[str]]:
    """Return the numbers of all rows, their lines, and what is wrong; nothing is read after `MOST_ERRORS`."""
    numbers, lines, errors = list[list[float]](), list[int](), list[str]()
    for line, cells, error in rows:
        found = [finite(cells[each.place]) if each.place < len(cells) else None for each in columns]
        known = [number for number in found if number is not None]
        if error:
            errors.append(f"line {line}: {error}")
        elif len(known) == len(found):
            numbers.append(known)
            lines.append(line)
        else:
            wrong = (each for each, number in zip(columns, found, strict=True) if number is None)
            shown = ((each.name, "".join(map(str, cells[each.place : each.place + 1]))[:50]) for each in wrong)
            errors += [f"line {line}, {name}: {cell!r} is not a finite number" for name, cell in shown]
        if len(errors) >= MOST_ERRORS:
            break
    return numbers, lines, errors


def _nonsense(columns: Mapping[str, FloatArray], lines: Sequence[int], world: World) -> Iterator[str]:
    """Yield what is wrong with a table: too short, times that do not ascend, quaternions whose norm is not 1."""
    times_s = columns["time_s"]
    if len(times_s) < 2:
        yield f"the trace has {len(times_s)} rows; at least 2 are needed"
        return
    for place in np.nonzero(np.diff(times_s) <= 0)[0][:3]:
        before, after = times_s[place : place + 2].tolist()
        yield f"line {lines[place + 1]}: time_s must ascend, and {after} follows {before}"
    duration = times_s[-1] - times_s[0]
    if not (shortest := world.time_step_s) <= duration <= LONGEST_S:
        wanted = f"at most {LONGEST_S:g}" if duration > LONGEST_S else f"at least a time step of {shortest:.3g}"
        yield f"the trace lasts {duration:g} s; {wanted} s are permitted"
    if "qx" not in columns:
        return
    sizes = np.linalg.norm([columns[name] for name in TRACE_COLUMNS[4:]], axis=0)
    for place in np.nonzero(np.abs(sizes - 1.0) > 0.01)[0][:3]:
        yield f"line {lines[place]}: qx, qy, qz, qw have norm {sizes[place]:.3g}; permitted: 1, as of a rotation"
