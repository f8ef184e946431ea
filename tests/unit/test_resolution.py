"""From what a user wrote to what is run."""

from copy import deepcopy
from dataclasses import replace
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import AnySpec, ExperimentSpec, Schedule, StudySpec
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.strategies import strategies
from gaplab.services.engines import engines
from gaplab.services.specs.defaults import PRESETS
from gaplab.services.specs.resolution import expected_rollouts, resolve, resolve_experiment
from gaplab.services.specs.violations import engine_violations
from gaplab.services.world.motions import Start
from gaplab.services.world.robots.quadruped import Quadruped

EMBODIED = [name for name, engine in engines.items() if engine.runs(Quadruped().world)]


def experiment(**spec: Any) -> Any:
    return ExperimentSpec.model_validate({"strategy": "simulated_fit"} | spec)


def refused(**spec: Any) -> Any:
    with pytest.raises(InvalidSpec) as refusal:
        resolve_experiment(experiment(**spec))
    return {each.pointer: each for each in refusal.value.violations}


def test_every_default_is_the_papers() -> None:
    resolved = resolve_experiment(experiment())

    assert (resolved.iterations, resolved.repetitions) == (10, 40)
    numbers = resolved.budget.model_dump(exclude={"preset", "reuse_transfer"})
    assert numbers == {
        "controller_evaluations": 10_000,
        "selection_evaluations": 10_000,
        "simulator_evaluations": 2_000,
    }
    assert resolved.reality.parameters == {"static_friction": 1.0, "dynamic_friction": 0.8, "restitution": 0.0}
    engine = "pybullet" if engines["pybullet"].available() else "mujoco"
    assert (resolved.robot.name, resolved.engine.name, resolved.reality.engine.name) == ("quadruped", engine, engine)


def test_a_resolved_spec_has_nothing_left_out_and_resolves_to_itself() -> None:
    resolved = resolve_experiment(experiment(budget="desk", tunables=["restitution"]))

    settled = resolved.model_dump(exclude={*Schedule.model_fields, "controller", "task"})  # null: the robot's own
    assert None not in [*settled.values(), *dict(resolved.budget).values(), *dict(resolved.tunables[0]).values()]
    assert resolve_experiment(resolved) == resolved


def test_every_strategy_has_equal_searches_unless_asked_otherwise() -> None:
    for preset in PRESETS:
        assert not resolve_experiment(experiment(budget=preset)).budget.reuse_transfer
    assert resolve_experiment(experiment(budget={"preset": "desk", "reuse_transfer": True})).budget.reuse_transfer


def test_as_published_has_the_papers_numbers_and_its_plain_formulas() -> None:
    published = {each.strategy.name: each for each in resolve(StudySpec.model_validate({"budget": "as_published"}))}

    paper = resolve_experiment(experiment())
    assert {each.budget.selection_evaluations for each in published.values()} == {10_000}
    assert published["simulated_fit"] == paper.model_copy(
        update={"budget": paper.budget.model_copy(update={"preset": "as_published"})}
    )
    assert published["informative"].strategy.options["least_error"] == 0.0
    assert published["simulated_fit_and_informative"].strategy.options["least_error"] == 0.0
    assert published["simulated_fit_and_unique"].strategy.options == {"distances": "plain"}
    assert published["informative"].name == "informative"


def test_an_option_given_beats_the_published_one() -> None:
    strategy = {"name": "informative", "options": {"least_error": 0.1, "simulators": 5}}

    resolved = resolve_experiment(experiment(strategy=strategy, budget={"preset": "as_published"}))

    assert resolved.strategy.options == {"simulators": 5, "least_share": 0.03, "least_error": 0.1, "weightiest": None}


@pytest.mark.parametrize("name", sorted(strategies))
def test_presets_are_options(name: str) -> None:
    for options in strategies[name].presets.values():
        strategies[name].Options.model_validate(options)


@pytest.mark.parametrize("path", sorted(Path("examples").glob("*.json")), ids=lambda path: path.stem)
def test_example_specs_are_specs(path: Path) -> None:
    assert resolve(TypeAdapter(AnySpec).validate_json(path.read_text()))


def test_a_preset_of_a_strategy_sets_what_a_spec_leaves_out_and_is_in_the_name() -> None:
    named = {"name": "estimation_exploration", "preset": "bongard_2005", "options": {"models": 6}}

    resolved = resolve_experiment(experiment(strategy=named, tuner="climbers", engine="mujoco"))
    plain = resolve_experiment(experiment(strategy="estimation_exploration", engine="mujoco"))
    within = {"name": "informative", "preset": "as_published"}
    both = resolve_experiment(experiment(strategy=within, budget="lean"))

    assert resolved.strategy.preset is None
    assert (resolved.strategy.options["select"], resolved.strategy.options["models"]) == ("disagreement", 6)
    assert resolved.name == "estimation_exploration (bongard_2005, models 6)"
    assert plain.strategy.options["select"] == "fittest"
    assert (both.strategy.options["least_error"], both.strategy.options["weightiest"]) == (0.0, 10)
    assert refused(strategy=named | {"preset": "bongard"})["/strategy/preset"].permitted == ("bongard_2005",)


@pytest.mark.parametrize(("tuner", "least"), [("search", 20), ("gauss_newton", 2), ("abc_smc", 2), ("simopt", 11)])
def test_a_tuner_states_its_least_budget(tuner: str, least: int) -> None:
    def few(evaluations: int) -> ExperimentSpec:
        return experiment(tuner=tuner, budget={"preset": "smoke", "simulator_evaluations": evaluations})

    resolve_experiment(few(least))
    with pytest.raises(InvalidSpec) as refused:
        resolve_experiment(few(least - 1))

    (violation,) = refused.value.violations
    assert (violation.pointer, violation.permitted) == ("/budget/simulator_evaluations", f"at least {least}")


def test_a_stored_spec_lacks_no_field() -> None:
    stored = resolve_experiment(experiment()).model_dump(mode="json", exclude=set(Schedule.model_fields))
    parts: list[list[str]] = [[], ["reality"], ["budget"]]

    for path in parts:
        for field in reduce(getitem, path, stored):
            lacking = deepcopy(stored)
            del reduce(getitem, path, lacking)[field]
            with pytest.raises(ValidationError, match=field):
                ResolvedSpec.model_validate(lacking)


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_any_number_of_a_budget_can_be_given_instead(preset: Any) -> None:
    resolved = resolve_experiment(
        experiment(budget={"preset": preset, "simulator_evaluations": 777}, iterations=3, repetitions=5)
    )

    assert (resolved.iterations, resolved.repetitions, resolved.budget.simulator_evaluations) == (3, 5, 777)
    assert resolved.budget.controller_evaluations == PRESETS[preset].controller_evaluations


def test_the_papers_whole_figure_4_is_220_million_rollouts() -> None:
    strategies = [each for each in resolve(StudySpec()) if each.strategy.name != "direct"]

    total = sum(expected_rollouts(each) * each.repetitions for each in strategies)

    # section 2: searches of 10 000 and 2 000, times 20 simulators where they are weighed
    each_fit = 10 * 10_000 + 11 * 10_000 + 2_000 * 55
    assert total == 40 * (2 * each_fit + 2 * (each_fit + 19 * 100_000) + 2 * (each_fit - 100_000)) == 220_800_000


def test_the_toy_runs_on_its_own_engine_if_none_is_named() -> None:
    assert resolve_experiment(experiment(robot="toy_function")).engine.name == "analytic"


def test_the_baseline_of_a_study_may_have_more_repetitions() -> None:
    *_, direct = resolve(StudySpec(repetitions=4, direct_repetitions=10))

    assert (direct.strategy.name, direct.repetitions) == ("direct", 10)


def test_an_experiment_is_called_after_what_sets_it_apart() -> None:
    plain = resolve_experiment(experiment())
    weighted = experiment(strategy={"name": "simulated_fit_and_informative", "options": {"fit_weight": 2}})
    named = experiment(name="mine")

    assert plain.name == "simulated_fit"
    assert resolve_experiment(weighted).name == "simulated_fit_and_informative (fit_weight 2.0)"
    assert resolve_experiment(named).name == "mine"


def test_a_misspelt_name_is_refused_with_the_nearest_one() -> None:
    violation = refused(strategy="simulated_fti")["/strategy"]

    assert violation.nearest == "simulated_fit"
    assert "random" in violation.permitted


def test_everything_that_is_wrong_is_said_at_once() -> None:
    violations = refused(
        tunables=["frction", {"name": "restitution", "lower": 0.5, "upper": 0.1}],
        reality={"parameters": {"static_friction": -1, "weight": 1}},
        budget={"controller_evaluations": 3},
    )

    assert set(violations) == {
        "/tunables/0",
        "/tunables/1",
        "/reality/parameters/static_friction",
        "/reality/parameters/weight",
        "/budget/controller_evaluations",
    }


@pytest.mark.parametrize(
    ("spec", "pointer", "permitted"),
    [
        ({"engine": "analytic"}, "/engine", EMBODIED),
        ({"robot": "toy_function", "engine": "pybullet"}, "/engine", ["analytic"]),
        ({"reality": {"engine": "analytic"}}, "/reality/engine", EMBODIED),
        ({"tunables": [{"name": "restitution", "upper": 2}]}, "/tunables/0/upper", "0 to 0.9"),
        ({"tunables": ["restitution", "restitution"]}, "/tunables/1", None),
        ({"budget": {"simulator_evaluations": 19}}, "/budget/simulator_evaluations", "at least 20"),
        (
            {"optimizer": {"name": "steady_state", "options": {"population": 1}}},
            "/optimizer/options/population",
            "at least 2",
        ),
        ({"reality": {"kind": "physical", "noise": 0.1}}, "/reality/noise", "left out, or kind: simulated"),
        ({"reality": {"kind": "physical", "held_out": 0.5}}, "/reality/held_out", "left out, or kind: recorded"),
        ({"reality": {"pool": "nowhere"}}, "/reality/pool", "left out, or kind: recorded"),
        ({"reality": {"noise": 0.1, "noise_unit": 0.02}}, "/reality/noise", "left out, or without noise_unit"),
        ({"reality": {"noise": 0.1}, "strategy": "surrogate"}, "/reality/noise", "noise_unit, in the unit of fitness"),
        ({"strategy": {"name": "known_fit", "options": {"spred": 1}}}, "/strategy/options/spred", ("spread",)),
    ],
)
def test_what_cannot_be_run_is_refused_with_its_place_and_what_can(spec: Any, pointer: Any, permitted: Any) -> None:
    violations = refused(**spec)

    assert violations[pointer].permitted == permitted


def test_an_ensemble_larger_than_the_search_is_refused() -> None:
    strategy = {"name": "informative", "options": {"simulators": 300}}

    assert refused(strategy=strategy, budget="desk")["/budget/simulator_evaluations"].permitted == "at least 300"


def test_an_engine_that_is_not_installed_is_refused_with_its_install_line(monkeypatch: pytest.MonkeyPatch) -> None:
    from gaplab.services.engines import engines

    monkeypatch.setattr(engines["pybullet"], "library", "a_library_that_is_not_there")

    assert "pip install" in refused(engine="pybullet")["/engine"].message


def test_what_is_wrong_with_a_study_points_into_the_study() -> None:
    spec = StudySpec.model_validate({"strategies": ["random", "nonsense"], "engine": "analytic"})

    with pytest.raises(InvalidSpec) as refusal:
        resolve(spec)

    assert {each.pointer for each in refusal.value.violations} == {"/strategies/1", "/engine"}


def test_a_strategy_that_selects_by_readings_is_refused_for_a_robot_without_sensors() -> None:
    by_readings = {"name": "estimation_exploration", "options": {"select": "disagreement"}}

    violation = refused(strategy=by_readings, robot="toy_function")["/strategy"]

    assert violation.permitted == ["quadruped", "robot_file"]
    assert "toy_function has no sensors" in violation.message
    assert resolve_experiment(experiment(strategy=by_readings))
    assert resolve_experiment(experiment(strategy="estimation_exploration", robot="toy_function"))


def test_an_engine_that_tells_no_joints_or_sets_no_starts_is_refused_where_a_robot_needs_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = Quadruped()
    monkeypatch.setattr(robot, "joints", True)
    begun = replace(robot.motion(robot.known), start=Start(velocity_m_s=(1.0, 0.0, 0.0)))
    monkeypatch.setattr(robot, "motion", lambda _: begun)

    able = engines["pybullet"]
    plain = type("Plain", (able,), {"tells_joints": False, "sets_starts": False})

    joints, start = engine_violations(robot, {plain: "/engine"})

    assert not list(engine_violations(robot, {able: "/engine"}))
    assert "needs its joints, and pybullet tells nothing" in joints.message
    assert "says how it begins, and pybullet begins" in start.message
    assert "pybullet" in joints.permitted


def test_tunables_that_a_strategy_names_must_be_tuned_unless_they_are_its_default() -> None:
    envelope = {"name": "noise_envelope", "options": {"base": ["restitution", "gravity"]}}

    violations = refused(strategy=envelope, tunables=["static_friction", "restitution"])

    assert violations["/strategy/options"].value == "gravity"
    assert resolve_experiment(experiment(strategy="noise_envelope", tunables=["restitution"]))


def test_a_search_whose_evaluations_are_divided_must_still_fill_its_population() -> None:
    sharing = {"name": "domain_randomization", "options": {"equal_rollouts": True}}

    violation = refused(strategy=sharing, budget={"controller_evaluations": 399})["/budget/controller_evaluations"]

    assert violation.permitted == "at least 400"
    assert resolve_experiment(experiment(strategy=sharing, budget={"controller_evaluations": 400}))


@pytest.mark.parametrize(
    ("strategy", "options", "expected"),
    [
        ("domain_randomization", {}, 20 * 500),
        ("domain_randomization", {"equal_rollouts": True}, 500),
        ("noise_envelope", {"simulators": 3}, 3 * 500),
        ("estimation_exploration", {}, 6 * 500 + 5 * 150 + 15 * 200),
        ("estimation_exploration", {"select": "disagreement"}, 6 * 500 + 5 * 150 * 10 + 15 * 200),
        ("weighted", {"information_weight": 1}, 6 * 500 + 5 * 150 * 23 + 15 * 200),
    ],
)
def test_expected_rollouts_follow_from_how_many_simulators_an_evaluation_needs(
    strategy: Any, options: Any, expected: Any
) -> None:
    budget = {"controller_evaluations": 500, "selection_evaluations": 150, "simulator_evaluations": 200}

    resolved = resolve_experiment(
        experiment(strategy={"name": strategy, "options": options}, budget=budget, iterations=5)
    )

    assert expected_rollouts(resolved) == expected


def test_each_strategy_has_as_many_iterations_as_stay_within_a_cost() -> None:
    named = ["simulated_fit", "informative", "domain_randomization", "direct"]
    study = StudySpec.model_validate({"strategies": named, "robot": "toy_function", "budget": "desk", "iterations": 9})
    stop = {"x": "time", "at": 400.0, "cost_s": 30.0, "rollout_s": 0.02}
    whole = resolve(study)
    paid = resolve(StudySpec.model_validate(study.model_dump(exclude_unset=True) | {"stop": stop}))

    def seconds(spec: ResolvedSpec, iterations: int) -> float:
        return 30.0 * iterations + 0.02 * expected_rollouts(spec.model_copy(update={"iterations": iterations}))

    for before, after in zip(whole[:2], paid[:2], strict=True):
        assert 0 < after.iterations < 9
        assert seconds(before, after.iterations) <= 400.0 < seconds(before, after.iterations + 1)
        assert after == before.model_copy(update={"iterations": after.iterations})
    assert paid[2:] == whole[2:]


def test_a_cost_that_pays_for_nothing_is_refused() -> None:
    found = refused(robot="toy_function", budget="desk", stop={"x": "rollouts", "at": 100})
    assert (found["/stop/at"].value, found["/stop/at"].permitted) == (100.0, "at least 1350")
    with pytest.raises(ValidationError, match="rollout_s, the seconds of a rollout, is needed where cost"):
        experiment(stop={"at": 5, "cost_s": 60})
