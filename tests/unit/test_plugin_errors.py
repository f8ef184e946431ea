"""An external plug-in that raises while a spec is resolved: the spec is refused, with the plug-in and the line."""

from collections.abc import Callable
from pathlib import Path

import pytest

from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.core.strategies import strategies
from gaplab.services.core.strategies.paper import Random
from gaplab.services.specs.resolution import expected_rollouts, resolve, resolve_experiment
from tests.experiments import toy
from tests.fakes import CAREFUL, install

Put = Callable[..., Path]

HOPPER = '''
from gaplab.plugins import Body, Box, Joint, Motor, PluginRef, Robot, Sphere, World


class Hopper(Robot):
    """A trunk on one leg that swings."""

    name = "hopper"
    engine = "mujoco"
    usual_controller = PluginRef(name="square_pulses")
    usual_task = PluginRef(name="walk", options={"counted_s": 1.5})
    world = World(
        bodies=(Body("trunk", 1.0, Box((0.3, 0.2, 0.05))), Body("leg", 0.1, Sphere(0.03), center_m=(0.0, 0.0, -0.12))),
        joints=(Joint("hip", "trunk", "leg", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), Motor(0.1, 4.0), swing=0.4),),
        start_height_m=0.15,
    )
'''

PAIR = '''
from gaplab.services.world.controllers.pulses import SquarePulses


class Pair(SquarePulses):
    """Drives the first joint, and the third against it."""

    name = "pair"

    def prepare(self, world, observe_s):
        self._third = world.actuators[2]
'''

TAIL = '''
from gaplab.plugins import Tunable


class Tail(Tunable):
    """Largest torque of the tail."""

    name = "tail"
    field = "motor.max_torque_nm"
    unit = "N m"
    lower, upper = 0.5, 8.0
    least, greatest = 0.0, 100.0

    def read(self, world):
        return [joint for joint in world.joints if joint.name == "tail"][0].motor.max_torque_nm

    def edit(self, world, value):
        return world
'''


def refused(**spec: object) -> Violation:
    """Return the only violation of a spec of the hopper."""
    changes = {"robot": "hopper", "strategy": "random", "budget": "smoke", **spec}
    with pytest.raises(InvalidSpec) as raised:
        resolve_experiment(ExperimentSpec.model_validate(changes))
    (violation,) = raised.value.violations
    return violation


def test_a_controller_that_raises_in_prepare_is_named_with_its_line(put: Put) -> None:
    put(hopper=HOPPER, pair=PAIR)

    found = refused(controller="pair")

    said = "controller 'pair' raised IndexError (pair.py, line 11): tuple index out of range"
    assert found == Violation("", None, said)


def test_a_tunable_that_raises_in_read_is_named_with_its_line(put: Put) -> None:
    put(hopper=HOPPER, tail=TAIL)

    said = "tunable 'tail' raised IndexError (tail.py, line 15): list index out of range"
    assert refused(tunables=["dynamic_friction", "tail"]).message == said


def test_a_strategy_that_raises_while_rollouts_are_counted_is_named_with_its_line(put: Put) -> None:
    needed = "    def selection_simulators(self, tunables, learned):\n        return self.options.simulators\n"
    put(careful=f"{CAREFUL}\n{needed}")
    resolved = resolve_experiment(toy(strategy="careful"))

    with pytest.raises(
        InvalidSpec, match=r"strategy 'careful' raised AttributeError \(careful\.py, line 19\): 'NoOptions"
    ):
        expected_rollouts(resolved)


def test_a_study_tells_it_once(put: Put) -> None:
    put(hopper=HOPPER, pair=PAIR)
    spec = StudySpec.model_validate({"robot": "hopper", "controller": "pair", "budget": "smoke"})

    with pytest.raises(InvalidSpec) as raised:
        resolve(spec)

    assert len(raised.value.violations) == 1


def test_an_error_of_gaplab_itself_stays_an_error_of_the_service(monkeypatch: pytest.MonkeyPatch) -> None:
    class Wrong(Random):
        name = "wrong"

        @property
        def named_tunables(self) -> tuple[str, ...]:
            raise LookupError("a mistake of ours")

    install(monkeypatch, strategies, Wrong)

    with pytest.raises(LookupError, match="a mistake of ours"):
        resolve_experiment(toy(strategy="wrong"))
