"""Damping of motors."""

from gaplab.services.core.tunables.groups import Limits, MotorTunable, ScaleOptions


class Kd(MotorTunable):
    """Torque of a motor by the error of its speed, of motors with such a gain."""

    name = "kd"
    field = "motor.kd"
    follows = ("position", "velocity")
    value_unit = "N m s/rad"
    Options = ScaleOptions
    value = Limits(0.1, 10.0, 0.0, 1e5)
    from_the_mean = True
