"""Pools: recordings of what a robot did, as a file without code, like its robot file.

Sensors of a free base are `x`, `y`, `z`, and the directions of the body's x and y axes, `x axis x` to `y axis z`, which
have no jumps as angles have. Those of joints are `angle NAME`, `speed NAME` and `torque NAME`.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Any, TypeAlias

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen
from gaplab.schemas.robots import FileKind
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.core.errors import Violation
from gaplab.services.world.kinematics import rotated
from gaplab.services.world.motions import Motion, Start, Trajectory
from gaplab.services.world.robot_files import NamedFile
from gaplab.services.world.sensing import AXES, JOINTS
from gaplab.services.world.world import World

PLACES = AXES
DIRECTIONS = tuple(f"{body} axis {axis}" for body in AXES[:2] for axis in AXES)
"""Sensors of a free base, in metres and without unit."""

OF_BASE = ("position_m", "turn", "velocity_m_s", "turning_rad_s")
"""Parts of a start that are of the base."""

MOST_BYTES = 8_000_000
"""Largest size of a pool: an archive has it as one row. Fewer readings, or fewer decimals, make it smaller."""

MOST_RECORDINGS = 10_000

NOT_UNIT = 0.01
"""How far the norm of a rotation may be from 1, as in traces."""

_Text: TypeAlias = Annotated[str, Field(min_length=1, max_length=200)]
_Row: TypeAlias = tuple[float, ...]


class Channel(Frozen):
    """A sensor: its name, its unit, and the standard deviation of its noise in that unit."""

    name: _Text
    unit: Annotated[str, Field(max_length=20)] = ""
    noise: Annotated[float, Field(gt=0)]


class Recorded(Frozen):
    """A recording: one motion.

    Attributes:
        name: unlike that of all others of the pool.
        start: how it began; its joints are those of the pool, and what is left out is as the world has it.
        times_s: `(k,)`, ascending from 0: when commands changed.
        commands: `(k, a)`: the commands of the pool's actuators from each time on.
        readings: `(r, s)`: a row for each of the pool's times up to its end; null where a sensor failed.
    """

    name: _Text
    start: Start = Start()
    times_s: _Row = ()
    commands: tuple[_Row, ...] = ()
    readings: Annotated[tuple[tuple[float | None, ...], ...], Field(min_length=1)]


class Pool(NamedFile):
    """Recordings of one robot.

    Attributes:
        source: where they come from, in words.
        sensors: what was read.
        times_s: `(r,)`, ascending: seconds from the beginning of a recording at which all sensors were read.
        joints: those whose angles and speeds recordings begin with.
        actuators: those that were commanded.
        recordings: at least one.
    """

    kind, what, most_bytes = FileKind.POOL, "pool", MOST_BYTES
    kept = 4  # one has a million numbers

    source: Annotated[str, Field(max_length=1_000)] = ""
    sensors: Annotated[tuple[Channel, ...], Field(min_length=1, max_length=1_000)]
    times_s: Annotated[_Row, Field(min_length=1)]
    joints: tuple[_Text, ...] = ()
    actuators: tuple[_Text, ...] = ()
    recordings: Annotated[tuple[Recorded, ...], Field(min_length=1, max_length=MOST_RECORDINGS)]

    def readings(self, number: int) -> FloatArray:
        """Return `(r, s)`: what the sensors said in a recording, in their units; nan after its end."""
        given = np.array(self.recordings[number].readings, dtype=np.float64)  # None becomes nan
        table = np.full((len(self.times_s), len(self.sensors)), np.nan)
        table[: len(given)] = given
        return table

    def motion(self, number: int, world: World) -> Motion:
        """Return the motion of a recording: its commands, from its start; other actuators rest."""
        recorded, start = self.recordings[number], self.recordings[number].start
        angles = self._of_joints(start.angles_rad, world, [joint.start for joint in world.joints])
        speeds = self._of_joints(start.speeds_rad_s, world, [0.0] * len(world.joints))
        begun = dict(zip((joint.name for joint in world.joints), angles or (), strict=False))
        rest = [begun.get(each.name, each.start) if each.follows == "position" else 0.0 for each in world.actuators]
        times_s = frozen(recorded.times_s or [0.0])
        targets = np.tile(rest, (len(times_s), 1))
        places = {joint.name: place for place, joint in enumerate(world.actuators)}
        for column, name in enumerate(self.actuators if recorded.times_s else ()):
            targets[:, places[name]] = [row[column] for row in recorded.commands]
        start = replace(start, angles_rad=angles, speeds_rad_s=speeds)
        until_s = float(self.times_s[len(recorded.readings) - 1])
        observe_s = frozen(self.times_s)
        return Motion(times_s, frozen(targets), observe_s, start=start, until_s=until_s, read=self.joints)

    def _of_joints(self, given: _Row | None, world: World, others: Sequence[float]) -> _Row | None:
        known = dict(zip(self.joints, given or (), strict=False))
        found = (known.get(joint.name, other) for joint, other in zip(world.joints, others, strict=True))
        return None if given is None else tuple(found)

    def violations(self) -> Iterator[Violation]:
        """Yield what is inconsistent: names that occur twice, times that do not ascend, rows of wrong length."""
        lists = {"sensors": [each.name for each in self.sensors], "joints": self.joints, "actuators": self.actuators}
        for place, names in {**lists, "recordings": [each.name for each in self.recordings]}.items():
            for name, count in Counter(names).items():
                if count > 1:
                    yield Violation(f"/{place}", name, f"{count} {place} are named {name}; each name is permitted once")
        yield from _time_violations("/times_s", self.times_s)
        for column, sensor in enumerate(self.sensors):
            read = (cell for each in self.recordings for row in each.readings for cell in row[column : column + 1])
            if all(cell is None for cell in read):
                message = f"the sensor {sensor.name} has no reading in any recording"
                yield Violation(f"/sensors/{column}", sensor.name, message, "a sensor that was read, or left out")
        for number, each in enumerate(self.recordings):
            for violation in _recording_violations(self, each):
                yield violation.moved("", f"/recordings/{number}")

    def facts(self) -> dict[str, Any]:
        """Return what lists say of it."""
        return {
            "origin": self.source,
            "recordings": len(self.recordings),
            "sensors": tuple(each.name for each in self.sensors),
            "actuators": self.actuators,
            "seconds": self.times_s[-1],
        }

    @property
    def commands(self) -> FloatArray | None:
        """Return `(n, r · a)`: the commands at the pool's times, over their deviation; None without any."""
        if not self.actuators:
            return None
        table = np.full((len(self.recordings), len(self.times_s), len(self.actuators)), np.nan)
        for row, each in zip(table, self.recordings, strict=True):
            at = np.searchsorted(each.times_s, self.times_s[: len(each.readings)], side="right") - 1
            row[: len(each.readings)] = np.array(each.commands)[np.maximum(at, 0)]
        deviation = np.nanstd(table, axis=(0, 1))
        return frozen((table / np.where(deviation > 0, deviation, 1.0)).reshape(len(table), -1))


EXAMPLE = Pool(
    name="example",
    sensors=tuple(Channel(name=axis, unit="m", noise=0.005) for axis in PLACES),
    times_s=(0.25, 0.5),
    recordings=tuple(Recorded(name=name, readings=((0.0, 0.0, 0.1),)) for name in ("first", "second")),
)
"""A pool for any robot: it rests, twice."""


def _recording_violations(pool: Pool, each: Recorded) -> Iterator[Violation]:
    yield from _time_violations("/times_s", each.times_s)
    if each.times_s and each.times_s[0] > 0:
        message = f"the commands of recording {each.name} begin at {each.times_s[0]:g} s; before that, none is known"
        yield Violation("/times_s/0", each.times_s[0], message, "0")
    if each.start.turn is not None and abs((size := float(np.linalg.norm(each.start.turn))) - 1.0) > NOT_UNIT:
        message = f"the turn at the start of recording {each.name} has norm {size:.3g}, and a rotation has 1"
        yield Violation("/start/turn", each.start.turn, message, "x, y, z, w of norm 1")
    began = [each.start.angles_rad or pool.joints, each.start.speeds_rad_s or pool.joints]
    tables: tuple[tuple[str, Sequence[Sequence[Any]], int], ...] = (
        ("readings", each.readings, len(pool.sensors)),
        ("commands", each.commands, len(pool.actuators)),
        ("start", began, len(pool.joints)),
    )
    for name, rows, width in tables:
        if wrong := {len(row) for row in rows} - {width}:
            message = f"a row of the {name} of recording {each.name} has {min(wrong)} numbers, not {width}"
            yield Violation(f"/{name}", min(wrong), message, f"exactly {width}")
    if len(each.commands) != len(each.times_s) or (bool(pool.actuators) != bool(each.times_s)):
        message = f"recording {each.name} has {len(each.commands)} commands at {len(each.times_s)} times"
        yield Violation("/commands", len(each.commands), message, "one of each actuator at each time")
    if len(each.readings) > len(pool.times_s):
        message = f"recording {each.name} has {len(each.readings)} readings, and the pool {len(pool.times_s)} times"
        yield Violation("/readings", len(each.readings), message, f"at most {len(pool.times_s)}")


def _time_violations(pointer: str, times_s: Sequence[float]) -> Iterator[Violation]:
    for place, (before, after) in enumerate(zip((-1e-9, *times_s), times_s, strict=False)):
        if after <= before:
            yield Violation(
                f"{pointer}/{place}", after, f"times ascend from 0, and {after} follows {before}", "ascending"
            )
            return


def fit_violations(pool: Pool, world: World, robot: str, pointer: str) -> Iterator[Violation]:
    """Yield sensors, joints and actuators of a pool that a robot lacks, and starts of a base that never moves."""
    joints, actuators = ([each.name for each in some] for some in (world.joints, world.actuators))
    sensors = {*PLACES, *DIRECTIONS, *(f"{what} {joint}" for what in JOINTS for joint in joints)}
    named = (
        ("sensor", [each.name for each in pool.sensors], sorted(sensors)),
        ("joint", pool.joints, joints),
        ("actuator", pool.actuators, actuators),
    )
    for what, names, there in named:
        for name in names:
            if name not in there:
                message = f"the pool {pool.name} has the {what} {name!r}, which the {robot} lacks"
                yield Violation(pointer, name, message, there)
    for each in pool.recordings if world.fixed else ():
        if any(getattr(each.start, name) is not None for name in OF_BASE):
            message = f"recording {each.name} of the pool {pool.name} starts the base of the {robot}, which never moves"
            yield Violation(pointer, each.name, message, f"starts without {', '.join(OF_BASE)}")
            return


def said(names: Sequence[str], seen: Trajectory, world: World) -> FloatArray:
    """Return `(..., t, s)`: what sensors of these names say of a trajectory; nan of joints that it does not have."""
    places = {joint.name: place for place, joint in enumerate(world.joints)}

    def one(name: str) -> FloatArray:
        if name in PLACES:
            return seen.positions_m[..., PLACES.index(name)]
        if name in DIRECTIONS:
            axis, along = divmod(DIRECTIONS.index(name), 3)
            return rotated(seen.orientations, np.eye(3)[axis])[..., along]
        what, _, joint = name.partition(" ")
        values: FloatArray | None = getattr(seen, JOINTS[what][0])
        return np.full(seen.positions_m.shape[:-1], np.nan) if values is None else values[..., places[joint]]

    return np.stack([one(name) for name in names], axis=-1)
