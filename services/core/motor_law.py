"""The law of a PD motor: four constants for a rollout, and a torque in each step that compiled code can compute too.

A joint whose motor gives the torque t ends a step of length h at the speed c + h w t, where w is its inverse inertia,
and c is its coasting speed, that without its motor. With these, the formulas of PDMotor are solved for t:

- position: (kp (u - q - h c) - kd c) / (1 + h (kd + h kp) w),
- velocity: kd (u - c) / (1 + h kd w).
"""

from collections.abc import Sequence
from typing import NamedTuple

from gaplab.services.core.world import PDMotor

STIFFNESS, DAMPING, FEED, STRONGEST = 0, 1, 2, 3
"""Indices into a PDLaw, for compiled code that has its constants in an array."""


class PDLaw(NamedTuple):
    """The torque of a PDMotor: stiffness (u - q) - damping c + feed u, limited to ± strongest; PDLaw() gives none.

    Attributes:
        stiffness: N·m/rad; N/m for a joint that slides, and likewise below.
        damping: N·m·s/rad.
        feed: torque by target.
        strongest_nm: largest torque.
    """

    stiffness: float = 0.0
    damping: float = 0.0
    feed: float = 0.0
    strongest_nm: float = 0.0


def pd_law(motor: PDMotor, inverse_inertia: float, step_s: float) -> PDLaw:
    """Return the law of a motor of a joint with this inverse inertia, 1/(kg m²): see `inverse_inertias`."""
    kp, kd, strongest = motor.kp, motor.kd, motor.max_torque_nm
    if motor.follows == "torque":
        return PDLaw(0.0, 0.0, 1.0, strongest)
    if motor.follows == "velocity":
        damping = kd / (1.0 + step_s * kd * inverse_inertia)
        return PDLaw(0.0, damping, damping, strongest)
    divisor = 1.0 + step_s * (kd + step_s * kp) * inverse_inertia
    return PDLaw(kp / divisor, (kd + step_s * kp) / divisor, 0.0, strongest)


def pd_torque(target: float, angle: float, coasting: float, law: Sequence[float], at: int = 0) -> float:
    """Return the torque of a motor in a step; nan if any number is nan.

    Args:
        target: its target.
        angle: of its joint at the start of the step.
        coasting: speed of its joint at the end of the step without the motor; the speed at its start, if all else that
            moves the joint is unknown, makes the motor give way by more than load / kp.
        law: constants of a PDLaw, `(≥ at + 4,)`.
        at: index of the first.
    """
    asked = law[at + STIFFNESS] * (target - angle) - law[at + DAMPING] * coasting + law[at + FEED] * target
    if asked > law[at + STRONGEST]:
        return law[at + STRONGEST]
    if asked < -law[at + STRONGEST]:
        return -law[at + STRONGEST]
    return asked
