"""Torques that Bullet has no motor for: PD motors, damping, and dry friction beside a servo."""

from dataclasses import replace
from typing import NamedTuple, TypeAlias

from gaplab.services.core.inertias import inverse_inertias
from gaplab.services.core.motor_law import DAMPING, PDLaw, pd_law, pd_torque
from gaplab.services.core.world import Joint, Motor, PDMotor, World

States: TypeAlias = tuple[tuple[float, ...], ...]
"""Bullet's numbers about joints: angle, speed, and more."""

FREE = PDLaw(0.0, 0.0, 0.0, 0.0)
"""The law of a joint without a PD motor."""


class _Resisted(NamedTuple):
    """A joint's law, and what resists it.

    Attributes:
        law: law of its motor.
        damping: torque by speed.
        friction_nm: largest torque of its dry friction, if no motor of Bullet's is free for it.
        stopping: torque by speed that stops the joint alone in one step.
    """

    law: PDLaw
    damping: float
    friction_nm: float
    stopping: float


class Torques:
    """The torques of some joints, computed before each step.

    Damping acts at the speed that it leaves at the end of the step, if the joint moved alone, so that it is stable at
    any strength; so does dry friction.

    Args:
        world: world.
    """

    def __init__(self, world: World) -> None:
        self.joints = tuple(number for number, joint in enumerate(world.joints) if needs_torque(joint))
        inverse = inverse_inertias(_without_armature(world)) if self.joints else ()
        step_s = world.time_step_s
        self._resisted = [_resisted(world.joints[number], float(inverse[number]), step_s) for number in self.joints]
        self._targets = [0.0] * len(self.joints)
        self._motors_nm = [0.0] * len(self.joints)

    def command(self, joint: int, target: float) -> None:
        """Set a new target for the motor of a joint."""
        self._targets[self.joints.index(joint)] = target

    def motor_nm(self, joint: int) -> float:
        """Return the torque of a joint's motor in the last step; 0 without one."""
        return self._motors_nm[self.joints.index(joint)] if joint in self.joints else 0.0

    def of(self, states: States) -> list[float]:
        """Return the torques of the joints in a step, and remember those of their motors.

        Args:
            states: of the joints at the start of the step.
        """
        total = []
        for place, (target, state, resisted) in enumerate(zip(self._targets, states, self._resisted, strict=True)):
            angle, speed = state[0], state[1]
            law, damping, friction, stopping = resisted
            self._motors_nm[place] = torque = pd_torque(target, angle, speed, law)
            torque -= damping * speed
            if friction:
                torque -= min(max(stopping * speed, -friction), friction)
            total.append(torque)
        return total


def needs_torque(joint: Joint) -> bool:
    """Return whether Bullet lacks a motor for what acts in a joint."""
    beside_servo = isinstance(joint.motor, Motor) and joint.dry_friction > 0
    return isinstance(joint.motor, PDMotor) or joint.damping > 0 or beside_servo


def _resisted(joint: Joint, inverse: float, step_s: float) -> _Resisted:
    law = pd_law(joint.motor, inverse, step_s) if isinstance(joint.motor, PDMotor) else FREE
    # The law's own damping is already divided by 1 + a; without the division it would be a / (step · inverse).
    own = law[DAMPING] * step_s * inverse
    own = own / (1.0 - own) if own < 1.0 else 0.0
    damping = joint.damping / (1.0 + own + step_s * joint.damping * inverse)
    friction = joint.dry_friction if isinstance(joint.motor, Motor) else 0.0
    return _Resisted(law, damping, friction, 1.0 / (step_s * inverse))


def _without_armature(world: World) -> World:
    if not any(joint.armature for joint in world.joints):
        return world
    return replace(world, joints=tuple(replace(joint, armature=0.0) for joint in world.joints))
