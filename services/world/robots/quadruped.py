"""The paper's robot, rebuilt: four legs of three hinges, each driven by a periodic pulse of two genes."""

from typing import Annotated

from pydantic import Field

from gaplab.schemas.base import Frozen, Real
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import Genome, frozen
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.world import Body, Box, Joint, Material, Motor, Sphere, Vector, World

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
"""Time before fitness counts: the robot drops to the ground and starts its gait."""

COUNTED_S = 2.5

LEGS: dict[str, tuple[int, int]] = {
    "front_left": (1, 1),
    "front_right": (1, -1),
    "rear_left": (-1, 1),
    "rear_right": (-1, -1),
}
"""Position of each leg: the signs of x (ahead) and y (left)."""


class QuadrupedOptions(Frozen):
    """Options of the robot `quadruped`."""

    counted_s: Annotated[Real, Field(gt=0, le=600)] = Field(
        default=COUNTED_S,
        description="seconds in which its usual task rates it, after settling; a spec with a task sets them there",
    )


class Quadruped(Robot):
    """Four legs of hip yaw, hip roll and knee: 12 actuators, each with a periodic pulse of phase and width.

    Gene 2i is the phase of actuator i, and gene 2i + 1 the width of its pulse, both in [0, 1]; phases wrap around. The
    actuators are leg by leg, front left, front right, rear left, rear right; positive is forwards for a yaw, upwards
    for a roll, outwards for a knee. Fitness is the distance over ground in any direction, divided by `counted_s`.
    This is a reconstruction: the publication that describes the paper's robot could not be found.
    """

    name = "quadruped"
    source = "Paper, section 2 and figure 1; docs/robot.md"
    engine = "pybullet"
    Options = QuadrupedOptions
    options: QuadrupedOptions
    usual_controller = PluginRef(name="square_pulses", options={"period_s": PERIOD_S})

    def build(self) -> None:
        """Set the world, and the task `walk` with the option `counted_s`."""
        self.world, self.designed = _world(), {"square_pulses": _trot()}
        timing = {"settling_s": SETTLING_S, "counted_s": self.options.counted_s}
        self.usual_task = PluginRef(name="walk", options=timing)


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
    yaw, roll, knee = AMPLITUDES_RAD
    joints = [
        Joint(f"{name}_yaw", "trunk", hip, corner, (0.0, 0.0, -float(left)), MOTOR, swing=yaw),
        Joint(f"{name}_roll", hip, thigh, (0.0, 0.0, 0.0), (float(left), 0.0, 0.0), MOTOR, swing=roll),
        Joint(f"{name}_knee", thigh, shin, (0.0, left * THIGH_M, 0.0), (float(left), 0.0, 0.0), MOTOR, swing=knee),
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
