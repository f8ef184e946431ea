"""The paper's robot, rebuilt: four legs of three hinges, each driven by a periodic pulse of two genes."""

from typing import Annotated

import numpy as np
from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.services.core.arrays import FloatArray, Genome, frozen
from gaplab.services.core.robots.base import Robot, Sensors
from gaplab.services.core.space import Space
from gaplab.services.core.world import Body, Box, Joint, Material, Motion, Motor, Sphere, Trajectory, Vector, World

BODY_M: Vector = (0.30, 0.20, 0.06)
BODY_KG = 1.5
THIGH_M, THIGH_KG = 0.10, 0.15
SHIN_M = 0.15
FOOT_RADIUS_M, FOOT_KG = 0.025, 0.15
"""Radius and mass of a foot, which includes the shin's mass."""

HIP_M, HIP_KG = 0.03, 0.05
"""Size and mass of a hip, a small cube as thick as the thigh."""

MOTOR = Motor(position_gain=0.07, max_torque_nm=8.0)
AMPLITUDES_RAD = (0.63, 0.42, 0.49)
"""Amplitudes of hip yaw, hip roll and knee: plus this during a pulse, minus this between pulses."""

PERIOD_S = 0.5
SETTLING_S = 0.5
"""Time before the counted time: the robot drops to the ground and starts its gait."""

COUNTED_S = 2.5
SENSED_EVERY_S = 0.25
"""Interval between readings of the sensors."""

TILT_NOISE_RAD, PLACE_NOISE_M = 0.02, 0.005
"""Noise of the sensors: gaplab's defaults, of a cheap inertial sensor and a camera above the floor."""

NARROWEST, WIDEST = 0.1, 0.9
"""Width of a pulse in periods, at gene values 0 and 1."""

LEGS: dict[str, tuple[int, int]] = {
    "front_left": (1, 1),
    "front_right": (1, -1),
    "rear_left": (-1, 1),
    "rear_right": (-1, -1),
}
"""Position of each leg: the signs of x (ahead) and y (left)."""


class QuadrupedOptions(Frozen):
    """Options of the quadruped."""

    counted_s: Annotated[Real, Field(gt=0, le=600)] = Field(
        default=COUNTED_S,
        description="counted seconds, after the robot has settled; the cost of a rollout grows with it",
    )


class Quadruped(Robot):
    """Four legs of hip yaw, hip roll and knee: 12 actuators, each with a periodic pulse of phase and width.

    Gene 2i is the phase of actuator i, and gene 2i + 1 the width of its pulse, both in [0, 1]; phases wrap around. The
    actuators are leg by leg, front left, front right, rear left, rear right; positive is forwards for a yaw, upwards
    for a roll, outwards for a knee. Fitness is the distance over ground in any direction, divided by the counted
    time. This is a reconstruction: the publication that describes the paper's robot could not be found.
    """

    name = "quadruped"
    source = "Paper, section 2 and figure 1; docs/robot.md"
    engine = "pybullet"
    unit = "m/s"
    Options = QuadrupedOptions
    options: QuadrupedOptions

    def __init__(self, options: Frozen | None = None) -> None:
        super().__init__(options)
        self.world = _world()
        actuators = len(self.world.actuators)
        self.space = Space.box([0.0] * 2 * actuators, [1.0] * 2 * actuators, [True, False] * actuators)
        self.known = _trot()
        times = np.arange(1, np.floor(self.options.counted_s / SENSED_EVERY_S) + 1) * SENSED_EVERY_S
        self.sensors = Sensors(
            names=("roll", "pitch", "height", "x", "y"),
            units=("rad", "rad", "m", "m", "m"),
            noises=frozen([TILT_NOISE_RAD] * 2 + [PLACE_NOISE_M] * 3),
            times_s=frozen(SETTLING_S + times),
        )
        self._prepare_pulses(actuators)

    def _prepare_pulses(self, actuators: int) -> None:
        """Compute what all motions share; numpy is faster with these arrays than with numbers or rows to repeat."""
        duration_s = SETTLING_S + self.options.counted_s
        self._observe_s = frozen([SETTLING_S, duration_s])
        self._cycles = frozen(np.arange(np.ceil(duration_s / PERIOD_S))[:, None])
        self._narrowest, self._range = frozen([NARROWEST] * actuators), frozen([WIDEST - NARROWEST] * actuators)
        amplitudes = np.tile(AMPLITUDES_RAD, len(LEGS))[:, None]
        self._inside = frozen(np.repeat(amplitudes, 1 + 2 * actuators * self._cycles.size, axis=1))
        self._outside = frozen(-self._inside)

    def motion(self, genome: Genome) -> Motion:
        """Return the motion: each actuator is at plus its amplitude during its pulse, else at minus."""
        phases, widths = genome[0::2], self._narrowest + self._range * genome[1::2]
        ends = np.concatenate((phases, phases + widths))
        edges = ends - np.floor(ends)  # mod 1, to the last bit, in half the time
        edges.sort()
        times = np.empty(2 + self._cycles.size * edges.size)  # in periods, and a moment after the last
        times[0], times[1:-1] = 0.0, (self._cycles + edges).ravel()
        times[-1] = times[-2] + 1e-9
        since = (times[:-1] + times[1:]) / 2 - phases[:, None]
        since -= np.floor(since)
        targets = np.where(since < widths[:, None], self._inside, self._outside).T
        times_s, distinct = times[:-1] * PERIOD_S, times[:-1] != times[1:]
        if np.count_nonzero(distinct) < len(distinct):
            times_s, targets = times_s[distinct], targets[distinct]
        times_s.setflags(write=False)
        targets.setflags(write=False)
        return Motion(times_s, targets, self._observe_s)

    def fitness(self, trajectory: Trajectory) -> FloatArray:
        """Return `(...)`: the distance between first and last observation, divided by the time between them."""
        travelled = trajectory.positions_m[..., -1, :2] - trajectory.positions_m[..., 0, :2]
        squares = travelled * travelled
        distances = np.sqrt(squares[..., 0] + squares[..., 1])
        return np.asarray(distances / (trajectory.times_s[-1] - trajectory.times_s[0]))

    def sense(self, trajectory: Trajectory) -> FloatArray:
        """Return `(..., r, 5)`: roll and pitch of the trunk, its height, and its place on the ground from the start."""
        x, y, z, w = trajectory.orientations.reshape(-1, 4).T  # numpy is twice as fast with vectors
        values = np.empty((len(x), 5))
        values[:, 0] = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        values[:, 1] = np.arcsin(np.minimum(np.maximum(2 * (w * y - z * x), -1.0), 1.0))
        places = trajectory.positions_m.reshape(-1, 3)
        values[:, 2], values[:, 3:] = places[:, 2], places[:, :2]
        return values.reshape(*trajectory.positions_m.shape[:-1], 5)


def _world() -> World:
    """Return the robot in reality. Source: its material, the paper's section 2; all else docs/robot.md."""
    bodies = [Body("trunk", BODY_KG, Box(BODY_M))]
    joints: list[Joint] = []
    for leg, (ahead, left) in LEGS.items():
        limbs, hinges = _leg(leg, ahead, left)
        bodies += limbs
        joints += hinges
    return World(
        bodies=tuple(bodies),
        joints=tuple(joints),
        material=Material(static_friction=1.0, dynamic_friction=0.8, restitution=0.0),
        start_height_m=SHIN_M + FOOT_RADIUS_M,
        time_step_s=1 / 100,
    )


def _leg(name: str, ahead: int, left: int) -> tuple[list[Body], list[Joint]]:
    """Return a leg at a corner of the trunk: a level thigh to the side, a hanging shin, and a ball as foot."""
    hip, thigh, shin = f"{name}_hip", f"{name}_thigh", f"{name}_shin"
    corner = (ahead * BODY_M[0] / 2, left * BODY_M[1] / 2, 0.0)
    bodies = [
        Body(hip, HIP_KG, Box((HIP_M, HIP_M, HIP_M)), collides=False),
        Body(thigh, THIGH_KG, Box((HIP_M, THIGH_M, HIP_M)), (0.0, left * THIGH_M / 2, 0.0), collides=False),
        Body(shin, FOOT_KG, Sphere(FOOT_RADIUS_M), (0.0, 0.0, -SHIN_M)),
    ]
    joints = [
        Joint(f"{name}_yaw", "trunk", hip, corner, (0.0, 0.0, -float(left)), MOTOR),
        Joint(f"{name}_roll", hip, thigh, (0.0, 0.0, 0.0), (float(left), 0.0, 0.0), MOTOR),
        Joint(f"{name}_knee", thigh, shin, (0.0, left * THIGH_M, 0.0), (float(left), 0.0, 0.0), MOTOR),
    ]
    return bodies, joints


def _trot() -> Genome:
    """Return a hand-designed trot: diagonal legs move together, the two pairs half a period apart.

    Every pulse lasts half a period. A leg lifts a tenth of a period before it swings forwards, and its knee opens a
    quarter after; these two numbers were found by trial.
    """
    starts = {"front_left": 0.0, "front_right": 0.5, "rear_left": 0.5, "rear_right": 0.0}
    yaw, roll, knee = 0.0, 0.9, 0.25
    return frozen([((starts[leg] + phase) % 1, 0.5) for leg in LEGS for phase in (yaw, roll, knee)]).ravel()
