"""What a controller in a loop observes: groups of numbers, put together from what an engine knows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.clearances import Clearances
from gaplab.services.core.kinematics import TOUCHING_M, inverse, rotated
from gaplab.services.core.world import Body, Noise, World

AXES = ("x", "y", "z")
WORLDS_KEPT = 64


@dataclass(frozen=True, eq=False)
class Bearing:
    """What an engine knows of n robots in one world at one time.

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
    """Return `(n, s)`: the groups that a controller observes, in its order, without noise.

    A row depends on the same row of the bearing alone, to the last bit. Senses are names of `GROUPS`.
    """
    groups = [_GROUPS[name].look(world, bearing) for name in senses]
    return np.hstack([np.empty((len(bearing.poses), 0)), *groups])


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
    """Return `(3,)`: gravity, which a slope turns in place of the ground."""
    pull = world.gravity_m_s2
    if not world.slope_rad:
        return np.array([0.0, 0.0, -pull])
    return np.array([-pull * np.sin(world.slope_rad), 0.0, -pull * np.cos(world.slope_rad)])


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
    down = np.array([-np.sin(world.slope_rad), 0.0, -np.cos(world.slope_rad)])
    return rotated(inverse(bearing.poses[:, 3:]), down)


def _contacts(world: World, bearing: Bearing) -> FloatArray:
    return (_clearances(world)(bearing.poses, bearing.angles_rad) < TOUCHING_M).astype(float)


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
