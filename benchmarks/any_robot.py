"""A robot with PD motors: Simulate against bare stepping, and 20 simulators by turns against one at a time.

`python -m benchmarks.any_robot ENGINE` prints both, for an engine that advances step by step. The robot has the
masses, moments, shapes and limits of a1 in pybullet_data, rounded; `--robot FILE` takes a robot file in place of it,
as `gaplab robot import` writes it. Bare stepping calls the same law of motors and
contacts on the same scene, without Simulate, worlds, poses and checks.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.controllers.square_pulses import SquarePulses
from gaplab.services.core.motions import LEVEL, Motion
from gaplab.services.core.robot_files import read_robot_file
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.shapes import Box, Cylinder, Part, Quaternion, Sphere
from gaplab.services.core.tasks.walk import Walk
from gaplab.services.core.tunables import tunables
from gaplab.services.core.world import Body, Inertia, Joint, Material, PDMotor, World
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.engines.stepped import SteppedEngine
from gaplab.services.specs.simulation import Simulation

ACROSS: Quaternion = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
DOWN: Quaternion = (0.0, 0.5**0.5, 0.0, 0.5**0.5)
MOTOR = PDMotor("position", 33.5, kp=100.0, kd=2.0)
MATERIALS = (Material(1.0, 0.8), Material(0.8, 0.8))
TURNS = 20
ROUNDS = 5


class Dog(Robot):
    """A robot like a1, from its usual stance, or another one with PD motors."""

    name = "dog"
    engine = "pybullet"
    usual_controller = PluginRef(name="square_pulses")
    usual_task = PluginRef(name="walk")

    def __init__(self, world: World | None = None) -> None:
        super().__init__()
        self.world = world or dog()
        self.perform(SquarePulses(), Walk())


def dog() -> World:
    """Return the world of a robot like a1."""
    trunk = Body(
        "trunk",
        4.713,
        (Part(Box((0.267, 0.194, 0.114))),),
        (0.0127, 0.0022, 0.0005),
        inertia=Inertia((0.0168, 0.0566, 0.0647)),
    )
    bodies, joints = [trunk], []
    for leg, ahead, side in (("fr", 1, -1), ("fl", 1, 1), ("rr", -1, -1), ("rl", -1, 1)):
        hip = (Part(Cylinder(0.046, 0.04), turn=ACROSS), Part(Cylinder(0.041, 0.032), (0.0, 0.081 * side, 0.0), ACROSS))
        shin = (Part(Box((0.2, 0.016, 0.016)), (0.0, 0.0, -0.1), DOWN), Part(Sphere(0.02), (0.0, 0.0, -0.2)))
        bodies += [
            Body(f"{leg}_hip", 0.697, hip, (-0.0033 * ahead, 0.0, 0.0), inertia=Inertia((0.0005, 0.0008, 0.0006))),
            Body(
                f"{leg}_upper",
                1.013,
                (Part(Box((0.2, 0.0245, 0.034)), (0.0, 0.0, -0.1), DOWN),),
                (-0.0032, -0.0223 * side, -0.0273),
                inertia=Inertia((0.0055, 0.0051, 0.0014)),
            ),
            Body(f"{leg}_lower", 0.226, shin, (0.0047, 0.0, -0.132), inertia=Inertia((0.0034, 0.0034, 0.00004))),
        ]
        hinges = (
            ("hip", "trunk", (0.183 * ahead, 0.047 * side, 0.0), (1.0, 0.0, 0.0), (-0.8, 0.8), 0.0),
            ("upper", f"{leg}_hip", (0.0, 0.08505 * side, 0.0), (0.0, 1.0, 0.0), (-1.05, 4.19), 0.9),
            ("lower", f"{leg}_upper", (0.0, 0.0, -0.2), (0.0, 1.0, 0.0), (-2.7, -0.92), -1.8),
        )
        joints += [
            Joint(f"{leg}_{part}", parent, f"{leg}_{part}", origin, axis, MOTOR, limits=limits, start=start, swing=0.2)
            for part, parent, origin, axis, limits, start in hinges
        ]
    return World(bodies=tuple(bodies), joints=tuple(joints), start_height_m=0.27, time_step_s=1 / 400)


def bare(engine: SteppedEngine[Any], world: World, motion: Motion) -> None:
    """Step a scene of the engine through a motion."""
    scene = engine._scenes[world.built(engine.in_place)]
    advance = engine._start(scene, world, LEVEL)
    ends = np.rint(np.append(motion.times_s[1:], motion.observe_s[-1]) / world.time_step_s).astype(int).tolist()
    now = 0
    for targets, end in zip(motion.targets.tolist(), ends, strict=True):
        for actuator, target in enumerate(targets):
            scene.command(actuator, target)
        advance(end - now)
        now = end


def best(runs: Sequence[Callable[[], object]], rounds: int = ROUNDS) -> list[float]:
    """Return the shortest processor time of each, s; they run by turns, so that a busy machine slows all alike."""
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(rounds):
        for run, its in zip(runs, times, strict=True):
            began = process_time()
            run()
            its.append(process_time() - began)
    return [min(its) for its in times]


def simulators(world: World) -> list[World]:
    """Return 20 worlds that differ in masses, gains and friction."""
    worlds = []
    for number in range(TURNS):
        factor = 0.8 + 0.4 * number / TURNS
        bodies = tuple(replace(body, mass_kg=factor * body.mass_kg) for body in world.bodies)
        heavier = world.edited("body.mass_kg", bodies=bodies)
        edited = heavier.edited("motor.kp", joints=tuple(stiffer(joint, factor) for joint in world.joints))
        worlds.append(replace(edited, material=Material(factor, 0.8 * factor)))
    return worlds


def stiffer(joint: Joint, factor: float) -> Joint:
    """Return a joint whose PD motor, if it has one, is stiffer by a factor."""
    motor = joint.motor
    return replace(joint, motor=replace(motor, kp=factor * motor.kp)) if isinstance(motor, PDMotor) else joint


def main() -> None:
    """Print both figures of an engine."""
    parser = ArgumentParser(prog="python -m benchmarks.any_robot", description=__doc__)
    parser.add_argument("engine", choices=[name for name, each in engines.items() if issubclass(each, SteppedEngine)])
    parser.add_argument("--robot", type=Path, help="robot file")
    arguments = parser.parse_args()
    engine = engines[arguments.engine]()
    assert isinstance(engine, SteppedEngine)
    robot = Dog(read_robot_file(arguments.robot.read_bytes()).world if arguments.robot else None)
    for material in MATERIALS:
        overhead(engine, robot, material)
    by_turns(engine, robot)


def overhead(engine: SteppedEngine[Any], robot: Robot, material: Material) -> None:
    """Print the time of a rollout through Simulate, and of bare stepping."""
    robot.world = replace(robot.world, material=material)
    motion = robot.motion(robot.known)
    assert isinstance(motion, Motion)
    simulation = Simulation(robot, engine, [tunables["dynamic_friction"]()])
    genome, friction = robot.known[None], np.array([[material.dynamic_friction]])
    whole, alone = best([lambda: simulation(genome, friction), lambda: bare(engine, robot.world, motion)], 3 * ROUNDS)
    print(f"{engine.name}, {material}: Simulate {1e3 * whole:.1f} ms, bare {1e3 * alone:.1f} ms, {alone / whole:.2f}")


def by_turns(engine: Engine, robot: Robot) -> None:
    """Print the time of a rollout in one of many simulators, by turns and one simulator at a time."""
    motion, worlds = robot.motion(robot.known), simulators(robot.world)
    turns, one_by_one = best(
        [
            lambda: [engine.rollout(world, motion) for _ in range(2) for world in worlds],
            lambda: [engine.rollout(world, motion) for world in worlds for _ in range(2)],
        ]
    )
    turns_ms, alone_ms = (1e3 * seconds / 2 / TURNS for seconds in (turns, one_by_one))
    ratio = f"{alone_ms / turns_ms:.3f}"
    print(f"{engine.name}, {TURNS} simulators by turns {turns_ms:.1f} ms, one at a time {alone_ms:.1f} ms, {ratio}")


if __name__ == "__main__":
    main()
