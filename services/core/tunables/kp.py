"""Stiffness of motors."""

from gaplab.services.core.tunables.groups import Limits, MotorTunable, ScaleOptions


class Kp(MotorTunable):
    """Torque of a motor by the error of its angle, of motors with such a gain."""

    name = "kp"
    field = "motor.kp"
    follows = ("position",)
    value_unit = "N m/rad"
    Options = ScaleOptions
    value = Limits(1.0, 100.0, 0.0, 1e6)
    from_the_mean = True
