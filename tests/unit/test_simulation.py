"""What a robot says of a trajectory, and what is made of it."""

import gc
import weakref
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.answers import Answers
from gaplab.services.core.arrays import frozen
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.engines import engines
from gaplab.services.engines.analytic import Analytic
from gaplab.services.specs.assembly import WARM_ENGINES, MeasuredReality, edits_of, engine_of, setting, simulated
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.simulation import Simulation, _disturbed
from gaplab.services.world.motions import Motion, open_loop
from gaplab.services.world.robots.base import Sensors
from gaplab.services.world.robots.quadruped import Quadruped
from gaplab.services.world.robots.toy_function import ToyFunction
from gaplab.services.world.tunables.base import Tunable
from tests.experiments import toy
from tests.fakes import install


class Endless(ToyFunction):
    """A robot whose fitness is not a number on the right of its space."""

    name = "endless"

    def __init__(self, worth: Any) -> None:
        super().__init__()
        self.worth = worth

    def fitness(self, trajectory: Any) -> Any:
        travelled = super().fitness(trajectory)
        return np.where(travelled > 0.3, self.worth, travelled)


@pytest.mark.parametrize("worth", [np.inf, -np.inf, np.nan])
def test_a_fitness_that_is_not_finite_is_physics_that_failed_in_simulation_and_in_reality(worth: Any) -> None:
    whole, broken = (Simulation(robot, Analytic(), ()) for robot in (ToyFunction(), Endless(worth)))
    genomes, parameters = np.linspace(0.0, 1.0, 50)[:, None], np.empty((1, 0))
    answers = Answers(broken)

    fitnesses, expected = answers(genomes, parameters), whole(genomes, parameters)

    failed = expected > 0.3
    assert failed.any()
    assert not failed.all()
    np.testing.assert_array_equal(fitnesses, np.where(failed, np.nan, expected))
    assert answers.cost.failures == failed.sum()
    assert np.isnan(MeasuredReality(broken, np.empty(0))(genomes[failed[:, 0]][0]).fitness)


def test_the_worlds_of_a_simulation_end_with_it_without_the_help_of_the_collector() -> None:
    simulation = Simulation(ToyFunction(), Analytic(), edits_of(["static_friction"]))
    world = weakref.ref(simulation.world(np.array([0.5])))
    assert world() is not None

    gc.disable()
    try:
        del simulation
        assert world() is None
    finally:
        gc.enable()


def test_a_process_keeps_few_engines() -> None:
    importing, *refs = (PluginRef(name="mujoco", options={"threads": 1 + number}) for number in range(WARM_ENGINES + 2))
    engine_of(importing)  # MuJoCo keeps the frames of its first import
    first = weakref.ref(engine_of(refs[0]))

    for ref in refs[1:]:
        engine_of(ref)

    gc.collect()
    assert first() is None


class Whole(ToyFunction):
    """A robot whose times are whole numbers, and that senses its place at other whole numbers."""

    name = "whole"
    sensors = Sensors(("x",), ("m",), frozen([0.5]), np.array([1]))

    def motion(self, genome: Any) -> Any:
        return replace(super().motion(genome), observe_s=np.array([0, 1]))

    def fitness(self, trajectory: Any) -> Any:
        return super().fitness(trajectory).astype(np.float32)

    def sense(self, trajectory: Any) -> Any:
        return trajectory.positions_m[..., :, :1]


def test_times_may_be_whole_numbers_and_fitness_is_of_double_precision() -> None:
    usual, whole = (Simulation(robot, Analytic(), ()) for robot in (ToyFunction(), Whole()))
    genomes, parameters = np.linspace(0.0, 1.0, 5)[:, None], np.empty((1, 0))

    expected = usual(genomes, parameters).astype(np.float32)
    outcomes = whole.sense(genomes, parameters)

    assert whole(genomes, parameters).dtype == outcomes.dtype == np.float64
    np.testing.assert_array_equal(whole(genomes, parameters), expected)
    np.testing.assert_array_equal(outcomes[..., 0], expected)
    np.testing.assert_allclose(outcomes[..., 1], 2.0 * expected, rtol=1e-6)


class Encoded(ToyFunction):
    """A robot with two encoders, of which one stays at 0.25 rad."""

    name = "encoded"
    sensors = Sensors(("speed a", "angle a"), ("rad/s", "rad"), frozen([0.5, 0.1]), frozen([0.5, 1.0]))

    def sense(self, trajectory: Any) -> Any:
        return np.broadcast_to([0.0, 0.25], (*trajectory.positions_m.shape[:-2], 2, 2))


def test_biases_are_added_to_what_their_sensors_read_in_their_world_alone() -> None:
    class Biased(Tunable):
        name, field, unit, lower, upper, least, greatest = "biased", "biases", "rad", -1.0, 1.0, -1.0, 1.0

        def read(self, world: Any) -> float:
            return dict(world.biases).get("angle a", 0.0)

        def edit(self, world: Any, value: float) -> Any:
            return world.edited(self.field, biases=(("angle a", value), ("angle of nothing", 7.0)) if value else ())

    simulation = Simulation(Encoded(), Analytic(), [Biased()])
    outcomes = simulation.sense(np.array([[0.2], [0.4]]), np.array([[0.0], [0.05], [-0.1]]))

    by_sensor = Encoded.sensors.values(outcomes[..., 1:])
    np.testing.assert_array_equal(by_sensor[..., 0], 0.0)
    np.testing.assert_allclose(by_sensor[..., 1], np.broadcast_to([[[0.25], [0.3], [0.15]]], (2, 3, 2)))
    assert len({tuple(row) for row in outcomes[..., 0].T}) == 1


def started(offset_s: float, *targets: float) -> Any:
    """What an engine gets of a motion whose targets change each 0.1 s, on a world whose clock differs."""
    world = replace(Quadruped().world, time_offset_s=offset_s)
    motion = Motion(frozen(np.arange(len(targets)) / 10), frozen(np.tile(targets, (12, 1)).T), frozen([1.0]))
    late = open_loop(*_disturbed(world, [motion], np.zeros((1, 1))))
    return [round(time_s, 9) for time_s in late.times_s.tolist()], late.targets[:, 0].tolist()


def test_commands_begin_as_much_later_as_the_world_says_in_whole_time_steps() -> None:
    assert started(0.0, 0.3, 0.5, 0.7) == ([0.0, 0.1, 0.2], [0.3, 0.5, 0.7])
    assert started(0.034, 0.3, 0.5, 0.7) == ([0.0, 0.03, 0.13, 0.23], [0.0, 0.3, 0.5, 0.7])
    assert started(0.004, 0.3, 0.5) == started(-0.004, 0.3, 0.5) == started(0.0, 0.3, 0.5)


def test_of_commands_from_before_the_sensors_clock_the_last_one_holds() -> None:
    assert started(-0.1, 0.3, 0.5, 0.7) == ([0.0, 0.1], [0.5, 0.7])
    assert started(-0.13, 0.3, 0.5, 0.7) == ([0.0, 0.07], [0.5, 0.7])
    assert started(-5.0, 0.3, 0.5, 0.7) == ([0.0], [0.7])


class Arm(Analytic):
    """Hardware whose driver opens its port when it is created."""

    name = "arm"
    repeatable = False

    def __init__(self, options: Any = None) -> None:
        super().__init__(options)
        raise ConnectionError("the port is opened")


def test_a_process_that_only_simulates_opens_no_hardware(monkeypatch: pytest.MonkeyPatch) -> None:
    install(monkeypatch, engines, Arm)
    spec = resolve_experiment(toy(reality={"engine": "arm"}))

    simulate, _ = simulated(spec)

    assert np.isfinite(simulate(np.array([[0.2]]), np.full((1, len(spec.tunables)), 0.5))).all()
    with pytest.raises(InvalidSpec, match="the port is opened"):
        setting(spec, 0)


@pytest.mark.parametrize("strategy", ["random", "direct"])
def test_it_simulates_what_the_repetition_does(strategy: str) -> None:
    spec = resolve_experiment(toy(strategy=strategy))
    whole, rng = setting(spec, 0), np.random.default_rng(0)
    genomes, parameters = whole.genomes.draw(5, rng), whole.parameters.draw(4, rng)

    simulate, sense = simulated(spec)

    np.testing.assert_array_equal(simulate(genomes, parameters), whole.simulate(genomes, parameters))
    np.testing.assert_array_equal(sense(genomes, parameters), whole.sense(genomes, parameters))  # type: ignore[misc]
