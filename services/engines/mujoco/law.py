"""The law of motors, joints and contacts, in place of MuJoCo's own, and the settings that it reads of a world.

A World has static friction, dynamic friction and restitution; MuJoCo's contacts have none of these. Therefore MuJoCo
computes kinematics, collisions and the inverse inertia at contacts and limits, and this law computes the forces, in
plain functions on arrays. `callback` compiles them. What MuJoCo's model has no place for is an array of settings.
"""

from collections.abc import Sequence
from itertools import chain
from math import hypot
from typing import Any, NamedTuple

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.world.world import DAMPING as VISCOSITY
from gaplab.services.world.world import FEED, STIFFNESS, PDLaw, World
from gaplab.services.world.world import STRONGEST as STRONGEST_NM

STEP, FALL, SWEEPS, DOFS, AHEAD, SERVOS, MOTORS, DAMPERS, STICKERS, FIRST = range(10)
"""Indices into the settings: time step, speed that gravity adds in it, solver iterations, number of degrees of freedom,
by how much a joint's place among the positions is ahead of that among the speeds, numbers of servos, PD motors, damped
and sticking joints, and the first of these."""

DOF = 0
"""Index into the settings of a servo, a PD motor or a damped joint: its degree of freedom."""

GAIN, FASTEST, STRONGEST, ROTOR, EACH_SERVO = range(1, 6)
"""Indices into a servo's settings, and their number: see Servo."""

LAW, MOTOR_ROTOR, EACH_MOTOR = 1, 5, 6
"""Indices into a PD motor's settings of its PDLaw and its rotor, and their number: see PD."""

DAMPING, EACH_DAMPER = 1, 2
"""Index into a damped joint's settings, and their number."""

EACH_STICKER = 4
"""Number of a sticking joint's settings: its place among those with friction, and three of `friction_nm`."""


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
    servos: Sequence[Servo] = (),
    motors: Sequence[PD] = (),
    dampers: Sequence[tuple[int, float]] = (),
    stickers: Sequence[tuple[int, float, float, float]] = (),
) -> FloatArray:
    """Return the settings of a world, as an array for the law; dampers are degrees of freedom with their damping."""
    step, sweeps, ahead = world.time_step_s, max(1, world.solver_iterations), 0 if world.fixed else 1
    counts = (len(servos), len(motors), len(dampers), len(stickers))
    rows: list[tuple[float, ...]] = [*servos, *((dof, *law, rotor) for dof, law, rotor in motors), *dampers, *stickers]
    return np.array([step, abs(world.gravity_m_s2) * step, sweeps, dofs, ahead, *counts, *chain.from_iterable(rows)])


SLIDES_M_S = 0.01
"""Speed along the ground above which a contact slides: a tenth of the speed that gravity adds in 1/100 s."""

PUSHED_OUT = 0.2
"""Share of its depth by which a step pushes a contact out of the ground, as in Bullet."""

BOUNCES = 2.0
"""Bounce threshold: the speed that gravity adds in this many steps; at 1/100 s Bullet's 0.2 m/s."""

STATIC, DYNAMIC, RESTITUTION = 0, 2, 3
"""Indices into a contact's five coefficients."""

ROWS = 3
"""Rows of a contact: away from the ground, and two directions along it."""


def drive(known: Any, forces: Any, angles: Any, speeds: Any, accelerations: Any) -> None:
    """Compute the torques of the motors.

    A Motor targets the speed that closes its share of the error in a step. Its rotor turns with its joint, and the
    torque would bring the rotor alone to that speed. This acts like an implicit servo, which is stable at any strength.
    A PDMotor has a rotor too, of the inertia that makes its torque that of the end of the step. The joint should get
    the whole torque, so the torque that the rotor took in the last step is added to the limit.

    Args:
        known: settings.
        forces: `(d,)`: targets; overwritten with torques.
        angles: `(d + ahead,)`; for a base that is free, the first seven are its pose.
        speeds: `(d,)`; for a base that is free, the first six are its own.
        accelerations: `(d,)`, of the last step; zeros in the first step.
    """
    ahead, at = int(known[AHEAD]), FIRST
    for _ in range(int(known[SERVOS])):
        dof, rotor = int(known[at + DOF]), known[at + ROTOR]
        fastest, strongest = known[at + FASTEST], known[at + STRONGEST]
        closing = known[at + GAIN] * (forces[dof] - angles[dof + ahead]) / known[STEP]
        wanted = np.minimum(np.maximum(closing, -fastest), fastest)
        asked, took = rotor * (wanted - speeds[dof]) / known[STEP], rotor * accelerations[dof]
        forces[dof] = np.minimum(np.maximum(asked, min(0.0, took) - strongest), max(0.0, took) + strongest)
        at += EACH_SERVO
    for _ in range(int(known[MOTORS])):
        dof, law = int(known[at + DOF]), at + LAW
        asked = known[law + STIFFNESS] * (forces[dof] - angles[dof + ahead]) + known[law + FEED] * forces[dof]
        asked -= known[law + VISCOSITY] * speeds[dof]
        strongest, took = known[law + STRONGEST_NM], known[at + MOTOR_ROTOR] * accelerations[dof]
        forces[dof] = np.minimum(np.maximum(asked, min(0.0, took) - strongest), max(0.0, took) + strongest)
        at += EACH_MOTOR


def damp(known: Any, forces: Any, speeds: Any) -> None:
    """Subtract the damping `(d,)` from the forces; MuJoCo's armature makes it that of the speeds after the step."""
    at = FIRST + EACH_SERVO * int(known[SERVOS]) + EACH_MOTOR * int(known[MOTORS])
    for _ in range(int(known[DAMPERS])):
        dof = int(known[at + DOF])
        forces[dof] -= known[at + DAMPING] * speeds[dof]
        at += EACH_DAMPER


def drive_torques(turn: Any, known: Any, targets: Any, states: Any, around: Any) -> None:
    """Compute the torques that motors gave their joints in some steps of a rollout, N·m; 0 without a motor.

    What the rotor takes is not the joint's. In an impact the rotor passes on more than its motor can; the motor's limit
    counts.

    Args:
        turn: `drive`.
        known: settings.
        targets: `(k, d)`: in each step; overwritten with torques.
        states: `(s, d + ahead + d)`: positions and speeds.
        around: `(3, k)`: places of those before the step before, which may be the same; before each step; and after it.
    """
    servos, motors, step = int(known[SERVOS]), int(known[MOTORS]), known[STEP]
    first, felt = int(known[DOFS]) + int(known[AHEAD]), np.empty(int(known[DOFS]))
    for number in range(len(targets)):
        earlier, now, after = states[around[0, number]], states[around[1, number]], states[around[2, number]]
        for dof in range(len(felt)):
            felt[dof] = (now[first + dof] - earlier[first + dof]) / step
        turn(known, targets[number], now, now[first:], felt)
        at = FIRST
        for motor in range(servos + motors):
            servo = motor < servos
            dof = int(known[at + DOF])
            rotor = known[at + ROTOR] if servo else known[at + MOTOR_ROTOR]
            strongest = known[at + STRONGEST] if servo else known[at + LAW + STRONGEST_NM]
            given = targets[number, dof] - rotor * ((after[first + dof] - now[first + dof]) / step)
            targets[number, dof] = np.minimum(np.maximum(given, -strongest), strongest)
            at += EACH_SERVO if servo else EACH_MOTOR


def stick(known: Any, friction_of: Any, speeds: Any, frictions: Any) -> None:
    """Set the largest torques of the joints that stick.

    Args:
        known: settings.
        friction_of: `friction_nm`.
        speeds: `(r,)`, of joints with friction, at the start of the step.
        frictions: `(r,)`, overwritten.
    """
    at = FIRST + EACH_SERVO * int(known[SERVOS]) + EACH_MOTOR * int(known[MOTORS]) + EACH_DAMPER * int(known[DAMPERS])
    for _ in range(int(known[STICKERS])):
        row = int(known[at])
        frictions[row] = friction_of(known[at + 1], known[at + 2], known[at + 3], speeds[row])
        at += EACH_STICKER


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


def stop(known: Any, gap: float) -> Any:
    """Return the smallest speed away from a limit at the end of a step: it closes the gap, or opens a share of it.

    The gap, rad, is negative beyond the limit.
    """
    return -gap / known[STEP] if gap > 0 else -PUSHED_OUT * gap / known[STEP]


def press(sweeps: int, singles: Any, inverse: Any, excess: Any, frictions: Any, impulses: Any) -> None:
    """Solve Coulomb's law by projected Gauss-Seidel: contacts push, never pull, and friction stays in its cone.

    Args:
        sweeps: number of sweeps over all rows.
        singles: `(2,)`: number of joints with dry friction, which have the first rows, and of these with the limits,
            which have the next. A contact has three rows.
        inverse: `(r, r)`, symmetric: inverse inertia, the speed of each row by the impulse in each row.
        excess: `(r,)`: speeds above the targets without the impulses; updated to include them.
        frictions: `(r,)`: coefficient of each contact, in the first of its three rows; largest impulse of the others.
        impulses: `(r,)`: zeros; overwritten with the impulses, N·s.
    """
    rows = len(excess)
    for _ in range(sweeps):
        for row in range(singles[1]):
            least, most = -frictions[row] if row < singles[0] else 0.0, frictions[row]
            wanted = min(max(least, impulses[row] - excess[row] / inverse[row, row]), most)
            change, impulses[row] = wanted - impulses[row], wanted
            for other in range(rows if change else 0):  # most limits bear nothing; what slides has all friction
                excess[other] += inverse[row, other] * change
        for row in range(singles[1], rows, ROWS):
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
