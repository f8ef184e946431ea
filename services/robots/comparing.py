"""Rollouts of the same controllers in two worlds."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.random import default_rng

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.arrays import FloatArray, frozen, known
from gaplab.services.core.errors import InvalidRobot
from gaplab.services.engines import engines
from gaplab.services.engines.base import Engine
from gaplab.services.engines.mujoco.plain import plain_positions
from gaplab.services.world.controllers import controllers
from gaplab.services.world.motions import Motion
from gaplab.services.world.tasks import tasks
from gaplab.services.world.world import World

ROLLOUTS = 5
COMPARED_S = frozen(np.arange(1, 11) / 10)
"""Times at which rollouts are compared. After a second, contacts have made rounding large in any robot that falls."""

SAME_M = 1e-6
"""Distance that rounding explains in any engine."""

AS_ROUNDING = 3.0
"""Factor of the distance by which a change of the last bits of all masses moves a robot in the same engine: where a
hull meets the ground, an engine may choose other points of contact."""

LAST_BITS = 1 + 2.0**-50


def check_rollouts(first: World, second: World, engine: Engine, controller: PluginRef, task: PluginRef) -> float:
    """Return the largest distance between the observed bodies of two worlds in rollouts of the same genomes, m.

    Args:
        first: a world.
        second: another world of the same robot.
        engine: engine that simulates both.
        controller: controller; its genomes are drawn from its space, always the same ones.
        task: the controller's task.

    Raises:
        InvalidSpec: the controller or the task is not installed here.
        InvalidRobot: the distance is larger than rounding explains, or the physics fails in one of the worlds alone, or
            in all rollouts.
    """
    motions = _motions(first, controller, task)
    paths = [engine.rollouts([world], motions).positions_m for world in (first, second)]
    if not np.array_equal(np.isnan(paths[0]), np.isnan(paths[1])):
        raise InvalidRobot(["the physics fails in the tuned world or in that of the new file, but not in both"])
    if np.isnan(paths[0]).all():
        raise InvalidRobot(["the physics fails in every rollout of the tuned world, so nothing can be compared"])
    largest = _distance_m(*paths)
    if largest > SAME_M:
        by_rounding = _distance_m(paths[0], engine.rollouts([_rounded(first)], motions).positions_m)
        permitted = max(SAME_M, AS_ROUNDING * by_rounding)
        if largest > permitted:
            far = f"rollouts in the world of the new file are up to {largest:.3g} m from those in the tuned one"
            raise InvalidRobot([f"{far}; permitted: at most {permitted:.3g} m"])
    return largest


def plain_distance_m(world: World, engine: Engine, controller: PluginRef, task: PluginRef) -> float | None:
    """Return the largest distance of the same rollouts from those in MuJoCo alone, m.

    None if the physics fails in either, if the controller observes while it acts, without MuJoCo, or if
    it refuses the world.
    """
    motions = _motions(world, controller, task)
    if not engines["mujoco"].available() or not isinstance(motions[0], Motion):
        return None
    here = engine.rollouts([world], motions).positions_m[:, 0]
    try:
        plain = [plain_positions(world, motion) for motion in motions]
    except InvalidRobot:
        return None
    return known(np.linalg.norm(plain - here, axis=-1).max())


def _motions(world: World, controller: PluginRef, task: PluginRef) -> Any:  # noqa: ANN401 - all of one kind
    """Return the motions of the same genomes, observed at `COMPARED_S`."""
    driver = controllers.create(controller)
    driver.prepare(world, tasks.create(task).observe_s)
    genomes = driver.space.draw(ROLLOUTS, default_rng(0))
    return [driver.motion(genome).observed_at(COMPARED_S) for genome in genomes]


def _distance_m(first: FloatArray, second: FloatArray) -> float:
    return float(np.nanmax(np.linalg.norm(first - second, axis=-1), initial=0.0))


def _rounded(world: World) -> World:
    return replace(world, bodies=tuple(replace(body, mass_kg=body.mass_kg * LAST_BITS) for body in world.bodies))
