"""The law of motors and contacts, in place of MuJoCo's own.

A World has static friction, dynamic friction and restitution; MuJoCo's contacts have none of these. Therefore MuJoCo
computes kinematics, collisions and the inverse inertia at contacts, and this law computes the forces, in plain
functions on arrays. `callback` compiles them.
"""

from collections.abc import Sequence
from math import hypot
from typing import Any, NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.world import World

SLIDES_M_S = 0.01
"""Speed along the ground above which a contact slides: a tenth of the speed that gravity adds in 1/100 s."""

PUSHED_OUT = 0.2
"""Share of its depth by which a step pushes a contact out of the ground, as in Bullet."""

BOUNCES = 2.0
"""Bounce threshold: the speed that gravity adds in this many steps; at 1/100 s Bullet's 0.2 m/s."""

STEP, FALL, SWEEPS, DOFS, MOTORS, FIRST = 0, 1, 2, 3, 4, 5
"""Indices into the settings: time step, speed that gravity adds in it, solver iterations, numbers of degrees of freedom
and motors, and the first motor."""

DOF, GAIN, FASTEST, STRONGEST, ROTOR, EACH = 0, 1, 2, 3, 4, 5
"""Indices into a motor's settings, and their number."""

STATIC, DYNAMIC, RESTITUTION = 0, 2, 3
"""Indices into a contact's five coefficients."""

ROWS = 3
"""Rows of a contact: away from the ground, and two directions along it."""


class Drive(NamedTuple):
    """A motor's settings: its degree of freedom, share of the error closed in a step, limits, and rotor's inertia."""

    dof: int
    gain: float
    fastest_rad_s: float
    strongest_nm: float
    rotor_kg_m2: float


def settings(world: World, dofs: int, drives: Sequence[Drive]) -> FloatArray:
    """Return the settings of a world, as an array for the law."""
    step, sweeps = world.time_step_s, max(1, world.solver_iterations)
    motors = [value for drive in drives for value in drive]
    return np.array([step, abs(world.gravity_m_s2) * step, sweeps, dofs, len(drives), *motors])


def drive(known: Any, forces: Any, angles: Any, speeds: Any, accelerations: Any) -> None:
    """Compute the torques of the motors.

    A motor targets the speed that closes its share of the error in a step. Its rotor turns with its hinge, and the
    torque would bring the rotor alone to that speed. This acts like an implicit servo, which is stable at any strength.
    The hinge should get the whole torque, so the torque that the rotor took in the last step is added to the limit.

    Args:
        known: settings.
        forces: `(6 + hinges,)`: targets, rad; overwritten with torques.
        angles: `(7 + hinges,)`; the first seven are the pose of the base.
        speeds: `(6 + hinges,)`; the first six are the base's.
        accelerations: `(6 + hinges,)`, of the last step; zeros in the first step.
    """
    for motor in range(int(known[MOTORS])):
        at = FIRST + EACH * motor
        dof, rotor = int(known[at + DOF]), known[at + ROTOR]
        fastest, strongest = known[at + FASTEST], known[at + STRONGEST]
        closing = known[at + GAIN] * (forces[dof] - angles[dof + 1]) / known[STEP]
        wanted = np.minimum(np.maximum(closing, -fastest), fastest)
        asked, took = rotor * (wanted - speeds[dof]) / known[STEP], rotor * accelerations[dof]
        forces[dof] = np.minimum(np.maximum(asked, min(0.0, took) - strongest), max(0.0, took) + strongest)


def drive_torques(known: FloatArray, targets: FloatArray, angles: FloatArray, speeds: FloatArray) -> FloatArray:
    """Return the torques that motors gave their hinges in each step of a rollout, within their limits.

    What the rotor takes is not the hinge's. In an impact the rotor passes on more than its motor can; the motor's limit
    counts.

    Args:
        known: settings.
        targets: `(s, 6 + hinges)`: targets, rad.
        angles: `(s + 1, 7 + hinges)`: before each step, and at the end.
        speeds: `(s + 1, 6 + hinges)`, likewise.

    Returns:
        `(s, 6 + hinges)`, N·m; 0 without a motor.
    """
    accelerations = np.diff(speeds, axis=0) / known[STEP]
    before = np.vstack([np.zeros_like(accelerations[:1]), accelerations[:-1]])
    found = np.array(targets)
    for step, forces in enumerate(found):
        drive(known, forces, angles[step], speeds[step], before[step])
    for motor in range(int(known[MOTORS])):
        at = FIRST + EACH * motor
        dof, strongest = int(known[at + DOF]), known[at + STRONGEST]
        found[:, dof] = np.clip(found[:, dof] - known[at + ROTOR] * accelerations[:, dof], -strongest, strongest)
    return found


def coast(step: float, jacobian: Any, before: Any, accelerations: Any, excess: Any, impulses: Any) -> None:
    """Compute the speeds of the contacts' rows at the end of the step without contact forces.

    Args:
        step: length of the step, s.
        jacobian: `(r, d)`: speeds of the rows by speeds of the degrees of freedom.
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
    """Compute a contact's target speeds, and return its friction: dynamic if it slides, else static.

    The target along the ground is rest. The target away from the ground is the larger of two: the restitution's share
    of the speed of approach, and the speed that pushes it out.

    Args:
        known: settings.
        depth: depth in the ground, m.
        before: `(3,)`: speeds at the start of the step: away from the ground, and along it.
        coefficients: `(5,)`: static friction twice, dynamic friction, restitution, unused.
        excess: `(3,)`: speeds at the end of the step without force; the target speeds are subtracted.
    """
    wanted = PUSHED_OUT * depth / known[STEP]
    if -before[0] > BOUNCES * known[FALL]:
        wanted = max(wanted, -coefficients[RESTITUTION] * before[0])
    excess[0] -= wanted
    return coefficients[DYNAMIC] if hypot(before[1], before[2]) > SLIDES_M_S else coefficients[STATIC]


def press(sweeps: int, inverse: Any, excess: Any, frictions: Any, impulses: Any) -> None:
    """Solve Coulomb's law by projected Gauss-Seidel: contacts push, never pull, and friction stays in its cone.

    Args:
        sweeps: number of sweeps over all contacts.
        inverse: `(r, r)`, symmetric: inverse inertia, the speed of each row by the impulse in each row.
        excess: `(r,)`: speeds above the targets without the impulses; updated to include them.
        frictions: `(r,)`: coefficient of each contact, in the first of its three rows.
        impulses: `(r,)`: zeros; overwritten with the impulses of the contacts, N·s.
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


def apply_impulses(step: float, jacobian: Any, impulses: Any, forces: Any) -> None:
    """Add the impulses `(r,)` of the contacts in a step to `forces` `(d,)`, as forces on the degrees of freedom."""
    for row in range(len(impulses)):
        for dof in range(len(forces)):
            forces[dof] += jacobian[row, dof] * impulses[row] / step
