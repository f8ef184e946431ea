"""A robot with every shape, a slide and a slope, and an engine that moves it by a formula: what pictures must show.

Both are external plug-ins, as replays are computed in another process.
"""

from typing import Any

import numpy as np

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Measured, Probed, Sample, Selected, Simulator, Transferred, Tuned
from gaplab.services.running import execution
from gaplab.services.specs.assembly import setting
from gaplab.services.store.session import Store
from gaplab.services.world.robots import robots
from tests.experiments import submit_one

ENGINE = '''
"""An engine without physics."""

import numpy as np

from gaplab.plugins import Engine, Trajectory
from gaplab.services.world.kinematics import observed_poses
from gaplab.services.world.motions import Recording
from gaplab.services.engines.base import ALL_FIELDS


class Puppet(Engine):
    """Swings each joint about its start, and pulls the base along x, the faster the higher the friction."""

    name = "puppet"
    honours = ALL_FIELDS
    closes_loops = True
    repeatable = True

    @classmethod
    def runs(cls, world):
        return bool(world.bodies)

    def rollout(self, world, motion):
        poses, angles = moved(world, motion.observe_s)
        seen = observed_poses(world, poses, angles)
        return Trajectory(motion.observe_s, seen[:, :3], seen[:, 3:])

    def record(self, world, motion, times_s):
        poses, angles = moved(world, times_s)
        return Recording(self.rollout(world, motion), times_s, poses, angles)


def moved(world, times_s):
    speed = 0.0 if world.fixed else 0.3 * world.material.dynamic_friction
    position = np.stack([speed * times_s, 0 * times_s, np.full(len(times_s), world.start_height_m)], axis=1)
    poses = np.hstack([position, np.broadcast_to(world.start_turn, (len(times_s), 4))])
    swings = [j.start + (0.04 if j.slides else 0.35) * np.sin(4 * times_s + 2 * i) for i, j in enumerate(world.joints)]
    return poses, np.array(swings).reshape(len(world.joints), -1).T
'''

ROBOT = '''
"""A robot with every shape."""

import numpy as np

from gaplab.plugins import (
    Body, Box, Capsule, Cylinder, Hull, Inertia, Joint, Loop, Material, PDMotor, Part, Robot, Space, Sphere, World,
    frozen,
)

EVEN = Inertia((0.01, 0.01, 0.01))
PD = PDMotor("position", 10.0, kp=20.0, kd=1.0)
SIDEWAYS = (0.7071067811865476, 0.0, 0.0, 0.7071067811865476)
ALONG = (0.0, 0.7071067811865476, 0.0, 0.7071067811865476)
WEDGE = Hull(tuple(
    (x, y * wide, z) for x, wide, low in ((-0.2, 0.11, -0.05), (0.12, 0.11, -0.05), (0.26, 0.05, 0.0))
    for y in (-1, 1) for z in (low, 0.06)
))
PROFILE = ((-0.04, 0.0), (0.07, 0.0), (0.03, 0.03), (-0.04, 0.03))
SOLE = Hull(tuple((x, y, z) for x, z in PROFILE for y in (-0.03, 0.03)))


def leg(side, y):
    thigh = Body(f"{side}_thigh", 0.3, (Part(Capsule(0.03, 0.14), (0.0, 0.0, -0.1)),), (0, 0, -0.1), inertia=EVEN)
    foot = Body(
        f"{side}_foot", 0.2,
        (Part(Cylinder(0.02, 0.12), (0.0, 0.0, -0.09), collides=False), Part(SOLE, (0.0, 0.0, -0.19))),
        (0, 0, -0.1), inertia=EVEN,
    )
    return (thigh, foot), (
        Joint(f"{side}_hip", "torso", thigh.name, (-0.05, y, 0.0), (0.0, 1.0, 0.0), PD),
        Joint(f"{side}_knee", thigh.name, foot.name, (0.0, 0.0, -0.2), (0.0, 1.0, 0.0), PD),
    )


class Strider(Robot):
    """Two legs, a wheel, and a head on a slide that is observed."""

    name = "strider"
    engine = "puppet"
    unit = "m/s"
    space = Space.box([0.0, 0.0], [1.0, 1.0])
    known = frozen([0.5, 0.5])

    def __init__(self, options=None):
        super().__init__(options)
        (left, lefts), (right, rights) = leg("left", 0.14), leg("right", -0.14)
        torso = Body("torso", 2.0, (Part(WEDGE), Part(Box((0.1, 0.16, 0.04)), (-0.12, 0, 0.08))), inertia=EVEN)
        head = Body("head", 0.2, Sphere(0.05), collides=False)
        wheel = Body("wheel", 0.3, (Part(Cylinder(0.06, 0.03), turn=SIDEWAYS),), inertia=EVEN)
        neck = Joint("neck", "torso", "head", (0.15, 0.0, 0.16), (0.0, 0.0, 1.0), PD, slides=True, limits=(-0.1, 0.1))
        axle = Joint("axle", "torso", "wheel", (-0.28, 0.0, -0.29), (0.0, 1.0, 0.0))
        self.world = World(
            bodies=(torso, *left, *right, head, wheel), joints=(*lefts, *rights, neck, axle),
            material=Material(1.0, 0.8), start_height_m=0.39, slope_rad=0.12, observed="head",
        )

    def motion(self, genome):
        def act(genomes, observations, memories, time_s):
            return np.zeros((len(genomes), 5)), memories

        return Loop(act, (), genome, frozen([]), 0.02, frozen([0.5, 2.0]))

    def fitness(self, trajectory):
        return (trajectory.positions_m[..., -1, 0] - trajectory.positions_m[..., 0, 0]) / 1.5
'''

FILES = {"puppet": ENGINE, "strider": ROBOT}
"""Plug-in files by name."""

HIDDEN = {"static_friction": 0.9, "dynamic_friction": 0.6}


def strode(store: Store, *, iterations: int = 1, **changes: Any) -> str:
    """Return the id of an experiment with this robot, of which so many iterations are over; with two, it is."""
    spec = {"strategy": "simulated_fit", "robot": "strider", "engine": "puppet", "iterations": 1, "repetitions": 1}
    reality = {"engine": "puppet", "parameters": HIDDEN}
    more = {"budget": "smoke", "tunables": list(HIDDEN), "reality": reality}
    experiment = submit_one(store, ExperimentSpec.model_validate(spec | more | changes)).id
    (claim,) = execution.claim(store, "me", 1)
    known, setting_ = robots[claim.spec.robot.name]().known, setting(claim.spec, 0)
    real = setting_.reality(known)
    for iteration, friction in enumerate((0.5, 0.7)[:iterations]):
        tuned = np.array([friction, 0.3])
        measured = (Selected(iteration, known), Measured(iteration, Sample(known, real.fitness, real.readings)))
        for step in (
            *measured[: 2 * iteration],
            Tuned(iteration, (Simulator(frozen(tuned)),)),
            Transferred(iteration, known, float(setting_.simulate(known[None], tuned[None])[0, 0])),
            Probed(iteration, real.fitness, 0.1, real.readings),
        ):
            assert execution.record(store, claim, step)
    if iterations > 1:
        assert execution.complete(store, claim)
    return experiment
