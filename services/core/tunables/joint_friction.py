"""Dry friction of joints."""

from gaplab.services.core.tunables.groups import JointTunable, Limits, ValueOptions


class JointFriction(JointTunable):
    """Torque that a joint withstands at rest, and that brakes it in motion."""

    name = "joint_friction"
    field = "joint.dry_friction"
    value_unit = "N m"
    Options = ValueOptions
    value = Limits(0.0, 0.5, 0.0, 1e4)
