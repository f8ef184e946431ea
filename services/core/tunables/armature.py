"""Inertia of what turns with joints."""

from gaplab.services.core.tunables.groups import JointTunable, Limits, ValueOptions


class Armature(JointTunable):
    """Inertia of a motor's rotor and gears, as seen from the joint."""

    name = "armature"
    field = "joint.armature"
    value_unit = "kg m²"
    Options = ValueOptions
    value = Limits(0.0, 0.05, 0.0, 1e3)
