"""Strength of motors."""

from gaplab.services.core.tunables.groups import Limits, MotorTunable, ScaleOptions


class MaxTorque(MotorTunable):
    """Largest torque of a motor; it falls as batteries age."""

    name = "max_torque"
    field = "motor.max_torque_nm"
    value_unit = "N m"
    Options = ScaleOptions
    scale = Limits(0.1, 1.5, 0.0, 100.0)
    value = Limits(0.5, 8.0, 0.0, 1e5)
    from_the_mean = True
