"""What every robot promises, the day its file is there."""

from typing import Any

import numpy as np
import pytest

from gaplab.services.core.robots import robots
from gaplab.services.core.world import Trajectory
from gaplab.services.engines import engines


@pytest.mark.parametrize("name", sorted(robots))
class TestEveryRobot:
    def test_its_engine_is_there_and_runs_it(self, name: Any) -> None:
        robot = robots[name]()

        assert engines[robot.engine].runs(robot.world)

    def test_its_known_genome_lies_in_its_space(self, name: Any) -> None:
        robot = robots[name]()

        assert robot.known.shape == (robot.space.size,)
        assert np.all((robot.known >= robot.space.lower) & (robot.known <= robot.space.upper))

    def test_its_motions_drive_every_actuator_and_are_all_observed_at_the_same_times(self, name: Any) -> None:
        robot = robots[name]()
        motions = [robot.motion(genome) for genome in robot.space.draw(20, np.random.default_rng(0))]

        for motion in motions:
            assert motion.targets.shape == (len(motion.times_s), len(robot.world.actuators) or 1)
            assert motion.times_s[0] == 0.0
            assert np.all(np.diff(motion.times_s) > 0)
            np.testing.assert_array_equal(motion.observe_s, motions[0].observe_s)

    def test_its_fitness_of_many_trajectories_is_that_of_each(self, name: Any) -> None:
        robot = robots[name]()
        observe_s = robot.motion(robot.known).observe_s
        positions_m = np.random.default_rng(0).normal(size=(4, 5, len(observe_s), 3))
        upright = np.broadcast_to([0.0, 0, 0, 1], (*positions_m.shape[:3], 4))

        together = robot.fitness(Trajectory(observe_s, positions_m, upright))

        one_by_one = [
            [float(robot.fitness(Trajectory(observe_s, each, upright[0, 0]))) for each in row] for row in positions_m
        ]
        np.testing.assert_allclose(together, one_by_one)

    def test_a_failed_trajectory_has_no_fitness(self, name: Any) -> None:
        robot = robots[name]()
        observe_s = robot.motion(robot.known).observe_s
        nothing = Trajectory(observe_s, np.full((len(observe_s), 3), np.nan), np.full((len(observe_s), 4), np.nan))

        assert np.isnan(robot.fitness(nothing))

    def test_its_reality_is_the_papers(self, name: Any) -> None:
        material = robots[name]().world.material

        assert (material.static_friction, material.dynamic_friction, material.restitution) == (1.0, 0.8, 0.0)
