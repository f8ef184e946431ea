"""Torques that Bullet has no motor for: PD motors, damping, and dry friction beside a servo."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from gaplab.services.core.inertias import inverse_inertias
from gaplab.services.core.motor_law import PDLaw, pd_law, pd_torque
from gaplab.services.core.world import Joint, Motor, PDMotor, World

States: TypeAlias = tuple[tuple[float, ...], ...]
"""Bullet's numbers about joints: angle, speed, and more."""

STIFFEST = 1.5
"""Largest share (kd + h kp) h w of a joint's inertia that its motor may have in an inner step of length h: beyond it,
motors of joints that move each other swing up."""

MOST_INNER_STEPS = 16
"""Largest number of Bullet's steps in one of the world's."""


class _Resisted(NamedTuple):
    """A joint's law, and what resists it; with damping, a joint that coasts at c ends the step at c · share.

    Attributes:
        law: law of its motor.
        kick: speed by torque at the end of a step, without damping.
        damping: torque by speed.
        share: 1 / (1 + kick · damping).
        friction_nm: largest torque of its dry friction, if no motor of Bullet's is free for it.
    """

    law: PDLaw
    kick: float
    damping: float
    share: float
    friction_nm: float


class Torques:
    """The torques of some joints, computed before each step.

    They are those of the end of the step, if the joint moved alone under the load of the step before. The load is what
    else accelerates the joint: the change of its speed in that step, less what these torques did.

    Args:
        world: world.

    Attributes:
        joints: numbers of the joints.
        inner_steps: number of steps of Bullet's in a time step of the world: more than one where motors are too strong.
    """

    def __init__(self, world: World) -> None:
        self.joints = tuple(number for number, joint in enumerate(world.joints) if needs_torque(joint))
        self._places = {joint: place for place, joint in enumerate(self.joints)}
        inverse = inverse_inertias(_without_armature(world)).tolist() if self.joints else []
        pairs = [(world.joints[number], inverse[number]) for number in self.joints]
        self.inner_steps = _inner_steps(pairs, world.time_step_s)
        step_s = world.time_step_s / self.inner_steps
        self._resisted = [_resisted(joint, response, step_s) for joint, response in pairs]
        self.reset()

    def reset(self) -> None:
        """Forget targets, speeds and torques, for another rollout."""
        count = len(self.joints)
        self._targets, self._motors_nm = [0.0] * count, [0.0] * count
        self._expected: list[float | None] = [None] * count

    def command(self, joint: int, target: float) -> None:
        """Set a new target for the motor of a joint."""
        self._targets[self._places[joint]] = target

    def motor_nm(self, joint: int) -> float:
        """Return the torque of a joint's motor in the last step; 0 without one."""
        return self._motors_nm[self._places[joint]] if joint in self._places else 0.0

    def of(self, states: States) -> list[float]:
        """Return the torques of the joints in a step, and remember those of their motors.

        Args:
            states: of the joints at the start of the step.
        """
        total = []
        for place, (target, state, resisted) in enumerate(zip(self._targets, states, self._resisted, strict=True)):
            angle, speed = state[0], state[1]
            law, kick, damping, share, friction = resisted
            expected = self._expected[place]
            coasting = share * (speed if expected is None else speed + (speed - expected))
            torque = self._motors_nm[place] = pd_torque(target, angle, coasting, law)
            ending = coasting + share * kick * torque
            torque -= damping * ending
            if friction:
                torque -= min(max(ending / (share * kick), -friction), friction)
            self._expected[place] = speed + kick * torque
            total.append(torque)
        return total


def needs_torque(joint: Joint) -> bool:
    """Return whether Bullet lacks a motor for what acts in a joint."""
    beside_servo = isinstance(joint.motor, Motor) and joint.dry_friction > 0
    return isinstance(joint.motor, PDMotor) or joint.damping > 0 or beside_servo


def _inner_steps(pairs: Sequence[tuple[Joint, float]], step_s: float) -> int:
    """Return the number of inner steps, given joints and their inverse inertias."""
    for count in range(1, MOST_INNER_STEPS):
        if all(_strength(joint, step_s / count) * inverse <= STIFFEST for joint, inverse in pairs):
            return count
    return MOST_INNER_STEPS if pairs else 1


def _strength(joint: Joint, step_s: float) -> float:
    """Return the inertia that a joint's motor and damping have in a step, kg m²."""
    damping, stiffness = joint.damping, 0.0
    if isinstance(joint.motor, PDMotor) and joint.motor.follows != "torque":
        damping += joint.motor.kd
        stiffness = joint.motor.kp if joint.motor.follows == "position" else 0.0
    return step_s * (damping + step_s * stiffness)


def _resisted(joint: Joint, inverse: float, step_s: float) -> _Resisted:
    share = 1.0 / (1.0 + step_s * joint.damping * inverse)
    law = pd_law(joint.motor, share * inverse, step_s) if isinstance(joint.motor, PDMotor) else PDLaw()
    friction = joint.dry_friction if isinstance(joint.motor, Motor) else 0.0
    return _Resisted(law, step_s * inverse, joint.damping, share, friction)


def _without_armature(world: World) -> World:
    if not any(joint.armature for joint in world.joints):
        return world
    return replace(world, joints=tuple(replace(joint, armature=0.0) for joint in world.joints))
