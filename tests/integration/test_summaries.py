"""What lists and heads say of experiments and studies: their fitness, and what their states leave out."""

from dataclasses import replace
from typing import Any

import pytest
from fastapi.testclient import TestClient

from gaplab.api.app import create_app
from gaplab.schemas.access import Role
from gaplab.schemas.lifecycle import State, Verb
from gaplab.schemas.spec import StudySpec
from gaplab.services.access import create_token
from gaplab.services.core.types import Probed
from gaplab.services.experiments import lifecycle, listing, reading, submission
from gaplab.services.results import curves
from gaplab.services.running import execution
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.lease import Claim, Failure
from gaplab.services.store.session import Store
from tests.experiments import cancel, listed, run, some_log, submit_one, toy

SHARED = {"robot": "toy_function", "iterations": 2, "budget": "smoke", "tunables": ["static_friction", "restitution"]}


def study(store: Store, *strategies: str, repetitions: int = 1) -> Any:
    spec = StudySpec.model_validate(SHARED | {"strategies": strategies, "repetitions": repetitions})
    return submission.submit(store, spec)


def claims(store: Store, limit: int = 20) -> dict[str, list[Claim]]:
    """Claim repetitions, by experiment."""
    found: dict[str, list[Claim]] = {}
    for claim in execution.claim(store, "test", limit=limit):
        found.setdefault(claim.experiment_id, []).append(claim)
    return found


def record(store: Store, claim: Claim, *fitnesses: float, complete: bool = True) -> None:
    """Record a repetition with these fitnesses after 0, 1, … real-world evaluations."""
    for step in some_log(iterations=len(fitnesses) - 1):
        recorded = replace(step, recorded=fitnesses[step.iteration]) if isinstance(step, Probed) else step
        assert execution.record(store, claim, recorded, seconds=0.5)
    if complete:
        assert execution.complete(store, claim)


@pytest.mark.dialects
def test_the_fitness_is_a_point_of_the_curve_and_not_the_mean_of_maxima(store: Store) -> None:
    made = submit_one(store, toy(repetitions=2)).id
    assert reading.read_experiment(store, made).fitness is None
    first, second = claims(store)[made]

    record(store, first, 0.9, 0.1, 0.3)
    record(store, second, 0.2, 0.8, 0.4)

    read = reading.read_experiment(store, made)
    point = curves.curve(store, made).points[2]
    assert read.fitness
    assert (read.fitness.evaluations, read.fitness.n) == (2, 2)
    assert (read.fitness.mean, read.fitness.sd) == (point.mean, point.sd)
    assert read.best_fitness == pytest.approx(0.85)
    assert listed(store)[0].fitness == read.fitness


def test_while_it_runs_the_fitness_is_after_the_last_number_that_all_begun_have_reached(store: Store) -> None:
    made = submit_one(store, toy(repetitions=3)).id
    first, second, _ = claims(store)[made]

    record(store, first, 0.5, 0.6, 0.7, complete=False)
    record(store, second, 0.1, 0.2, complete=False)
    both = reading.read_experiment(store, made).fitness
    assert execution.complete(store, first)
    completed = reading.read_experiment(store, made).fitness

    assert both
    assert (both.evaluations, both.n, both.mean) == (1, 2, pytest.approx(0.4))
    assert completed
    assert (completed.evaluations, completed.n, completed.mean) == (2, 1, 0.7)


def test_a_repetition_that_was_stopped_does_not_take_the_fitness_back_to_where_it_stopped(store: Store) -> None:
    made = submit_one(store, toy(repetitions=2)).id
    first, second = claims(store)[made]
    record(store, first, 0.5, 0.6, 0.7)
    record(store, second, 0.1, complete=False)

    lifecycle.ask(store, made, Verb.STOP)
    execution.release(store, second, "killed")
    read = reading.read_experiment(store, made)

    assert (read.state, read.caveat and read.caveat[:13]) == (State.COMPLETED, "stopped early")
    assert read.fitness
    assert (read.fitness.evaluations, read.fitness.n, read.fitness.mean) == (2, 1, 0.7)


def test_the_fitness_of_repetitions_that_were_all_stopped_is_after_the_last_number_they_share(store: Store) -> None:
    made = submit_one(store, toy(repetitions=2)).id
    first, second = claims(store)[made]
    record(store, first, 0.5, 0.6, complete=False)
    record(store, second, 0.1, complete=False)

    lifecycle.ask(store, made, Verb.STOP)
    for claim in (first, second):
        execution.release(store, claim, "killed")
    read = reading.read_experiment(store, made)

    assert read.state is State.COMPLETED
    assert read.fitness
    assert (read.fitness.evaluations, read.fitness.n, read.fitness.mean) == (0, 2, pytest.approx(0.3))


@pytest.mark.dialects
def test_the_best_of_a_study_is_the_highest_curve_at_the_last_shared_number_without_the_baseline(store: Store) -> None:
    made = study(store, "simulated_fit", "random", "known_fit", "direct")
    assert made.best is None
    fit, random, known, direct = (each.id for each in made.experiments)
    found = claims(store)
    record(store, found[fit][0], 0.1, 0.5, 0.4)
    record(store, found[random][0], 0.9, 0.3, 0.35)  # has the highest maximum
    record(store, found[known][0], 0.9, 0.9, complete=False)
    record(store, found[direct][0], 2.0)

    running = reading.read(store, made.id).best
    cancel(store, known)
    ended = reading.read(store, made.id).best

    assert running
    assert (running.name, running.evaluations, running.mean) == ("known_fit", 1, 0.9)
    assert ended
    assert (ended.name, ended.experiment, ended.evaluations, ended.mean) == ("simulated_fit", fit, 2, 0.4)
    assert listing.list_studies(store).items[0].best == ended


def test_the_best_of_a_study_is_one_of_those_with_the_most_repetitions(store: Store) -> None:
    made = study(store, "simulated_fit", "random", repetitions=2)
    fit, random = (each.id for each in made.experiments)
    found = claims(store)
    for number in range(2):
        record(store, found[fit][number], 0.1, 0.5, 0.4)
    record(store, found[random][0], 0.9, 0.9, 0.9)
    cancel(store, random)

    best = reading.read(store, made.id).best

    assert best
    assert (best.name, best.n) == ("simulated_fit", 2)


def test_the_baseline_alone_is_the_best_of_its_study(store: Store) -> None:
    made = study(store, "direct")
    record(store, claims(store)[made.experiments[0].id][0], 2.0)

    best = reading.read(store, made.id).best

    assert best
    assert (best.name, best.evaluations, best.mean) == ("direct", 0, 2.0)


def test_an_experiment_that_was_stopped_says_so_and_how_much_is_done(store: Store) -> None:
    made = submit_one(store, toy(repetitions=2)).id
    first, second = claims(store)[made]
    run(store, first)
    record(store, second, 0.5, complete=False)

    lifecycle.ask(store, made, Verb.STOP)
    execution.release(store, second, "killed")
    read = reading.read_experiment(store, made)

    progress = read.progress
    done = 100 * (progress.rollouts_done + progress.rollouts_saved) // progress.rollouts
    assert (read.state, read.caveat) == (State.COMPLETED, f"stopped early, {done} % done")
    assert (progress.counted_iterations_done, progress.counted_iterations) == (2, 4)


def test_a_study_says_what_became_of_its_experiments(store: Store) -> None:
    made = study(store, "simulated_fit", "random", "known_fit")
    fit, random, known = (each.id for each in made.experiments)
    found = claims(store)
    run(store, found[fit][0])
    execution.fail(store, found[random][0], Failure("it broke"))
    going_on = reading.read(store, made.id)
    cancel(store, known)
    ended = reading.read(store, made.id)

    assert (going_on.state, going_on.caveat) == (State.RUNNING, "1 of 3 experiments failed")
    assert ended.state is State.COMPLETED
    assert ended.caveat
    assert ended.caveat.startswith("1 of 3 experiments failed, 1 cancelled; ")
    assert reading.read_experiment(store, fit).caveat is None
    assert reading.read(store, random).caveat is None


def test_equal_strategies_of_a_study_get_numbers_and_others_keep_their_names() -> None:
    weighted = {"name": "simulated_fit_and_informative", "options": {"informative_weight": 0.25}}
    strategies = ["random", weighted, "simulated_fit_and_informative", "random"]
    names = [each.name for each in resolve(StudySpec.model_validate(SHARED | {"strategies": strategies}))]

    assert names == [
        "random (1)",
        "simulated_fit_and_informative (informative_weight 0.25)",
        "simulated_fit_and_informative",
        "random (2)",
    ]


def test_a_browser_that_is_lost_gets_a_page_with_a_way_home_and_a_program_a_problem(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store), base_url="http://127.0.0.1:8000")

    for path in ("/nowhere", "/studies/none/spec", "/experiments/<b>x"):
        shown = api.get(path, headers={"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"})
        told = api.get(path)

        assert shown.status_code == told.status_code == 404
        assert shown.headers["content-type"].startswith("text/html")
        assert '<a href="/">To the experiments</a>' in shown.text
        assert "<b>" not in shown.text
        assert told.headers["content-type"] == "application/problem+json"


def test_an_address_of_the_api_leads_a_browser_to_the_page_and_is_json_for_all_others(sqlite_store: Store) -> None:
    api = TestClient(create_app(sqlite_store), base_url="http://127.0.0.1:8000", follow_redirects=False)
    study = submit_one(sqlite_store, toy()).id
    browser = {"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"}

    views = {f"/studies/{study}": f"../#/studies/{study}", f"/experiments/{study}": f"../#/experiments/{study}"}
    for path, view in (views | {"/studies": "./#/"}).items():
        led, plain = api.get(path, headers=browser), api.get(path, headers={"Accept": "application/json, text/html"})

        assert (led.status_code, led.headers["location"]) == (303, view)
        assert plain.json() == api.get(path).json()
        assert all("Accept" in answer.headers["vary"].split(", ") for answer in (led, plain))
    create_token(sqlite_store, Role.READER)
    assert api.get(f"/studies/{study}", headers=browser).status_code == 303
    assert api.get(f"/studies/{study}").status_code == 401
