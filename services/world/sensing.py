"""What robots sense: readings, which tune simulators, and what a controller in a loop observes, with its noise.

Noise, of observations and of commands, is drawn by address: the same genome has the same draws in every simulator.
Draws are standard normal numbers that the noise of each world scales: common random numbers, so that simulators differ
by their parameters alone. An evaluation is a function of genome and parameters, as without noise.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from hashlib import sha256
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Genome, frozen, no_readings
from gaplab.services.core.streams import stream
from gaplab.services.world.kinematics import TOUCHING_M, Clearances, inverse, rotated, turn_by
from gaplab.services.world.motions import LEVEL, Loop, Motion, Tilt
from gaplab.services.world.world import Body, Noise, World


@dataclass(frozen=True, eq=False)
class Sensors:
    """The sensors of a robot, and the times at which all of them are read.

    Attributes:
        names: name of each of the s sensors.
        units: unit of each.
        noises: `(s,)`: standard deviation of each sensor's noise, in its unit.
        times_s: `(r,)`, ascending: seconds from the start of a rollout.
        periods: `(s,)`: by how much a reading may differ and mean the same, in its unit, like 2π of an angle; 0 if by
            nothing. Left out: 0 for all.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    noises: FloatArray = field(default_factory=no_readings)
    times_s: FloatArray = field(default_factory=no_readings)
    periods: FloatArray = field(default_factory=no_readings)

    @property
    def size(self) -> int:
        """Return the number of readings of a rollout, q = r · s: all sensors at the first time, then at the next."""
        return len(self.names) * len(self.times_s)

    @property
    def reading_times_s(self) -> FloatArray:
        """Return the time of each reading, `(q,)`."""
        return np.repeat(self.times_s, len(self.names))

    @property
    def reading_periods(self) -> FloatArray:
        """Return the period of each reading, `(q,)`, over its noise."""
        each = self.periods / self.noises if self.periods.size else np.zeros(len(self.names))
        return np.tile(each, len(self.times_s))

    @property
    def times(self) -> tuple[str, ...]:
        """Return the times as texts, so exact that a reading is found by one of them."""
        return tuple(f"{time:.12g}" for time in self.times_s)

    @property
    def columns(self) -> tuple[str, ...]:
        """Return the name of each reading in tables, `(q,)`, like `roll@0.75`."""
        return tuple(f"{name}@{time}" for time in self.times for name in self.names)

    def details(self) -> dict[str, Any]:
        """Return name, unit and noise of each sensor, and the times of reading, for the catalogue."""
        named = zip(self.names, self.units, self.noises.tolist(), strict=True)
        sensors: list[dict[str, Any]] = [{"name": name, "unit": unit, "noise": noise} for name, unit, noise in named]
        for sensor, period in zip(sensors, self.periods.tolist(), strict=False):
            sensor |= {"period": period} if period else {}
        return {"sensors": sensors, "reading_times_s": self.times_s.tolist()}

    def standardised(self, values: FloatArray) -> FloatArray:
        """Return readings `(..., q)`, each divided by its noise, from values `(..., r, s)` in the sensors' units."""
        return (values / self.noises).reshape(*values.shape[:-2], self.size)

    def values(self, readings: FloatArray) -> FloatArray:
        """Return values `(..., r, s)` in the sensors' units, from readings `(..., q)`."""
        return readings.reshape(*readings.shape[:-1], len(self.times_s), len(self.names)) * self.noises


AXES = ("x", "y", "z")

JOINTS = MappingProxyType(
    {
        "angle": ("angles_rad", ("rad", "m")),
        "speed": ("speeds_rad_s", ("rad/s", "m/s")),
        "torque": ("torques_nm", ("N·m", "N")),
    }
)
"""Sensors of a joint, by the first word of their names: what of a trajectory each tells; units of hinge and slide."""

WORLDS_KEPT = 64


@dataclass(frozen=True, eq=False)
class Bearing:
    """What an engine provides about n robots in one world at one time.

    Attributes:
        poses: `(n, 7)`: positions and quaternions x, y, z, w of the base's frame.
        turning_rad_s: `(n, 3)`: angular velocities of the base, in its own frame.
        angles_rad: `(n, joints)`, in the world's order; m for a joint that slides.
        speeds_rad_s: `(n, joints)`, likewise.
    """

    poses: FloatArray
    turning_rad_s: FloatArray
    angles_rad: FloatArray
    speeds_rad_s: FloatArray


def observations(world: World, senses: Sequence[str], bearing: Bearing) -> FloatArray:
    """Return `(n, s)`: the groups that a controller observes, in its order, with biases, but without noise.

    A row depends on the same row of the bearing alone, to the last bit. Senses are names of `GROUPS`.
    """
    groups = [_GROUPS[name].look(world, bearing) for name in senses]
    seen = np.hstack([np.empty((len(bearing.poses), 0)), *groups])
    return seen + biases(world, names(world, senses)) if world.biases else seen


def biases(world: World, sensors: Sequence[str]) -> FloatArray:
    """Return `(s,)`: what is added to the readings of sensors, by their names."""
    known = dict(world.biases)
    return np.array([known.get(name, 0.0) for name in sensors])


def truly_begun(world: World, motion: Motion | Loop) -> Motion | Loop:
    """Return a motion that begins where the joints were: where encoders said that they were, less their biases.

    A motor that holds its joint where that began does so there, too.
    """
    if isinstance(motion, Loop) or not motion.read or motion.start is None or motion.start.angles_rad is None:
        return motion
    shifts = biases(world, [f"angle {joint.name}" if joint.name in motion.read else "" for joint in world.joints])
    said, following = np.array(motion.start.angles_rad), [each.follows == "position" for each in world.actuators]
    held = following & (motion.targets == _actuated(world, said[None])).all(axis=0)
    start = replace(motion.start, angles_rad=tuple((said - shifts).tolist()))
    return replace(motion, start=start, targets=frozen(motion.targets - held * _actuated(world, shifts[None])))


def names(world: World, senses: Sequence[str]) -> tuple[str, ...]:
    """Return the names `(s,)` of the observations, like `angle knee` or `tilt z`."""
    return tuple(name for sense in senses for name in _GROUPS[sense].names(world))


def noises(world: World, senses: Sequence[str], noise: Noise) -> FloatArray:
    """Return `(s,)`: the standard deviation of each observation's noise; contacts have none."""
    counts = [len(_GROUPS[sense].names(world)) for sense in senses]
    return np.repeat([_GROUPS[sense].noise(noise) for sense in senses], counts).astype(float)


def feet(world: World) -> tuple[Body, ...]:
    """Return the bodies that can touch the ground, without the base."""
    return tuple(body for body in world.bodies[1:] if body.touches)


def gravity_m_s2(world: World) -> FloatArray:
    """Return `(3,)`: gravity, which a slope turns in place of the ground, and then its own tilt."""
    if not world.slope_rad and not any(world.gravity_tilt_rad):
        return np.array([0.0, 0.0, -world.gravity_m_s2])
    return world.gravity_m_s2 * _down(world)


def _down(world: World) -> FloatArray:
    """Return `(3,)`: the direction of gravity."""
    down = np.array([-np.sin(world.slope_rad), 0.0, -np.cos(world.slope_rad)])
    return rotated(turn_by(world.gravity_tilt_rad), down) if any(world.gravity_tilt_rad) else down


@dataclass(frozen=True)
class _Group:
    names: Callable[[World], Sequence[str]]
    look: Callable[[World, Bearing], FloatArray]
    noise: Callable[[Noise], float]


def _driven(prefix: str) -> Callable[[World], Sequence[str]]:
    return lambda world: [f"{prefix} {joint.name}" for joint in world.actuators]


def _axes(prefix: str) -> Callable[[World], Sequence[str]]:
    return lambda _: [f"{prefix} {axis}" for axis in AXES]


def _actuated(world: World, values: FloatArray) -> FloatArray:
    return values[:, [place for place, joint in enumerate(world.joints) if joint.motor is not None]]


def _tilt(world: World, bearing: Bearing) -> FloatArray:
    return rotated(inverse(bearing.poses[:, 3:]), _down(world))


def _contacts(world: World, bearing: Bearing) -> FloatArray:
    heights = _clearances(world)(bearing.poses, bearing.angles_rad) - world.ground_m
    return (heights < TOUCHING_M).astype(float)


@lru_cache(maxsize=WORLDS_KEPT)
def _clearances(world: World) -> Clearances:
    return Clearances(world, feet(world))


_GROUPS: Mapping[str, _Group] = MappingProxyType(
    {
        "angles": _Group(_driven("angle"), lambda world, now: _actuated(world, now.angles_rad), lambda n: n.angle_rad),
        "speeds": _Group(
            _driven("speed"), lambda world, now: _actuated(world, now.speeds_rad_s), lambda n: n.speed_rad_s
        ),
        "tilt": _Group(_axes("tilt"), _tilt, lambda noise: noise.tilt),
        "turning": _Group(_axes("turning"), lambda _, now: now.turning_rad_s, lambda noise: noise.turning_rad_s),
        "contacts": _Group(lambda world: [f"contact {foot.name}" for foot in feet(world)], _contacts, lambda _: 0.0),
    }
)

GROUPS: tuple[str, ...] = tuple(_GROUPS)
"""Names of the groups of observations, in their order.

- angles: of the actuated joints, rad; m for a joint that slides.
- speeds: of the actuated joints, rad/s.
- tilt: direction of gravity in the frame of the base, of length 1.
- turning: angular velocity of the base in its own frame, rad/s.
- contacts: 1.0 for each of `feet` whose lowest point is within `TOUCHING_M` of the ground, else 0.0.
"""


def in_order(value: tuple[str, ...], groups: Sequence[str], what: str) -> tuple[str, ...]:
    """Return the groups that an option lists, in their order; ValueError if one is unknown."""
    unknown = [name for name in value if name not in groups]
    if unknown:
        raise ValueError(f"unknown group of {what} {unknown[0]!r}; permitted: {', '.join(groups)}")
    return tuple(name for name in groups if name in value)


QUIET = Noise()
"""No noise, and no latency."""

SEED = 0
"""Seed of all noise: the same for every experiment, so that an evaluation does not depend on the experiment."""


def stream_of(genome: Genome, purpose: str) -> Generator:
    """Return the random generator of a genome `(g,)`, at the address of its digest; purposes are independent."""
    digest = sha256(np.ascontiguousarray(genome, dtype=np.float64).tobytes()).hexdigest()
    return stream(SEED, purpose, digest, 0)  # the 0 is part of the address: without it, all draws would change


def disturbed(world: World, motion: Motion | Loop, genome: Genome) -> Motion | Loop:
    """Return the motion or the loop of a genome `(g,)`, the address of the draws, with noise and latency of a world.

    A target is disturbed when it changes, and stays so until it changes again. A longer rollout has the same noise, and
    more of it.
    """
    if world.noise == QUIET:
        return motion
    commands = stream_of(genome, "noise of targets")
    tilt = _start_tilt(world, genome)
    if isinstance(motion, Motion):
        targets = _disturbed(motion.targets, world.noise.target, commands)
        return replace(motion, targets=targets, start_tilt_rad=tilt)
    scales = noises(world, motion.senses, world.noise)
    seen = stream_of(genome, "noise of observations").standard_normal((motion.ticks, len(scales)))
    sent = commands.standard_normal((motion.ticks, len(world.actuators)))
    return replace(
        motion,
        observation_noise=frozen(scales * seen),
        target_noise=frozen(world.noise.target * sent),
        latency_s=world.noise.latency_s,
        start_tilt_rad=tilt,
    )


def _start_tilt(world: World, genome: Genome) -> Tilt:
    if not world.noise.start_tilt_rad:
        return LEVEL
    x, y = (world.noise.start_tilt_rad * stream_of(genome, "noise of the start").standard_normal(2)).tolist()
    return x, y


def _disturbed(targets: FloatArray, deviation: float, rng: Generator) -> FloatArray:
    """Return targets `(k, a)`, each with the noise of the time at which it was last changed."""
    if not deviation:
        return targets
    changes = np.zeros(targets.shape, dtype=int)
    changes[1:] = np.where(targets[1:] != targets[:-1], np.arange(1, len(targets))[:, None], 0)
    latest = np.maximum.accumulate(changes)
    return frozen(targets + deviation * np.take_along_axis(rng.standard_normal(targets.shape), latest, axis=0))
