"""What acts in the joints: PhysX's drive in each, and torques that are set before each step.

A joint of PhysX has one drive: a spring with a damper, solved implicitly, whose force can be limited. It is a World's
servo, or a PD motor with the damping of its joint. Dry friction, and damping beside a servo, are torques: those of the
end of the step, if the joint moved alone under the load of the step before.
"""

from typing import NamedTuple

from gaplab.services.engines.physx.robot import UNLIMITED, Handle
from gaplab.services.world.world import Joint, Motor, PDMotor

RIGIDITY = 1e4
"""Weight of a servo's target speed relative to the current speed of the joint: see `_servo`."""

LARGEST_GAIN = 0.999
"""Largest gain of a servo: one that closes the whole error in a step would be infinitely stiff."""

STRONGEST = 1e30
"""Limit of a drive without a limit, in single precision."""


class Spring(NamedTuple):
    """A torque kp (u - q) - kd v + feed u, limited to ± strongest, with angle and speed at the end of a step."""

    kp: float = 0.0
    kd: float = 0.0
    feed: float = 0.0
    strongest: float = STRONGEST

    def torque(self, target: float, angle: float, speed: float) -> float:
        """Return the torque at the angle and the speed at the end of a step."""
        return within(self.kp * (target - angle) - self.kd * speed + self.feed * target, self.strongest)


def within(value: float, limit: float) -> float:
    """Return a value limited to ± `limit`; nan for nan."""
    return -limit if value < -limit else limit if value > limit else value


def spring_of(motor: Motor | PDMotor | None) -> Spring:
    """Return the law of a motor; without torque for a servo, which is a drive of its own kind in PhysX."""
    if not isinstance(motor, PDMotor):
        return Spring()
    limit = min(motor.max_torque_nm, STRONGEST)
    laws = {
        "position": Spring(motor.kp, motor.kd, 0.0, limit),
        "velocity": Spring(0.0, motor.kd, motor.kd, limit),
        "torque": Spring(0.0, 0.0, 1.0, limit),
    }
    return laws[motor.follows]


def resists(joint: Joint) -> bool:
    """Return whether a joint needs torques in each step: for dry friction, or damping beside a motor."""
    follows = isinstance(joint.motor, Motor) or (isinstance(joint.motor, PDMotor) and joint.motor.follows != "torque")
    return joint.dry_friction > 0 or (follows and joint.damping > 0)


class JointDrive:
    """What acts in one joint, in one rollout.

    Args:
        handle: PhysX's joint.
        joint: the World's joint.
        inverse_inertia: acceleration by torque: see `inverse_inertias`.
        step_s: time step.

    Attributes:
        steps: true if its torque must be set before each step.
        force: torque beside the drive.
    """

    def __init__(self, handle: Handle, joint: Joint, inverse_inertia: float, step_s: float) -> None:
        self._handle, self._step_s, self._kick = handle, step_s, step_s * inverse_inertia
        self._damping, self._friction = joint.damping, joint.dry_friction
        self._spring = spring_of(joint.motor)
        self._servo = isinstance(joint.motor, Motor)
        self._driven = isinstance(joint.motor, PDMotor) and joint.motor.follows != "torque"
        self.steps = resists(joint)
        self.force = self._target = self._brake = 0.0
        self._speed: float | None = None
        self._weak = False
        handle.armature = [[joint.armature]]
        handle.max_velocity = joint.motor.max_speed_rad_s if isinstance(joint.motor, Motor) else UNLIMITED
        handle.set_drive_target(0.0)
        handle.set_drive_velocity_target(0.0)
        if isinstance(joint.motor, Motor):
            _servo(handle, joint.motor, step_s)
        else:
            self._drive(weak=False)

    def command(self, target: float) -> None:
        """Set a new target of the motor."""
        self._target = target
        if self._servo or self._spring.kp:
            self._handle.set_drive_target(target)
        elif self._driven:
            self._drive(weak=self._weak)
        else:
            self.force = within(self._spring.feed * target, self._spring.strongest) + self._brake

    def motor_nm(self, angle: float, speed: float) -> float:
        """Return the torque of a PD motor in the step that ended at an angle and a speed; 0 for any other."""
        return self._spring.torque(self._target, angle, speed)

    def update(self, angle: float, speed: float) -> None:
        """Set drive and torque for the next step, which begins at an angle and a speed."""
        coasting = speed
        if self._speed is not None:
            own = self.motor_nm(angle, speed) - self._damping * speed + self._brake
            coasting += speed - self._speed - self._kick * own
        self._speed = speed
        free = self._ending(coasting, angle, self._spring)
        weak = self._driven and abs(self._asked(angle, free[0])) > self._spring.strongest
        sign = 1.0 if self._asked(angle, free[0]) > 0 else -1.0
        ending, share = free
        motor = 0.0
        if weak:
            motor = sign * self._spring.strongest
            ending, share = self._ending(coasting + self._kick * motor, angle, Spring())
        elif not self._driven:
            motor = within(self._spring.feed * self._target, self._spring.strongest)
            ending = share * (coasting + self._kick * motor)
        self._brake = within(-ending / (share * self._kick), self._friction)
        self.force = motor + self._brake
        if self._servo:
            self.force -= self._damping * (ending + share * self._kick * self._brake)
        elif weak != self._weak:
            self._drive(weak=weak)

    def _ending(self, coasting: float, angle: float, spring: Spring) -> tuple[float, float]:
        """Return the speed at the end of a step without friction, and what a kick of speed then adds to it."""
        step_s, kick = self._step_s, self._kick
        share = 1.0 / (1.0 + kick * (spring.kd + self._damping + step_s * spring.kp))
        pushed = (spring.kp * (self._target - angle) + spring.feed * self._target) if self._driven else 0.0
        return share * (coasting + kick * pushed), share

    def _asked(self, angle: float, ending: float) -> float:
        """Return the torque without its limit, at the end of a step."""
        return self._spring._replace(strongest=STRONGEST).torque(self._target, angle + self._step_s * ending, ending)

    def _drive(self, *, weak: bool) -> None:
        """Let PhysX's drive be the motor with the joint's damping, or the damping alone if the motor is too weak.

        Without damping, the drive has the limit of the motor itself.
        """
        self._weak = weak
        driven = self._driven and not weak
        kp, kd, feed = self._spring[:3] if driven else (0.0, 0.0, 0.0)
        resisting = kd + self._damping
        limit = self._spring.strongest if driven and not self._damping else STRONGEST
        self._handle.set_drive_velocity_target(feed * self._target / resisting if feed else 0.0)
        self._handle.set_drive_properties(kp, resisting, limit, "force")


def _servo(handle: Handle, motor: Motor, time_step_s: float) -> None:
    """Configure a World's servo as a PhysX drive, a spring k with a damper d.

    A drive in acceleration mode is solved implicitly and independently of inertia: from speed v and error e, a step h
    leads to v' = (v + h k e) / (1 + h d + h² k). With d = R/h and k = g (1 + R) / (1 - g) / h² that is
    v' = g e/h + v (1 - g) / (1 + R): for a large R, this is World's velocity constraint, which closes the share g of
    the error in each step. The largest force of the drive is the motor's torque. The largest speed applies to the
    joint, whatever turns it.
    """
    gain = min(motor.position_gain, LARGEST_GAIN)
    stiffness = gain * (1 + RIGIDITY) / (1 - gain) / time_step_s**2
    handle.set_drive_properties(stiffness, RIGIDITY / time_step_s, motor.max_torque_nm, "acceleration")
