"""The law of a PD motor: four constants for a rollout, and a torque in each step that compiled code can compute too."""

from collections.abc import Sequence
from typing import NamedTuple

from gaplab.services.core.world import PDMotor

STIFFNESS, DAMPING, FEED, STRONGEST = 0, 1, 2, 3
"""Indices into a PDLaw, for compiled code that has its constants in an array."""


class PDLaw(NamedTuple):
    """The torque of a PDMotor: stiffness (u - q) - damping v + feed u, limited to ± strongest.

    Attributes:
        stiffness: N·m/rad; N/m for a joint that slides, and likewise below.
        damping: N·m·s/rad.
        feed: torque by target.
        strongest_nm: largest torque.
    """

    stiffness: float
    damping: float
    feed: float
    strongest_nm: float


def pd_law(motor: PDMotor, inverse_inertia: float, step_s: float) -> PDLaw:
    """Return the law of a motor, whose formulas are those of PDMotor.

    Args:
        motor: motor.
        inverse_inertia: acceleration of the joint by torque at the start of a rollout, all other joints and the base
            free: its place in the diagonal of the inverse of the inertia matrix, with armatures, 1/(kg m²).
        step_s: time step.
    """
    kp, kd, strongest = motor.kp, motor.kd, motor.max_torque_nm
    if motor.follows == "torque":
        return PDLaw(0.0, 0.0, 1.0, strongest)
    if motor.follows == "velocity":
        damping = kd / (1.0 + step_s * kd * inverse_inertia)
        return PDLaw(0.0, damping, damping, strongest)
    divisor = 1.0 + step_s * (kd + step_s * kp) * inverse_inertia
    return PDLaw(kp / divisor, (kd + step_s * kp) / divisor, 0.0, strongest)


def pd_torque(target: float, angle: float, speed: float, law: Sequence[float], at: int = 0) -> float:
    """Return the torque of a motor in a step; nan if any number is nan.

    Args:
        target: its target.
        angle: of its joint at the start of the step.
        speed: likewise.
        law: constants of a PDLaw, `(≥ at + 4,)`.
        at: index of the first.
    """
    asked = law[at + STIFFNESS] * (target - angle) - law[at + DAMPING] * speed + law[at + FEED] * target
    if asked > law[at + STRONGEST]:
        return law[at + STRONGEST]
    if asked < -law[at + STRONGEST]:
        return -law[at + STRONGEST]
    return asked
