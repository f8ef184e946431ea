"""Delay of motors."""

from gaplab.services.core.tunables.groups import Limits, MotorTunable, ValueOptions


class Delay(MotorTunable):
    """Time from a command until a motor follows it, rounded to whole time steps of the simulator."""

    name = "delay"
    field = "motor.delay_s"
    value_unit = "s"
    Options = ValueOptions
    value = Limits(0.0, 0.05, 0.0, 10.0)
