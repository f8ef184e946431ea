"""The task of arms: the distance of a tool from a place."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract.robots import arm
from gaplab.services.engines import engines
from gaplab.services.world.controllers import controllers
from gaplab.services.world.motions import Trajectory
from gaplab.services.world.tasks import tasks


def reach(**options: Any) -> Any:
    return tasks.create(PluginRef(name="reach", options=options))


def moved(task: Any, places_m: Any) -> Trajectory:
    return Trajectory(task.observe_s, np.array(places_m), np.zeros((len(places_m), 4)))


def test_fitness_is_minus_the_mean_distance_over_the_counted_time() -> None:
    task = reach(x_m=0.0, y_m=0.0, z_m=1.0, settling_s=1.0, counted_s=0.1)
    assert task.observe_s.tolist() == pytest.approx([0.0, 1.0, 1.05, 1.1])

    trajectory = moved(task, [[0.0, 0.0, 5.0], [0.3, 0.0, 1.0], [0.0, 0.2, 1.0], [0.0, 0.0, 0.9]])

    assert float(task.fitness(trajectory)) == pytest.approx(-0.2)
    reduction = reach(x_m=0.0, y_m=0.0, z_m=1.0, settling_s=1.0, counted_s=0.1, measure="reduction")
    assert float(reduction.fitness(trajectory)) == pytest.approx(4.0 - 0.2)


def test_without_settling_the_start_counts_too() -> None:
    task = reach(x_m=0.0, y_m=0.0, z_m=0.0, settling_s=0.0, counted_s=0.1)
    assert task.observe_s.tolist() == pytest.approx([0.0, 0.05, 0.1])

    assert float(task.fitness(moved(task, [[0.3, 0, 0], [0, 0, 0], [0, 0, 0]]))) == pytest.approx(-0.1)


@pytest.mark.parametrize("engine", ["pybullet", "mujoco"])
def test_an_arm_reaches_a_place_better_the_nearer_its_targets_bring_it(engine: str) -> None:
    world = replace(arm(), observed="link_2")
    task = reach(x_m=0.6, y_m=0.0, z_m=0.6)
    controller = controllers.create(PluginRef(name="sine", options={"amplitude": 2.0}))
    controller.prepare(world, task.observe_s)
    fitnesses = []
    for offset in (-1.0, 0.0, 1.0):  # of the first joint, which turns the arm about y, towards the place
        genome = np.zeros(controller.space.size)
        genome[3] = offset
        motion = controller.motion(genome)
        fitnesses.append(float(task.fitness(engines.create(PluginRef(name=engine)).rollout(world, motion))))

    assert fitnesses[0] + 0.1 < fitnesses[1] < fitnesses[2] - 0.1 < -0.1
