"""Gain of position servos."""

from gaplab.services.core.tunables.groups import Limits, MotorTunable, ScaleOptions


class MotorGain(MotorTunable):
    """Share of the error of an angle that a position servo closes in each time step, like those of the quadruped."""

    name = "motor_gain"
    field = "motor.position_gain"
    value_unit = "1"
    Options = ScaleOptions
    scale = Limits(0.3, 3.0, 0.0, 100.0)
    value = Limits(0.02, 0.2, 0.0, 1.0)
