"""The safety forecast: extremes of recorded rollouts, and whether they exceed the limits of a physical robot."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import nan, pi
from operator import attrgetter

import numpy as np

from gaplab.schemas.measurements import LimitsSpec, Safety
from gaplab.services.core.arrays import FloatArray, frozen
from gaplab.services.world.kinematics import clearances_m, from_start
from gaplab.services.world.motions import Loop, Motion, Recording
from gaplab.services.world.world import World

MOST_SIMULATORS = 20
"""Largest number of tuned simulators that a forecast asks, the best first."""

FALL_RAD = pi / 2
"""Tilt beyond which a robot has fallen."""

STOP_RAD = 0.01
"""How far beyond its range a joint may be: stops of simulators give way a little."""


@dataclass(frozen=True)
class Extremes:
    """The worst of one rollout; nan where the engine does not tell it, and everywhere if the physics failed.

    Attributes:
        joint_speed: greatest speed of a joint, rad/s.
        torque: greatest torque of a joint, N·m.
        tilt: greatest tilt of the base from upright, as which it starts, rad.
        height: least height of the base's frame, m.
        clearance: least height of the lowest point of the base's body, m.
        fitness: fitness of the rollout.
        out_of_range: sentences about joints that are commanded to, or reach, an angle beyond their range.
    """

    joint_speed: float = nan
    torque: float = nan
    tilt: float = nan
    height: float = nan
    clearance: float = nan
    fitness: float = nan
    out_of_range: tuple[str, ...] = ()


@dataclass(frozen=True)
class Limit:
    """How a limit of a spec is checked.

    Attributes:
        name: name of the limit, and of its extreme.
        words: what it limits.
        unit: its unit.
        least: true if values below the limit exceed it.
    """

    name: str
    words: str
    unit: str
    least: bool = False

    def exceeds(self, value: float, limit: float) -> bool:
        """Return whether a value exceeds the limit; nan does not."""
        return value < limit if self.least else value > limit


LIMITS = (
    Limit("joint_speed", "the speed of a joint", "rad/s"),
    Limit("torque", "the torque of a joint", "N·m"),
    Limit("tilt", "the tilt of the base", "rad"),
    Limit("height", "the height of the base", "m", least=True),
)


def recording_times(motion: Motion | Loop, world: World) -> FloatArray:
    """Return the times `(k,)` of all time steps of a motion: between them, nothing moves."""
    steps = int(motion.observe_s[-1] / world.time_step_s + 1e-6)
    return frozen(np.arange(steps + 1) * world.time_step_s)


def extremes(world: World, motion: Motion | Loop, recording: Recording, fitness: float) -> Extremes:
    """Return the extremes of a rollout in a world, whose first body is the base, recorded at every time step."""
    poses = recording.poses
    if not (np.isfinite(fitness) and np.all(np.isfinite(poses))):
        return Extremes()
    x, y = from_start(world, poses[:, 3:])[:, :2].T
    tilts = np.arccos(np.clip(1.0 - 2.0 * (x**2 + y**2), -1.0, 1.0))
    return Extremes(
        joint_speed=_joint_speed(recording),
        torque=_largest(recording.torques_nm),
        tilt=float(tilts.max()),
        height=float(poses[:, 2].min()),
        clearance=float(clearances_m(world.bodies[0], poses[:, :3], poses[:, 3:]).min()) - world.ground_m,
        fitness=fitness,
        out_of_range=tuple(_out_of_range(world, motion, recording)),
    )


def safety(rollouts: Sequence[Extremes], limits: LimitsSpec | None, engine: str) -> Safety:
    """Return the worst of the rollouts of a controller in all simulators; sentences have the name of the engine."""
    ran = [rollout for rollout in rollouts if np.isfinite(rollout.fitness)]
    falls = sum(rollout.tilt > FALL_RAD for rollout in ran)
    worst = {limit.name: _worst(ran, limit.name, min if limit.least else max) for limit in LIMITS}
    return Safety(
        simulators=len(rollouts),
        failed=len(rollouts) - len(ran),
        **worst,
        clearance=_worst(ran, "clearance", min),
        falls=falls,
        fitness_low=_worst(ran, "fitness", min),
        fitness_high=_worst(ran, "fitness", max),
        beyond=tuple(_beyond(ran, falls, limits)),
        unknown=tuple(_unknown(len(rollouts) - len(ran), len(rollouts), worst, limits, engine)),
    )


def expected(found: Safety, unit: str) -> Iterator[str]:
    """Yield the predictions of a forecast for a controller, a line each; `unit` is that of its fitness."""
    ends = [f"{end:.3g}" for end in (found.fitness_low, found.fitness_high) if end is not None]
    if ends:
        yield f"simulators expect {' to '.join(dict.fromkeys(ends))} {unit}".rstrip()
    for what, count in (("the physics fails", found.failed), ("it falls", found.falls)):
        if count:
            yield f"{what} in {count} of {found.simulators} simulators"
    for limit in (*LIMITS, Limit("clearance", "the clearance of the base", "m", least=True)):
        if (value := getattr(found, limit.name)) is not None:
            yield f"{limit.words}: at {'least' if limit.least else 'most'} {value:.3g} {limit.unit}"


def _beyond(ran: Sequence[Extremes], falls: int, limits: LimitsSpec | None) -> list[str]:
    found = [f"it falls in {falls} of {len(ran)} simulators"] if falls and getattr(limits, "tilt", None) is None else []
    found += dict.fromkeys(sentence for rollout in ran for sentence in rollout.out_of_range)
    for limit in LIMITS:
        permitted = getattr(limits, limit.name, None)
        if permitted is None:
            continue
        beyond = [value for value in map(attrgetter(limit.name), ran) if limit.exceeds(value, permitted)]
        if beyond:
            worst, side = (min(beyond), "at least") if limit.least else (max(beyond), "at most")
            found.append(
                f"{limit.words} reaches {worst:.3g} {limit.unit} in {len(beyond)} of {len(ran)} simulators; permitted: "
                f"{side} {permitted:g} {limit.unit}"
            )
    return found


def _unknown(
    failed: int, asked: int, worst: dict[str, float | None], limits: LimitsSpec | None, engine: str
) -> list[str]:
    """Return a sentence for whatever the rollouts do not tell."""
    found = [f"the physics failed in {failed} of {asked} simulators"] if failed else []
    for limit in LIMITS if failed < asked else ():
        if worst[limit.name] is None:
            permitted = getattr(limits, limit.name, None)
            unchecked = "" if permitted is None else f", so its limit of {permitted:g} {limit.unit} is not checked"
            found.append(f"the engine {engine} does not tell {limit.words}{unchecked}")
    return found


def _worst(ran: Sequence[Extremes], name: str, worse: Callable[..., float]) -> float | None:
    values = [value for value in map(attrgetter(name), ran) if np.isfinite(value)]
    return worse(values) if values else None


def _out_of_range(world: World, motion: Motion | Loop, recording: Recording) -> Iterator[str]:
    """Yield a sentence for each joint whose targets, or whose angles, are beyond its range."""
    for place, joint in enumerate(world.joints):
        if joint.limits is None:
            continue
        seen = [] if recording.angles_rad is None else [recording.angles_rad[:, place]]
        if isinstance(motion, Motion) and joint.motor is not None and joint.follows == "position":
            seen.append(motion.targets[:, world.actuators.index(joint)])
        (lower, upper), angles = joint.limits, np.concatenate([*seen, [joint.start]])
        farthest = float(angles[np.argmax(np.maximum(lower - angles, angles - upper))])
        if not lower - STOP_RAD <= farthest <= upper + STOP_RAD:
            unit = "m" if joint.slides else "rad"
            yield f"{joint.name} is to go to {farthest:.3g} {unit}; its range is {lower:.3g} to {upper:.3g} {unit}"


def _joint_speed(recording: Recording) -> float:
    """Return the greatest speed of a joint between two observations; nan if the engine does not tell angles."""
    if recording.angles_rad is None or len(recording.times_s) < 2:
        return nan
    turned = np.abs(np.diff(recording.angles_rad, axis=0))
    return _largest(turned / np.diff(recording.times_s)[:, None])


def _largest(values: FloatArray | None) -> float:
    """Return the largest absolute value; nan without values."""
    return nan if values is None or not values.size else float(np.abs(values).max())
