"""Noise by address: the same genome has the same draws in every simulator, and no noise costs nothing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.engines.analytic import Analytic
from gaplab.services.specs.assembly import edits_of
from gaplab.services.specs.robots import Driven, robot_of
from gaplab.services.specs.simulation import Simulation
from gaplab.services.world.motions import Loop, Trajectory, open_loop
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.robots.toy_function import ToyFunction
from gaplab.services.world.sensing import disturbed
from gaplab.services.world.world import Noise

ROBOT = Quadruped()
MOTION = open_loop(ROBOT.motion(ROBOT.known))
NOISY = replace(ROBOT.world, noise=Noise(target=0.1, angle_rad=0.01, tilt=0.2, latency_s=0.03))


def disturbed_targets(world: Any, genome: Any = ROBOT.known) -> Any:
    return open_loop(disturbed(world, MOTION, genome)).targets


def errors(world: Any, genome: Any = ROBOT.known) -> Any:
    return disturbed_targets(world, genome) - MOTION.targets


def looping(**options: Any) -> Any:
    return robot_of(Driven(PluginRef(name="quadruped"), PluginRef(name="mlp", options=options)))


def test_a_quiet_world_leaves_the_motion_as_it_is() -> None:
    motion = ROBOT.motion(ROBOT.known)

    assert disturbed(ROBOT.world, motion, ROBOT.known) is motion


def test_a_target_is_disturbed_when_it_changes_and_stays_so_until_it_changes_again() -> None:
    plain, noisy = MOTION, disturbed_targets(NOISY)

    changes = plain.targets[1:] != plain.targets[:-1]

    np.testing.assert_array_equal(noisy[1:] != noisy[:-1], changes)
    drawn = (noisy - plain.targets)[1:][changes]
    assert drawn.std() == pytest.approx(0.1, rel=0.2)
    assert abs(drawn.mean()) < 0.03


def test_the_same_genome_has_the_same_draws_scaled_by_each_worlds_noise() -> None:
    louder = replace(NOISY, noise=Noise(target=0.2))
    once, twice = (errors(world) for world in (NOISY, louder))

    np.testing.assert_allclose(twice, 2 * once, atol=1e-12)
    again = errors(NOISY, ROBOT.known.copy())
    np.testing.assert_array_equal(again, once)
    other = errors(NOISY, ROBOT.known + 1e-15)
    assert not np.isclose(other, once).any()


def test_a_loop_has_noise_of_observations_and_targets_and_latency() -> None:
    robot = looping(senses="angles, tilt, contacts")
    loop = disturbed(NOISY, robot.motion(robot.known), robot.known)
    assert isinstance(loop, Loop)

    assert loop.observation_noise.shape == (loop.ticks, 12 + 3 + 4)
    spreads = loop.observation_noise.std(axis=0)
    np.testing.assert_allclose(spreads, [0.01] * 12 + [0.2] * 3 + [0.0] * 4, rtol=0.3)
    assert loop.target_noise.shape == (loop.ticks, 12)
    assert loop.target_noise.std() == pytest.approx(0.1, rel=0.1)
    assert loop.latency_s == 0.03


def test_a_longer_rollout_has_the_same_noise_and_more_of_it() -> None:
    robot = looping()
    quiet = robot.motion(robot.known)
    longer: Any = disturbed(NOISY, quiet.observed_at(np.array([0.5, 4.0])), robot.known)
    short: Any = disturbed(NOISY, quiet, robot.known)

    np.testing.assert_array_equal(longer.observation_noise[: short.ticks], short.observation_noise)
    np.testing.assert_array_equal(longer.target_noise[: short.ticks], short.target_noise)


class Counting(Analytic):
    """The analytic engine; it remembers its calls."""

    name = "counting"

    def __init__(self) -> None:
        super().__init__()
        self.calls: list[tuple[Any, Any]] = []

    def rollouts(self, worlds: Any, motions: Any) -> Trajectory:
        self.calls.append((list(worlds), list(motions)))
        return super().rollouts(worlds, motions)


def test_simulators_of_one_noise_are_simulated_together_and_each_as_alone() -> None:
    engine = Counting()
    simulation = Simulation(ToyFunction(), engine, edits_of(["dynamic_friction", "noise"]))
    genomes = np.linspace(0.1, 0.9, 7)[:, None]
    simulators = np.array([[0.3, 0.0], [0.5, 0.05], [0.7, 0.0], [0.9, 0.05], [0.2, 0.1]])

    fitnesses = simulation(genomes, simulators)

    assert [len(worlds) for worlds, _ in engine.calls] == [2, 2, 1]
    alone = [[simulation(genome[None], row[None])[0, 0] for row in simulators] for genome in genomes]
    np.testing.assert_array_equal(fitnesses, alone)
    np.testing.assert_array_equal(simulation.sense(genomes, simulators)[..., 0], fitnesses)
    quiet = simulation(genomes, simulators * [1.0, 0.0])
    assert (quiet[:, [0, 2]] == fitnesses[:, [0, 2]]).all()
    assert (quiet[:, [1, 3, 4]] != fitnesses[:, [1, 3, 4]]).all()


def test_a_quiet_simulation_hands_the_motions_over_as_they_are() -> None:
    engine = Counting()
    robot = ToyFunction()
    handed: list[Any] = []
    robot.motion = lambda genome: handed.append(ToyFunction.motion(robot, genome)) or handed[-1]  # type: ignore[method-assign,func-returns-value]

    Simulation(robot, engine, ())(np.array([[0.2], [0.4]]), np.empty((1, 0)))

    assert [id(motion) for motion in engine.calls[0][1]] == [id(motion) for motion in handed]


def test_a_recording_has_the_noise_of_its_rollout() -> None:
    simulation = Simulation(ToyFunction(), Analytic(), edits_of(["noise"]))
    genome, noise = np.array([0.4]), np.array([0.1])

    _, recording = simulation.record(genome, noise, np.array([0.0, 0.5, 1.0]))

    fitness = float(ToyFunction().fitness(recording.trajectory))
    assert fitness == simulation(genome[None], noise[None])[0, 0]
    assert fitness != simulation(genome[None], np.zeros((1, 1)))[0, 0]


def test_the_start_is_tilted_by_the_genome_and_scaled_by_each_worlds_noise() -> None:
    little, much = (replace(ROBOT.world, noise=Noise(start_tilt_rad=deviation)) for deviation in (0.05, 0.1))
    genomes = ROBOT.space.draw(200, np.random.default_rng(1))

    tilts = np.array([disturbed(little, MOTION, genome).start_tilt_rad for genome in genomes])
    again = np.array([disturbed(much, MOTION, genome).start_tilt_rad for genome in genomes])

    assert tilts.std(axis=0) == pytest.approx(0.05, rel=0.2)
    np.testing.assert_allclose(again, 2 * tilts, rtol=1e-12)
    np.testing.assert_array_equal(open_loop(disturbed(little, MOTION, genomes[0])).targets, MOTION.targets)
    loop = looping()
    assert disturbed(little, loop.motion(loop.known), genomes[0]).start_tilt_rad == tuple(tilts[0])
    assert disturbed(little, MOTION, genomes[0]).observed_at(MOTION.observe_s).start_tilt_rad == tuple(tilts[0])
