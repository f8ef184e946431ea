"""Damping of joints."""

from gaplab.services.core.tunables.groups import JointTunable, Limits, ValueOptions


class JointDamping(JointTunable):
    """Torque in a joint against its speed, divided by the speed; `joint_damping(*_knee)` is that of all knees."""

    name = "joint_damping"
    field = "joint.damping"
    value_unit = "N m s/rad"
    Options = ValueOptions
    value = Limits(0.0, 0.5, 0.0, 1e4)
