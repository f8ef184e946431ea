"""The law of motors and contacts, in the place of MuJoCo's own.

A World has static and dynamic friction and a restitution; MuJoCo's contacts have none of the three in that sense. So
MuJoCo does what it is fast at, kinematics, collisions and the inverse inertia that contacts feel, and this law finds
the forces. These are its terms, as plain functions on arrays; `callback` makes machine code of them.
"""

from collections.abc import Sequence
from math import hypot
from typing import Any, NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.world import World

SLIDES_M_S = 0.01
"""A contact that moves along the ground faster than this slides: a tenth of the speed that gravity adds in 1/100 s."""

PUSHED_OUT = 0.2
"""Share of its depth that a contact is pushed out of the ground in a step: Bullet's."""

BOUNCES = 2.0
"""Only approaches faster than gravity adds in so many steps bounce: at 1/100 s Bullet's threshold of 0.2 m/s."""

STEP, FALL, SWEEPS, DOFS, MOTORS, FIRST = 0, 1, 2, 3, 4, 5
"""Places in the settings: the time step, the speed that gravity adds in it, the solver's iterations, how many degrees
of freedom and motors there are, and the first motor."""

DOF, GAIN, FASTEST, STRONGEST, ROTOR, EACH = 0, 1, 2, 3, 4, 5
"""Places in a motor's settings, and how many there are."""

STATIC, DYNAMIC, RESTITUTION = 0, 2, 3
"""Places among a contact's five coefficients."""

ROWS = 3
"""Of a contact: away from the ground, and two directions along it."""


class Drive(NamedTuple):
    """A motor's settings: its degree of freedom, share of the error closed in a step, limits, and rotor's inertia."""

    dof: int
    gain: float
    fastest_rad_s: float
    strongest_nm: float
    rotor_kg_m2: float


def settings(world: World, dofs: int, drives: Sequence[Drive]) -> FloatArray:
    """What the law knows of a world, as it reads it."""
    step, sweeps = world.time_step_s, max(1, world.solver_iterations)
    motors = [value for drive in drives for value in drive]
    return np.array([step, abs(world.gravity_m_s2) * step, sweeps, dofs, len(drives), *motors])


def drive(known: Any, forces: Any, angles: Any, speeds: Any, accelerations: Any) -> None:
    """The torques of the motors.

    A motor wants the speed that closes its share of the error in a step. Its rotor turns with its hinge, and the torque
    that would bring the rotor alone to that speed acts as if it looked at the speed at the end of the step: stable
    however strong it is. The hinge is to get the torque, not the rotor: what the rotor took in the last step is added
    to what the motor may do at most.

    Args:
        known: settings.
        forces: `(6 + hinges,)`: the targets, rad; torques when it returns.
        angles: `(7 + hinges,)`, the first seven being the pose of the base.
        speeds: `(6 + hinges,)`, the first six being the base's.
        accelerations: `(6 + hinges,)`, of the last step; zeros in the first.
    """
    for motor in range(int(known[MOTORS])):
        at = FIRST + EACH * motor
        dof, rotor = int(known[at + DOF]), known[at + ROTOR]
        fastest, strongest = known[at + FASTEST], known[at + STRONGEST]
        closing = known[at + GAIN] * (forces[dof] - angles[dof + 1]) / known[STEP]
        wanted = np.minimum(np.maximum(closing, -fastest), fastest)
        asked, took = rotor * (wanted - speeds[dof]) / known[STEP], rotor * accelerations[dof]
        forces[dof] = np.minimum(np.maximum(asked, min(0.0, took) - strongest), max(0.0, took) + strongest)


def coast(step: float, jacobian: Any, before: Any, accelerations: Any, excess: Any, impulses: Any) -> None:
    """The speeds of the contacts' rows at the end of the step if they exerted no force.

    Args:
        step: its length, s.
        jacobian: `(r, d)`: speeds of the rows for speeds of the degrees of freedom.
        before: `(r,)`: speeds at the start of the step.
        accelerations: `(d,)`, without contacts.
        excess: `(r,)`, written to.
        impulses: `(r,)`, set to zero.
    """
    for row in range(len(before)):
        excess[row], impulses[row] = before[row], 0.0
        for dof in range(len(accelerations)):
            excess[row] += step * jacobian[row, dof] * accelerations[dof]


def touch(known: Any, depth: float, before: Any, coefficients: Any, excess: Any) -> Any:
    """What a contact wants, and its coefficient of friction: the dynamic one if it slides, else the static one.

    Along the ground it wants to rest; away from it, to leave with the restitution's share of the speed of its approach,
    or to be pushed out, whichever is faster.

    Args:
        known: settings.
        depth: in the ground, m.
        before: `(3,)`: its speeds at the start of the step: away from the ground, and along it.
        coefficients: `(5,)`: static friction twice, dynamic friction, restitution, unused.
        excess: `(3,)`: its speeds at the end of the step if it exerted no force; minus those wanted when it returns.
    """
    wanted = PUSHED_OUT * depth / known[STEP]
    if -before[0] > BOUNCES * known[FALL]:
        wanted = max(wanted, -coefficients[RESTITUTION] * before[0])
    excess[0] -= wanted
    return coefficients[DYNAMIC] if hypot(before[1], before[2]) > SLIDES_M_S else coefficients[STATIC]


def press(sweeps: int, inverse: Any, excess: Any, frictions: Any, impulses: Any) -> None:
    """Coulomb's law by projected Gauss-Seidel: contacts push, never pull, and friction stays in its cone.

    Args:
        sweeps: over all contacts.
        inverse: `(r, r)`, inverse inertia: the speed of each row for an impulse in each row; symmetric.
        excess: `(r,)`: speeds above the wanted ones, without the impulses; with them when it returns.
        frictions: `(r,)`: coefficients of the contacts, each in the first of its three rows.
        impulses: `(r,)`: zeros; the contacts' impulses, N·s, when it returns.
    """
    rows = len(excess)
    for _ in range(sweeps):
        for row in range(0, rows, ROWS):
            first, second = row + 1, row + 2
            normal = max(0.0, impulses[row] - excess[row] / inverse[row, row])
            change, impulses[row] = normal - impulses[row], normal
            for other in range(rows):
                excess[other] += inverse[row, other] * change
            along = impulses[first] - excess[first] / inverse[first, first]
            across = impulses[second] - excess[second] / inverse[second, second]
            length, most = hypot(along, across), frictions[row] * normal
            share = most / length if length > most else 1.0
            change, impulses[first] = share * along - impulses[first], share * along
            aside, impulses[second] = share * across - impulses[second], share * across
            for other in range(rows):
                excess[other] += inverse[first, other] * change + inverse[second, other] * aside


def spread(step: float, jacobian: Any, impulses: Any, forces: Any) -> None:
    """Add the contacts' impulses `(r,)` in a step, as forces on the degrees of freedom, to `forces`, `(d,)`."""
    for row in range(len(impulses)):
        for dof in range(len(forces)):
            forces[dof] += jacobian[row, dof] * impulses[row] / step
