"""The settings in which specs differ."""

from typing import Any

import pytest

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.specs.differences import SpecColumn, differences
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.specs.stored_specs import without_truth


def spec(**changes: Any) -> dict[str, Any]:
    base = {"strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke"}
    return resolve_experiment(ExperimentSpec.model_validate(base | changes)).model_dump(mode="json")


def column(*specs: dict[str, Any]) -> SpecColumn:
    return SpecColumn("id", "name", specs)


def told(*specs: dict[str, Any]) -> dict[str, tuple[str, tuple[Any, ...]]]:
    found = differences([column(each) for each in specs])
    return {each.setting: (each.pointer, each.values) for each in found.settings}


def test_only_settings_that_differ_are_told_in_words_with_their_pointers() -> None:
    budget = {"preset": "smoke", "simulator_evaluations": 77}

    found = told(spec(seed=1, name="one"), spec(seed=2, name="two", budget=budget, priority=3))

    assert found == {
        "simulator evaluations of the budget": ("/budget/simulator_evaluations", ((60,), (77,))),
        "seed": ("/seed", ((1,), (2,))),
    }


def test_specs_that_are_equal_have_no_difference() -> None:
    found = differences([column(spec()), column(spec(name="other"))])

    assert found.settings == ()
    assert found.equal > 10


def test_tunables_are_compared_by_name_and_a_missing_one_is_told_once() -> None:
    narrow = {"name": "dynamic_friction", "lower": 0.5}

    found = told(spec(tunables=["static_friction", "dynamic_friction"]), spec(tunables=[narrow]))

    assert found["lower bound of dynamic friction"] == ("/tunables/1/lower", ((0.0,), (0.5,)))
    assert found["tunables"][1] == ((["static_friction", "dynamic_friction"],), (["dynamic_friction"],))
    assert set(found) == {"tunables", "lower bound of dynamic friction"}


def test_an_option_that_only_one_plugin_has_follows_from_the_plugin() -> None:
    found = told(spec(), spec(strategy="random"), spec(strategy={"name": "simulated_fit_and_informative"}))

    assert set(found) == {"strategy"}


def test_an_option_differs_between_experiments_that_have_it_and_is_empty_elsewhere() -> None:
    several = {"name": "simulated_fit_and_informative", "options": {"simulators": 5}}

    found = told(spec(strategy="simulated_fit_and_informative"), spec(strategy=several), spec(strategy="random"))

    assert found["simulators of the strategy"][1] == ((20,), (5,), ())


def test_what_a_task_reads_differs_from_what_nobody_said() -> None:
    walk, reads = {"robot": "quadruped", "task": "walk"}, {"name": "walk", "options": {"sensors": ["angles"]}}

    found = told(spec(**walk), spec(**walk | {"task": reads}))

    assert found == {"sensors of the task": ("/task/options/sensors", ((), (["angles"],)))}
    assert told(spec(**walk), spec(robot="quadruped")) == {}


def test_hidden_parameters_of_reality_are_not_compared() -> None:
    secret = spec(reality={"parameters": {"static_friction": 0.9}})

    found = differences([column(without_truth(secret)), column(spec())])

    assert found.settings == ()
    assert "/reality/parameters/static_friction" in found.hidden


def test_the_columns_of_studies_have_the_values_of_all_their_experiments() -> None:
    first = column(spec(), spec(strategy="random"))
    second = column(spec(strategy="random"), spec(), spec(strategy="direct", iterations=None))

    (only,) = differences([first, second]).settings

    assert only.values == (("simulated_fit", "random"), ("random", "simulated_fit", "direct"))


def test_one_column_is_no_comparison() -> None:
    with pytest.raises(InvalidSpec, match="needs two"):
        differences([column(spec())])
