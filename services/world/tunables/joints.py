"""Tunables of joints and their motors."""

from gaplab.services.world.tunables.base import JointTunable, Limits, MotorTunable, ScaleOptions, ValueOptions


class JointDamping(JointTunable):
    """Torque in a joint against its speed, divided by the speed; `joint_damping(*_knee)` is that of all knees."""

    name = "joint_damping"
    field = "joint.damping"
    value_unit = "N m s/rad"
    Options = ValueOptions
    value = Limits(0.0, 0.5, 0.0, 1e4)


class JointFriction(JointTunable):
    """Torque that a joint withstands at rest, and that brakes it in motion."""

    name = "joint_friction"
    field = "joint.dry_friction"
    value_unit = "N m"
    Options = ValueOptions
    value = Limits(0.0, 0.5, 0.0, 1e4)


class JointStaticFriction(JointTunable):
    """Torque that a joint withstands at rest, beyond its dry friction: it sticks, and then gives way at once."""

    name = "joint_static_friction"
    source = "Stribeck 1902; the bounds are gaplab's"
    field = "joint.static_friction"
    value_unit = "N m"
    Options = ValueOptions
    value = Limits(0.0, 0.5, 0.0, 1e4)


class JointStribeckSpeed(JointTunable):
    """Speed of a joint at which a share of 1/e of its static friction is left."""

    name = "joint_stribeck_speed"
    source = "Stribeck 1902; the bounds are gaplab's"
    field = "joint.stribeck_speed"
    value_unit = "rad/s"
    Options = ValueOptions
    value = Limits(0.01, 1.0, 1e-4, 1e3)


class Armature(JointTunable):
    """Inertia of a motor's rotor and gears, as seen from the joint."""

    name = "armature"
    field = "joint.armature"
    value_unit = "kg m²"
    Options = ValueOptions
    value = Limits(0.0, 0.05, 0.0, 1e3)


class MotorGain(MotorTunable):
    """Share of the error of an angle that a position servo closes in each time step, like those of the quadruped."""

    name = "motor_gain"
    field = "motor.position_gain"
    value_unit = "1"
    Options = ScaleOptions
    scale = Limits(0.3, 3.0, 0.0, 100.0)
    value = Limits(0.02, 0.2, 0.0, 1.0)


class Kp(MotorTunable):
    """Torque of a motor by the error of its angle, of motors with such a gain."""

    name = "kp"
    field = "motor.kp"
    follows = ("position",)
    value_unit = "N m/rad"
    Options = ScaleOptions
    value = Limits(1.0, 100.0, 0.0, 1e6)
    from_the_mean = True


class Kd(MotorTunable):
    """Torque of a motor by the error of its speed, of motors with such a gain."""

    name = "kd"
    field = "motor.kd"
    follows = ("position", "velocity")
    value_unit = "N m s/rad"
    Options = ScaleOptions
    value = Limits(0.1, 10.0, 0.0, 1e5)
    from_the_mean = True


class MaxTorque(MotorTunable):
    """Largest torque of a motor; it falls as batteries age."""

    name = "max_torque"
    field = "motor.max_torque_nm"
    value_unit = "N m"
    Options = ScaleOptions
    scale = Limits(0.1, 1.5, 0.0, 100.0)
    value = Limits(0.5, 8.0, 0.0, 1e5)
    from_the_mean = True


class Delay(MotorTunable):
    """Time from a command until a motor follows it, rounded to whole time steps of the simulator."""

    name = "delay"
    field = "motor.delay_s"
    value_unit = "s"
    Options = ValueOptions
    value = Limits(0.0, 0.05, 0.0, 10.0)
