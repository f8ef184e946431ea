"""The contract of an engine, with each robot that it runs."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gaplab.services.core.arrays import FloatArray
from gaplab.services.engines.base import Engine
from gaplab.services.world.robots import robots
from gaplab.services.world.robots.base import Robot
from gaplab.services.world.world import Material, World

Plugin = type[Engine]


def pairs(plugin: Plugin) -> Iterator[tuple[Engine, Robot]]:
    """Yield a new engine with each robot that it runs."""
    for robot in (each.example() for each in robots.values()):
        if plugin.runs(robot.world):
            yield plugin(), robot


def flat(engine: Engine, robot: Robot, world: World | None = None) -> FloatArray:
    """Return all numbers of the trajectory of a robot's known genome as one vector."""
    trajectory = engine.rollout(world or robot.world, robot.motion(robot.known))
    return np.concatenate([np.ravel(trajectory.positions_m), np.ravel(trajectory.orientations)])


def runs_a_robot(plugin: Plugin) -> None:
    """Is installed, and runs at least one robot."""
    assert plugin.available(), f"its library is not installed: {plugin.install}"
    assert any(True for _ in pairs(plugin)), f"it runs none of {', '.join(robots)}"


def repeats_itself(plugin: Plugin) -> None:
    """Gives the same bits for the same rollout, whatever it ran before."""
    for engine, robot in pairs(plugin):
        first = flat(engine, robot)
        flat(engine, robot, replace(robot.world, material=Material(0.3, 0.1, 0.5)))
        same = np.array_equal(first, flat(engine, robot), equal_nan=True)
        assert same, f"a repeated rollout of the {robot.label} differs"
        fresh = np.array_equal(first, flat(type(engine)(), robot), equal_nan=True)
        assert fresh, f"a rollout of the {robot.label} differs in a new engine"


def observes_a_pose_at_each_time(plugin: Plugin) -> None:
    """Returns a position and an orientation for each observed time."""
    for engine, robot in pairs(plugin):
        motion = robot.motion(robot.known)
        trajectory, count = engine.rollout(robot.world, motion), len(motion.observe_s)
        shapes = np.shape(trajectory.positions_m), np.shape(trajectory.orientations)
        assert shapes == ((count, 3), (count, 4)), f"for {count} times of the {robot.label} its shapes are {shapes}"
        assert np.array_equal(trajectory.times_s, motion.observe_s), "its times are not those of `observe_s`"
        finite = np.isfinite(trajectory.positions_m).all()
        assert finite, f"the known genome of the {robot.label} has positions that are not finite"


def runs_many_as_each(plugin: Plugin) -> None:
    """Gives the same bits for many rollouts at once and for each alone."""
    for engine, robot in pairs(plugin):
        worlds = [robot.world, replace(robot.world, material=Material(0.5, 0.3, 0.1))]
        motions = [robot.motion(genome) for genome in robot.space.draw(2, np.random.default_rng(0))]
        many = engine.rollouts(worlds, motions)
        for row, motion in enumerate(motions):
            for column, world in enumerate(worlds):
                alone = engine.rollout(world, motion).positions_m
                same = np.array_equal(many.positions_m[row, column], alone, equal_nan=True)
                assert same, f"of many rollouts of the {robot.label}, one differs from the same alone"


def honours_what_it_says(plugin: Plugin) -> None:
    """Changes its trajectories with the coefficients that it honours, and with no others."""
    for name, value in (("static_friction", 1.37), ("dynamic_friction", 0.41), ("restitution", 0.53)):
        changed = [robot.label for engine, robot in pairs(plugin) if _changes(engine, robot, **{name: value})]
        if f"material.{name}" in plugin.honours:
            assert changed, f"`honours` has material.{name}, which changes no trajectory"
        else:
            assert not changed, f"`honours` lacks material.{name}, which changes a rollout of the {changed[0]}"


def _changes(engine: Engine, robot: Robot, **coefficients: float) -> bool:
    world = replace(robot.world, material=replace(robot.world.material, **coefficients))
    return not np.array_equal(flat(engine, robot), flat(engine, robot, world), equal_nan=True)
