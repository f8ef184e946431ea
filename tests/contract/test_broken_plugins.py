"""Plug-ins that break the contract are told so, with the reason."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.services.contract.checks import CHECKS, check_file, results
from gaplab.services.core.arrays import frozen
from gaplab.services.core.discrepancies.fitness import SquaredFitness
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.strategies.paper import Random
from gaplab.services.core.tuners.base import TuningTask
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.specs.registries import REGISTRIES
from gaplab.services.world.motions import Motion
from gaplab.services.world.robots.toy_function import ToyFunction
from gaplab.services.world.sensing import Sensors
from gaplab.services.world.tasks.base import Task


def reasons(kind: str, plugin: type[Any]) -> str:
    """Return the reasons of all checks that a plug-in fails, one a line."""
    return "\n".join(result.reason for result in results(kind, plugin) if result.reason)


class Decaying(SteadyState):
    """An optimizer whose steps shrink from search to search."""

    step = 1.0

    def ask(self, state: Any, rng: Any) -> Any:
        self.step *= 0.999
        genomes = super().ask(state, rng)
        return genomes if self.step > 0.95 else state.space.contain(genomes * self.step)


class Proud(SearchTuner):
    """A tuner that returns the best simulator that it ever found."""

    _best: Any = None

    def tune(self, task: TuningTask, rng: Any) -> Any:
        first, *others = super().tune(task, rng)
        if self._best is None or first.squared_error < self._best.squared_error:
            self._best = first
        return (self._best, *others)


class Tried(Strategy):
    """A strategy that remembers what it has tried."""

    def __init__(self, options: Any = None) -> None:
        super().__init__(options)
        self._tried: list[Any] = []

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        def score(genomes: Any, fitnesses: Any) -> Any:
            tried = [np.all(genomes == each, axis=1) for each in self._tried]
            return np.where(np.any(tried, axis=0), -np.inf, fitnesses[:, 0]) if tried else fitnesses[:, 0]

        self._tried.append(search(score))
        return self._tried[-1]


class HalfDrawn(Strategy):
    """A strategy whose scores are noisy once it has samples."""

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        noise = 0.1 * np.random.normal() if belief.samples else 0.0  # noqa: NPY002 - the mistake
        return search(lambda genomes, fitnesses: fitnesses[:, 0] + noise * genomes[:, 0])


class DrawnTransfer(Random):
    """A strategy whose transfer is drawn without the stream."""

    def transfer(self, belief: Any, search: Any, rng: Any) -> Any:
        return np.random.random(2)  # noqa: NPY002 - the mistake


class EverySecond(Strategy):
    """A strategy that learns from every second sample, by counting its calls."""

    asked = 0

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        return search(lambda _, fitnesses: fitnesses[:, 0])

    def lessons(self, samples: Any) -> Any:
        self.asked += 1
        return samples if self.asked % 2 == 0 else ()


class Counting(SquaredFitness):
    """A discrepancy that grows with each call."""

    calls = 0

    def terms(self, simulated: Any, measured: Any, times_s: Any) -> Any:
        self.calls += 1
        return self.calls * super().terms(simulated, measured, times_s)

    def residuals(self, simulated: Any, measured: Any, times_s: Any) -> Any:
        return super().residuals(simulated, measured, times_s)


@pytest.mark.parametrize(
    ("kind", "plugin", "why"),
    [
        ("optimizer", Decaying, "differs when it is asked again: use only `rng`, and keep nothing but the population"),
        ("tuner", Proud, "differs when it is asked again: use only `rng`, and keep nothing but `task.previous`"),
        ("strategy", Tried, "differs when it is asked again: use only `rng`, and keep nothing but the belief"),
        ("strategy", HalfDrawn, "what it selects with samples differs when it is asked again"),
        ("strategy", DrawnTransfer, "what it transfers without samples differs when it is asked again"),
        ("strategy", EverySecond, "asked again, it learns from others"),
        ("discrepancy", Counting, "a term of outcomes 7 differs when it is asked again"),
    ],
)
def test_a_plug_in_that_keeps_something_from_call_to_call_is_told(kind: str, plugin: type[Any], why: str) -> None:
    assert why in reasons(kind, plugin)


class Sorting(Strategy):
    """A strategy that sorts the genome of a sample in place."""

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        for sample in belief.samples:
            sample.genome.sort()
        return search(lambda _, fitnesses: fitnesses[:, 0])


class Halving(Strategy):
    """A strategy that halves the known genome in place."""

    def select(self, belief: Any, search: Any, rng: Any) -> Any:
        belief.known[0] /= 2
        return search(lambda _, fitnesses: fitnesses[:, 0])


class Dividing(SquaredFitness):
    """A discrepancy that divides the outcomes in place."""

    def terms(self, simulated: Any, measured: Any, times_s: Any) -> Any:
        simulated /= 2.0
        return super().terms(simulated, measured, times_s)


class Centred(ToyFunction):
    """A robot whose fitness moves the trajectory in place."""

    def fitness(self, trajectory: Any) -> Any:
        trajectory.positions_m[...] -= trajectory.positions_m[..., :1, :]
        return super().fitness(trajectory)


@pytest.mark.parametrize(
    ("kind", "plugin"),
    [("strategy", Sorting), ("strategy", Halving), ("discrepancy", Dividing), ("robot", Centred)],
)
def test_a_plug_in_that_changes_its_arguments_is_told_the_line(kind: str, plugin: type[Any]) -> None:
    found = reasons(kind, plugin)

    assert "read-only (test_broken_plugins.py, line " in found
    assert "it changes an array that it was given; change a copy" in found


def moving(change: Any) -> type[ToyFunction]:
    """Return a robot whose targets are changed by a function of the robot and the genome."""

    class Moving(ToyFunction):
        calls = 0

        def motion(self, genome: Any) -> Motion:
            self.calls += 1
            motion = super().motion(genome)
            return Motion(motion.times_s, motion.targets + change(self, genome), motion.observe_s)

    return Moving


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda *_: np.random.random(), "the motion of a genome differs when it is asked again"),  # noqa: NPY002
        (lambda robot, _: robot.calls, "the motion of another genome differs when it is asked again"),
        (lambda *_: np.nan, "targets are not finite"),
        (lambda _, genome: np.divide(0.0, genome[0]), "targets are not finite"),  # at its lower bound alone
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_a_robot_whose_motions_are_not_repeated_or_finite_is_told(change: Any, why: str) -> None:
    assert why in reasons("robot", moving(change))


HEIGHT = {"names": ("height",), "units": ("m",), "noises": frozen([0.01]), "times_s": frozen([0.5, 1.0])}


def sensing(sense: Any = lambda seen: seen.positions_m[..., 2:], **changes: Any) -> type[ToyFunction]:
    """Return a robot with a sensor of height, some of whose attributes are changed."""

    class Sensing(ToyFunction):
        sensors = Sensors(**{**HEIGHT, **changes})

        def sense(self, trajectory: Any) -> Any:
            return sense(trajectory)

    return Sensing


class Senseless(ToyFunction):
    """A robot with a sensor that nothing reads."""

    sensors = Sensors(**HEIGHT)  # type: ignore[arg-type]


READ = [
    ({"sense": lambda seen: seen.positions_m[..., 2]}, "its readings have the shape (4, 5, 2), not (4, 5, 2, 1)"),
    ({"noises": frozen([0.0])}, "noises must be above 0, and are [0.0]"),
    ({"times_s": frozen([0.5, 1.5])}, "its sensors are read at [0.5, 1.5], but a rollout ends at 1.0 s"),
    ({"times_s": frozen([1.0, 0.5])}, "sensors.times_s does not ascend: [1.0, 0.5]"),
    ({"times_s": np.array([0, 1])}, "sensors.times_s is an array of int64; it must be an array of float64, in seconds"),
]


@pytest.mark.parametrize(("changes", "why"), READ)
def test_a_robot_whose_sensors_cannot_be_read_is_told(changes: Any, why: str) -> None:
    assert why in reasons("robot", sensing(**changes))


def test_a_robot_with_sensors_needs_a_sense_and_no_more() -> None:
    assert not any(why in reasons("robot", sensing()) for why in ("sense", "readings", "noises"))
    assert "it has sensors, but no `sense` that reads them" in reasons("robot", Senseless)


class Rising(Task):
    """The height of the base at the end."""

    name = "rising"
    unit = "m"
    observe_s: Any = frozen([0.0, 2.0])

    def fitness(self, trajectory: Any) -> Any:
        return np.asarray(trajectory.positions_m[..., -1, 2])


class Blind(Rising):
    """A task with a sensor that nothing reads."""

    sensors = Sensors(**HEIGHT)  # type: ignore[arg-type]


def test_a_task_with_sensors_needs_a_sense() -> None:
    assert reasons("task", Rising) == ""
    assert "it has sensors, but no `sense` that reads them" in reasons("task", Blind)


@pytest.mark.parametrize(
    ("times_s", "why"),
    [
        (np.array([0, 2]), "observe_s is an array of int64; it must be an array of float64, in seconds, such as "),
        ([0.0, 2.0], "observe_s is a list; it must be an array of float64, in seconds, such as "),
        (np.array([0.0, np.nan]), "observe_s is not finite"),
        (np.array([-1.0, 2.0]), "observe_s begins at -1.0 s, before the rollout"),
        (np.array([[0.0, 2.0]]), "observe_s has the shape (1, 2)"),
        (np.empty(0), "observe_s is empty"),
        (np.array([0.0]), "observe_s ends at 0.0"),
    ],
)
def test_times_that_are_no_ascending_floats_are_told(times_s: Any, why: str) -> None:
    class Timed(Rising):
        """A task of other times."""

        observe_s = times_s

    class Moved(ToyFunction):
        """A robot of other times."""

        _end = times_s

    assert why in reasons("task", Timed)
    assert why in reasons("robot", Moved)


class WorstFirst(SearchTuner):
    """A tuner that returns its simulators in the wrong order."""

    def tune(self, task: TuningTask, rng: Any) -> Any:
        return tuple(reversed(super().tune(task, rng)))


def test_a_tuner_that_returns_its_worst_first_is_told() -> None:
    assert "of seven simulators the first has the discrepancy" in reasons("tuner", WorstFirst)


class Listing(SearchTuner):
    """A tuner that returns lists."""

    def tune(self, task: TuningTask, rng: Any) -> Any:
        return [replace(each, parameters=each.parameters.tolist()) for each in super().tune(task, rng)]


def test_a_tuner_may_return_lists() -> None:
    assert reasons("tuner", Listing) == ""


LUNAR = '''
from dataclasses import replace

from gaplab.plugins import Motion, Robot, Space, Tunable, World, frozen


class Lunar(Robot):
    """A robot that stands on the moon."""

    name = "lunar"
    engine = "analytic"
    unit = "m"
    world = World(gravity_m_s2=1.62)
    space = Space.box([0.0], [1.0])
    known = frozen([0.5])

    def motion(self, genome):
        return Motion(frozen([0.0]), frozen([genome]), frozen([0.0, 1.0]))

    def fitness(self, trajectory):
        return trajectory.positions_m[..., -1, 0]


class Pull(Tunable):
    """The gravity of the moon, in which only one robot stands."""

    name = "pull"
    field = "gravity_m_s2"
    unit = "m/s²"
    lower, upper = 1.0, 2.0
    least, greatest = 0.0, 100.0

    def lack(self, world):
        return None if world.gravity_m_s2 == {gravity} else ("it is not on the moon", ())

    def read(self, world):
        return world.gravity_m_s2

    def edit(self, world, value):
        return replace(world, gravity_m_s2=float(value))
'''


@pytest.mark.usefixtures("plug_ins")
@pytest.mark.parametrize(("gravity", "why"), [(1.62, None), (3.73, "neither an arm nor {} has what it edits: ")])
def test_a_tunable_passes_if_one_robot_has_what_it_edits(tmp_path: Path, gravity: float, why: str | None) -> None:
    (tmp_path / "moon.py").write_text(LUNAR.format(gravity=gravity))

    found = {each.kind: each for each in check_file(tmp_path / "moon.py")}

    known = "lunar, quadruped, robot_file, toy_function"
    told = why and f"{why.format(known)}it is not on the moon"
    assert {result.reason for result in found["tunable"].results if result.reason} == ({told} if told else set())


ASSERTING = '''
from gaplab.plugins import Strategy


class Asserting(Strategy):
    """A strategy with an assertion of its own."""

    name = "asserting"

    def select(self, belief, search, rng):
        assert belief.samples, "nothing to learn from"
        return belief.known
'''


@pytest.mark.usefixtures("plug_ins")
def test_an_assertion_of_the_plug_in_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "asserting.py").write_text(ASSERTING)

    (found,) = check_file(tmp_path / "asserting.py")

    told = "AssertionError: nothing to learn from (asserting.py, line 11)"
    assert told in {result.reason for result in found.results}


@pytest.mark.parametrize("kind", ["strategy", "controller", "task", "tunable", "discrepancy", "tuner"])
def test_a_docstring_of_the_base_class_is_not_ones_own(kind: str) -> None:
    plugin = next(iter(REGISTRIES[kind].values()))
    undocumented = type("Undocumented", (plugin,), {"name": "undocumented"})
    (check,) = [each for each in CHECKS[kind] if each.__name__ == "is_described"]

    check(plugin)
    with pytest.raises(AssertionError, match="it has no docstring of its own"):
        check(undocumented)
