"""Which fields of a World it uses, beyond those of any world: what an engine must honour to simulate it truly."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

from gaplab.services.core.kinematics import observes_base
from gaplab.services.core.shapes import ORIGIN, UNTURNED, Capsule, Cylinder, Hull, Shape
from gaplab.services.core.world import Body, Joint, PDMotor, World

Uses: TypeAlias = Callable[[World], bool]


def _bodies(differs: Callable[[Body], bool]) -> Uses:
    return lambda world: any(differs(body) for body in world.bodies)


def _joints(differs: Callable[[Joint], Any]) -> Uses:
    return lambda world: any(differs(joint) for joint in world.joints)


def _motors(differs: Callable[[PDMotor], Any]) -> Uses:
    return _joints(lambda joint: isinstance(joint.motor, PDMotor) and bool(differs(joint.motor)))


def _shapes(kind: type[Shape]) -> Uses:
    return _bodies(lambda body: any(isinstance(part.shape, kind) for part in body.parts))


USES: Mapping[str, Uses] = MappingProxyType(
    {
        "body.center_m": _bodies(lambda body: isinstance(body.shape, tuple) and body.center_m != ORIGIN),
        "body.inertia": _bodies(lambda body: body.inertia is not None),
        "body.parts": _bodies(lambda body: isinstance(body.shape, tuple)),
        "fixed": lambda world: world.fixed,
        "joint.armature": _joints(lambda joint: joint.armature),
        "joint.damping": _joints(lambda joint: joint.damping),
        "joint.dry_friction": _joints(lambda joint: joint.dry_friction),
        "joint.limits": _joints(lambda joint: joint.limits is not None),
        "joint.slides": _joints(lambda joint: joint.slides),
        "joint.start": _joints(lambda joint: joint.start),
        "joint.turn": _joints(lambda joint: joint.turn != UNTURNED),
        "motor.delay_s": _motors(lambda motor: motor.delay_s),
        "motor.follows": _motors(lambda motor: motor.follows != "position"),
        "motor.kd": _motors(lambda motor: motor.kd),
        "motor.kp": _motors(lambda motor: motor.kp),
        "noise.start_tilt_rad": lambda world: bool(world.noise.start_tilt_rad),
        "observed": lambda world: bool(world.bodies) and not observes_base(world),
        "shape.capsule": _shapes(Capsule),
        "shape.cylinder": _shapes(Cylinder),
        "shape.hull": _shapes(Hull),
        "slope_rad": lambda world: bool(world.slope_rad),
        "start_turn": lambda world: world.start_turn != UNTURNED,
        "surfaces": _bodies(lambda body: bool(body.surface)),
    }
)
"""Whether a world uses a field, by its name in the `honours` of engines."""
