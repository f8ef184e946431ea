"""What the law reads of a world, apart from what MuJoCo's model has: its settings, as an array for compiled code."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.motor_law import PDLaw
from gaplab.services.core.world import World

STEP, FALL, SWEEPS, DOFS, AHEAD, SERVOS, MOTORS, DAMPERS, FIRST = range(9)
"""Indices into the settings: time step, speed that gravity adds in it, solver iterations, number of degrees of freedom,
by how much a joint's place among the positions is ahead of that among the speeds, numbers of servos, PD motors and
damped joints, and the first of these."""

DOF = 0
"""Index into the settings of a servo, a PD motor or a damped joint: its degree of freedom."""

GAIN, FASTEST, STRONGEST, ROTOR, EACH_SERVO = range(1, 6)
"""Indices into a servo's settings, and their number: see Servo."""

LAW, MOTOR_ROTOR, EACH_MOTOR = 1, 5, 6
"""Indices into a PD motor's settings of its PDLaw and its rotor, and their number: see PD."""

DAMPING, EACH_DAMPER = 1, 2
"""Index into a damped joint's settings, and their number."""


class Servo(NamedTuple):
    """The settings of a Motor: degree of freedom, share of the error closed in a step, limits, and rotor's inertia."""

    dof: int
    gain: float
    fastest_rad_s: float
    strongest_nm: float
    rotor_kg_m2: float


class PD(NamedTuple):
    """The settings of a PDMotor: degree of freedom, law, and inertia of a rotor that turns with its joint.

    The law gives the torque on joint and rotor. What the rotor takes of it makes the rest depend on the speed at the
    end of the step.
    """

    dof: int
    law: PDLaw
    rotor_kg_m2: float


def settings(
    world: World,
    dofs: int,
    ahead: int,
    servos: Sequence[Servo] = (),
    motors: Sequence[PD] = (),
    dampers: Sequence[tuple[int, float]] = (),
) -> FloatArray:
    """Return the settings of a world, as an array for the law.

    Args:
        world: world.
        dofs: number of degrees of freedom.
        ahead: number of positions, less that of degrees of freedom.
        servos: its Motors.
        motors: its PDMotors.
        dampers: damping of degrees of freedom, by these.
    """
    step, sweeps = world.time_step_s, max(1, world.solver_iterations)
    counts = (len(servos), len(motors), len(dampers))
    tables = [
        *(value for servo in servos for value in servo),
        *(value for dof, law, rotor in motors for value in (dof, *law, rotor)),
        *(value for damper in dampers for value in damper),
    ]
    return np.array([step, abs(world.gravity_m_s2) * step, sweeps, dofs, ahead, *counts, *tables])
