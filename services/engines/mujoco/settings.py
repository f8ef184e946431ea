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

GAIN, FASTEST, STRONGEST, ROTOR = range(1, 5)
"""Indices into a servo's settings: see Servo."""

LAW = 1
"""Index into a PD motor's settings of its PDLaw."""

DAMPING = 1
"""Index into a damped joint's settings."""

EACH, EACH_DAMPER = 5, 2
"""Numbers of settings of a motor, and of a damped joint."""


class Servo(NamedTuple):
    """The settings of a Motor: degree of freedom, share of the error closed in a step, limits, and rotor's inertia."""

    dof: int
    gain: float
    fastest_rad_s: float
    strongest_nm: float
    rotor_kg_m2: float


class Settings(NamedTuple):
    """What the law reads of a world, apart from what MuJoCo's model has.

    Attributes:
        servos: its Motors.
        motors: the degrees of freedom of its PDMotors, with their laws.
        dampers: damping of degrees of freedom, by these.
    """

    servos: Sequence[Servo] = ()
    motors: Sequence[tuple[int, PDLaw]] = ()
    dampers: Sequence[tuple[int, float]] = ()


def settings(world: World, dofs: int, ahead: int, of: Settings) -> FloatArray:
    """Return the settings of a world, as an array for the law.

    Args:
        world: world.
        dofs: number of degrees of freedom.
        ahead: number of positions, less that of degrees of freedom.
        of: its motors and damped joints.
    """
    step, sweeps = world.time_step_s, max(1, world.solver_iterations)
    counts = (len(of.servos), len(of.motors), len(of.dampers))
    tables = [
        *(value for servo in of.servos for value in servo),
        *(value for dof, law in of.motors for value in (dof, *law)),
        *(value for damper in of.dampers for value in damper),
    ]
    return np.array([step, abs(world.gravity_m_s2) * step, sweeps, dofs, ahead, *counts, *tables])
