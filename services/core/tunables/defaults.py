"""Which tunables an imported robot gets by default."""

import re
from collections import Counter

from gaplab.services.core.tunables.base import LONGEST_PATTERN
from gaplab.services.core.world import Motor, World

_SPECIAL = re.compile(r"[()\[\]*?,=]")
"""Characters that mean something in a label or in a pattern."""


def usual_tunables(world: World) -> tuple[str, ...]:
    """Return the labels of three or four tunables that usually explain a reality gap of a robot.

    A robot that moves about has the friction of what most of its limbs end in, and the mass of its base, which stands
    for the payload. One on a fixed base has the mass of its tool, the observed body, and the dry friction of its
    joints. Both have:

    - the response of their motors: the gain of most of them, the damping of those that follow speeds, the largest
      torque of those that follow torques,
    - the damping of their joints, which no data sheet has.
    """
    if not world.bodies or (world.fixed and not world.joints):
        return ()
    damping = ("joint_damping",) if world.joints else ()
    if not world.fixed:
        return (_friction(world), _mass(world.bodies[0].name), *_response(world), *damping)
    tool = world.observed if world.observed not in {"", world.bodies[0].name} else world.bodies[-1].name
    return (_mass(tool), *_response(world), *damping, "joint_friction")


def _friction(world: World) -> str:
    """Return the label of the friction of most bodies that touch the ground and carry no other: feet, or wheels."""
    parents = {joint.parent for joint in world.joints}
    ends = [each for each in world.bodies if each.name not in parents and each.touches]
    surfaces = Counter(each.surface for each in ends).most_common(1)
    own = surfaces and surfaces[0][0] in dict(world.surfaces)
    return f"dynamic_friction({_pattern(surfaces[0][0])})" if own else "dynamic_friction"


def _response(world: World) -> tuple[str, ...]:
    """Return the label of the number that decides how most motors respond."""
    motors = [joint.motor for joint in world.actuators]
    if not motors:
        return ()
    kinds = ["gain" if motor is None or isinstance(motor, Motor) else motor.follows for motor in motors]
    labels = {"gain": "motor_gain", "position": "kp", "velocity": "kd", "torque": "max_torque"}
    return (labels[max(labels, key=kinds.count)],)


def _mass(body: str) -> str:
    return f"mass({_pattern(body)})"


def _pattern(name: str) -> str:
    """Return a name with ? for what a label cannot contain, and * for what is too long."""
    pattern = _SPECIAL.sub("?", name)
    return pattern if len(pattern) <= LONGEST_PATTERN else pattern[: LONGEST_PATTERN - 1] + "*"
