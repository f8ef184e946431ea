"""Sensitivity checks in the store: queued with experiments, run under a lease, told as warnings; on both databases."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from gaplab.schemas.lifecycle import State
from gaplab.schemas.sensitivity import Sensitivity, SensitivitySpec, Verdict
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.errors import InvalidSpec, NotFound
from gaplab.services.core.optimizers.steady_state import SteadyState
from gaplab.services.experiments import checks, reading, submission
from gaplab.services.findings.sensitivity import Effort, check
from gaplab.services.running import execution, sensitivity
from gaplab.services.running.leases import MAX_LOSSES
from gaplab.services.specs.assembly import subject
from gaplab.services.specs.resolution import resolve_sensitivity
from gaplab.services.store.models import SensitivityRow
from gaplab.services.store.session import Store
from tests.experiments import listed, submit_one, toy

SECRET = 0.987654321


def settings(**changes: Any) -> Any:
    small = {"robot": "toy_function", "tunables": ["static_friction", "dynamic_friction"]}
    return SensitivitySpec.model_validate(small | changes)


def shown(verdict: Any, name: Any = "grip", effect: Any = 0.001) -> Any:
    return Sensitivity(
        name=name,
        effect=0.1,
        relative_effect=effect,
        roughness=0.7,
        failures=0,
        verdict=verdict,
        values=(0.0, 1.5),
        fitness=((0.1, None),),
    )


def stored_checks(store: Store) -> Any:
    with store.reading() as session:
        return [row.id for row in session.query(SensitivityRow)]


def test_submitting_an_experiment_queues_a_check_of_what_it_tunes(store: Store) -> None:
    experiment = submit_one(store, toy())

    found = checks.read(store, experiment.sensitivity)

    assert found.state is State.QUEUED
    assert found.spec.robot.name == "toy_function"
    assert [(each.name, each.upper) for each in found.spec.tunables] == [
        ("static_friction", 1.5),
        ("dynamic_friction", 1.5),
    ]
    assert found.rollouts == 8 * 2 * 17 + 4 * 100
    assert (found.unit, found.tunables, found.warnings) == ("m/s", (), ())


def test_the_same_robot_engine_and_tunables_are_checked_once(store: Store) -> None:
    first = submit_one(store, toy())
    second = submit_one(
        store, toy(strategy="random", seed=7, budget="desk", reality={"parameters": {"static_friction": SECRET}})
    )
    asked = checks.admit(store, settings(seed=3)).answer
    narrower = submit_one(store, toy(tunables=[{"name": "static_friction", "upper": 1.0}]))
    finer = checks.admit(store, settings(points=33)).answer

    assert first.sensitivity == second.sensitivity == asked.id
    assert set(stored_checks(store)) == {asked.id, narrower.sensitivity, finer.id}
    assert len(stored_checks(store)) == 3
    assert str(SECRET) not in checks.read(store, asked.id).model_dump_json()


@pytest.mark.parametrize("kind", ["robot toy_function", "engine analytic", "tunable dynamic_friction"])
def test_what_was_edited_since_is_checked_anew_and_earlier_experiments_keep_their_check(
    store: Store, monkeypatch: pytest.MonkeyPatch, kind: Any
) -> None:
    def edited(file: Any) -> None:
        monkeypatch.setattr(checks, "external_plugins", lambda: {kind: file, "robot other": file})

    edited("own.py 0123456789ab")
    before = submit_one(store, toy())
    asked_before = checks.admit(store, settings()).answer
    edited("own.py ba9876543210")
    after = submit_one(store, toy())
    asked_after = checks.admit(store, settings()).answer
    other = submit_one(store, toy(tunables=["static_friction"], robot="toy_function"))

    assert before.sensitivity == asked_before.id != after.sensitivity == asked_after.id
    assert reading.read_experiment(store, before.id).sensitivity == before.sensitivity
    assert other.sensitivity not in {before.sensitivity, after.sensitivity}


def test_a_study_has_one_check_and_the_direct_baseline_alone_has_none(store: Store) -> None:
    common = toy().model_dump(exclude={"strategy", "name"})
    study = submission.submit(store, StudySpec.model_validate(common | {"strategies": ["random", "direct"]}))

    strategies = {each.strategy: each.sensitivity for each in study.experiments}

    assert strategies == {"random": stored_checks(store)[0], "direct": None}
    other = submit_one(store, toy(strategy="direct", tunables=["restitution"]))
    assert other.sensitivity is None
    assert len(stored_checks(store)) == 1


@pytest.mark.dialects
def test_experiments_that_are_submitted_at_once_share_a_check(store: Store) -> None:
    with ThreadPoolExecutor(4) as pool:
        submitted = list(pool.map(lambda seed: submit_one(store, toy(seed=seed)), range(8)))

    assert len({each.sensitivity for each in submitted}) == len(stored_checks(store)) == 1


def test_what_a_check_finds_is_shown_and_warns_the_experiments(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    claim = sensitivity.claim(store, "me")
    found = check(subject(claim.spec), SteadyState(), Effort(claim.spec.points, claim.spec.evaluations))

    assert sensitivity.complete(store, claim, (*found, shown(Verdict.NOTHING), shown(Verdict.ROUGH, "slip", 0.5)))

    read = checks.read(store, claim.id)
    assert read.state is State.COMPLETED
    assert read.tunables[:2] == found
    assert read.warnings == (
        "grip over 0 to 1.5 does nothing: its effect on fitness is 0.1 % of the spread between controllers",
        "slip over 0 to 1.5: 70 % of its effect on fitness is noise between neighbouring values; the larger "
        "this share, the less certain its tuned value (called rough above 50 %; 100 % is chance). Leave it out of "
        "the tunables, or check other bounds or another engine with the command gaplab sensitivity",
    )
    assert reading.read_experiment(store, experiment).warnings == read.warnings
    assert listed(store)[0].warnings == read.warnings


def test_the_toys_tunables_are_smooth_and_warn_of_nothing(store: Store) -> None:
    experiment = submit_one(store, toy(tunables=["static_friction", "restitution"])).id
    claim = sensitivity.claim(store, "me")
    found = check(subject(claim.spec), SteadyState(), Effort(claim.spec.points, claim.spec.evaluations))

    sensitivity.complete(store, claim, found)

    assert {each.verdict for each in found} == {Verdict.SMOOTH}
    assert reading.read_experiment(store, experiment).warnings == ()


def test_a_tunable_between_bounds_too_narrow_to_matter_does_nothing() -> None:
    spec = settings(tunables=["static_friction", {"name": "restitution", "lower": 0.3, "upper": 0.301}])

    _, narrow = check(subject(resolve_sensitivity(spec)), SteadyState(), Effort(17, 100))

    assert narrow.verdict is Verdict.NOTHING


def test_a_failed_check_fails_no_experiment_and_says_why(store: Store) -> None:
    experiment = submit_one(store, toy()).id
    claim = sensitivity.claim(store, "me")

    assert sensitivity.fail(store, claim, "ValueError: nul\0")

    found = reading.read_experiment(store, experiment)
    assert found.state is State.QUEUED
    assert found.warnings == (
        "the sensitivity check failed, so that nothing is known of the tunables: ValueError: nul\ufffd",
    )
    assert len(execution.claim(store, "me", 9)) == 3


def test_a_failed_check_is_queued_again_when_it_is_asked_for_again(store: Store) -> None:
    check_id = checks.admit(store, settings()).answer.id
    sensitivity.fail(store, sensitivity.claim(store, "me"), "out of luck")

    again = checks.admit(store, settings()).answer

    assert (again.id, again.state, again.reason, again.ended_at) == (check_id, State.QUEUED, None, None)
    assert sensitivity.claim(store, "me").epoch == 2


@pytest.mark.dialects
def test_a_check_is_claimed_once_the_oldest_first(store: Store) -> None:
    first, second = (checks.admit(store, settings(points=points)).answer.id for points in (20, 21))

    with ThreadPoolExecutor(4) as pool:
        claims = [each for each in pool.map(lambda owner: sensitivity.claim(store, owner), "abcd") if each]

    assert sorted(each.id for each in claims) == sorted([first, second])
    assert sensitivity.claim(store, "me") is None
    assert {checks.read(store, each).state for each in (first, second)} == {State.RUNNING}


def test_a_lost_check_is_queued_again_and_its_old_holder_can_write_no_more(store: Store) -> None:
    check_id = checks.admit(store, settings()).answer.id
    old = sensitivity.claim(store, "first")

    assert sensitivity.requeue_lost(store) == 0
    assert sensitivity.heartbeat(store, [old])
    assert sensitivity.requeue_lost(store, stale_after_s=-1) == 1
    new = sensitivity.claim(store, "second")

    assert not sensitivity.heartbeat(store, [old])
    assert not sensitivity.complete(store, old, (shown(Verdict.NOTHING),))
    assert not sensitivity.fail(store, old, "late")
    assert not sensitivity.release(store, old, "late")
    assert sensitivity.complete(store, new, ())
    assert checks.read(store, check_id).state is State.COMPLETED


def test_a_check_that_loses_its_worker_again_and_again_is_what_kills_them(store: Store) -> None:
    check_id = checks.admit(store, settings()).answer.id

    for _ in range(MAX_LOSSES):
        assert sensitivity.release(store, sensitivity.claim(store, "me"), "killed")

    found = checks.read(store, check_id)
    assert (found.state, found.reason) == (State.FAILED, "lost 5 times without progress; the last time killed")
    assert sensitivity.claim(store, "me") is None


def test_a_check_that_is_handed_back_is_queued_as_if_it_had_not_been_claimed(store: Store) -> None:
    check_id = checks.admit(store, settings()).answer.id

    assert sensitivity.hand_back(store, sensitivity.claim(store, "me"))

    assert checks.read(store, check_id).state is State.QUEUED
    assert sensitivity.claim(store, "me").id == check_id


@pytest.mark.parametrize("name", ["no-such", "nul\0"])
def test_an_unknown_check_is_not_found(store: Store, name: Any) -> None:
    with pytest.raises(NotFound) as caught:
        checks.read(store, name)

    assert repr(name) in str(caught.value)


def test_settings_that_no_experiment_could_have_are_refused_with_every_violation(store: Store) -> None:
    with pytest.raises(InvalidSpec) as caught:
        checks.admit(store, settings(engine="pybullet", tunables=["grip"], optimizer="no_such"))

    assert {each.pointer for each in caught.value.violations} == {"/optimizer"}
    with pytest.raises(InvalidSpec) as caught:
        checks.admit(store, settings(tunables=["grip", {"name": "restitution", "upper": 7.0}]))
    assert {each.pointer for each in caught.value.violations} == {"/tunables/0", "/tunables/1/upper"}
    assert stored_checks(store) == []
