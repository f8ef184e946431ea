"""The soak's checker finds what it looks for: histories and databases that were broken by hand."""

import socket
from dataclasses import replace
from typing import Any

import pytest

from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.specs.resolution import resolve, resolve_experiment
from tests.soak.bench_checker import measurements
from tests.soak.checker import ends, epochs, results, violations
from tests.soak.drive_checker import drives, held
from tests.soak.driver_faults import LEASE_S
from tests.soak.evidence import Answer, Evidence, Experiment, Repetition, undisturbed
from tests.soak.hardware_faults import Command
from tests.soak.history import Record
from tests.soak.witness import Move

LOG = ("tuned", "transferred", "probed", "selected")
BODY = {"name": "one", "strategy": "simulated_fit", "robot": "toy_function", "budget": "smoke", "repetitions": 1}
SPEC = resolve_experiment(ExperimentSpec.model_validate(BODY)).model_dump(mode="json")
STUDY = {name: value for name, value in BODY.items() if name != "strategy"} | {"name": "two", "strategies": ["random"]}


def expected(spec: Any, number: Any) -> Any:
    return LOG


def move(
    number: Any,
    was: Any,
    state: Any,
    *,
    epochs: Any = (1, 1),
    owner: Any = "a",
    steps: Any = (0, 0),
    at: Any = 10.0,
    repetition: Any = 1,
) -> Any:
    return Move(number, repetition, was, state, *epochs, owner, *steps, at)  # type: ignore[call-arg]


CLAIMED = move(1, "QUEUED", "RUNNING", epochs=(0, 1), at=3.0)
STORED = move(2, "RUNNING", "RUNNING", steps=(0, 4), at=4.0)
ENDED = move(3, "RUNNING", "COMPLETED", steps=(4, 4), at=5.0)
SUBMITTED = Record("submit", "/experiments", BODY, 1.0, 2.0, 202, {"id": "e1"})
DONE = Repetition(1, 0, "COMPLETED", 1, 4, 1, LOG, (0, 1, 2, 3))
EXPERIMENT = Experiment("e1", "e1", "one", "COMPLETED", SPEC, (DONE,))
EVIDENCE = Evidence((EXPERIMENT,), {"e1": "one"}, {"c1": "COMPLETED"}, (CLAIMED, STORED, ENDED))


def found(history: Any = (SUBMITTED,), evidence: Any = EVIDENCE) -> Any:
    return violations(list(history), evidence, expected)


def with_repetition(**changes: Any) -> Any:
    return replace(EVIDENCE, experiments=(replace(EXPERIMENT, repetitions=(replace(DONE, **changes),)),))


def verb(name: Any, status: Any = 200, sent_at: Any = 6.0) -> Any:
    return Record(name, f"/studies/e1/{name}", None, sent_at, sent_at + 0.5, status)


def test_a_service_that_kept_its_word_has_no_violations() -> None:
    assert found() == []


def test_a_study_that_is_there_as_it_was_submitted_is_none() -> None:
    (resolved,) = resolve(StudySpec.model_validate(STUDY))
    answer = {"id": "s1", "experiments": [{"id": "e1"}]}
    submitted = Record("submit", "/studies", STUDY, 1.0, 2.0, 202, answer)
    own = replace(EXPERIMENT, study="s1", name="random", spec=resolved.model_dump(mode="json"))

    assert found([submitted], replace(EVIDENCE, experiments=(own,), studies={"s1": "two"})) == []
    assert found([submitted], replace(EVIDENCE, experiments=(), moves=(), studies={"s1": "two"})) != []
    assert found([submitted], replace(EVIDENCE, experiments=(own,))) != []


@pytest.mark.parametrize("status", [None, 503])
def test_a_submission_without_an_acknowledgement_may_be_there_or_not(status: Any) -> None:
    silent = replace(SUBMITTED, status=status, answer={})

    assert found([silent]) == []
    assert found([silent], Evidence()) == []


def test_what_was_cancelled_while_it_ran_keeps_the_beginning_of_its_log() -> None:
    cancelled = with_repetition(state="CANCELLED", steps=2, log=LOG[:2], places=(0, 1))
    cancelled = replace(
        cancelled,
        experiments=(replace(cancelled.experiments[0], state="CANCELLED"),),
        moves=(CLAIMED, replace_steps(STORED, 0, 2), move(3, "RUNNING", "CANCELLED", steps=(2, 2), at=6.2)),
    )

    assert found([SUBMITTED, verb("cancel")], cancelled) == []


def test_what_was_held_until_it_was_resumed_is_no_violation() -> None:
    assert found([SUBMITTED, verb("pause", sent_at=1.0), verb("resume", sent_at=2.5)]) == []


def test_what_was_extended_may_have_more_than_was_submitted() -> None:
    larger = replace(EVIDENCE, experiments=(replace(EXPERIMENT, spec=SPEC | {"iterations": 3}),))

    assert found([SUBMITTED, replace(verb("extend"), body={"iterations": 3})], larger) == []


def replace_steps(move: Any, was: Any, steps: Any) -> Any:
    return move._replace(steps_was=was, steps=steps)


BROKEN = {
    "lost": ("there 0 times", [SUBMITTED], Evidence()),
    "twice": ("there 2 times", [SUBMITTED], replace(EVIDENCE, studies={"e1": "one", "e2": "one"})),
    "with another id": ("is not there", [SUBMITTED], replace(EVIDENCE, experiments=(replace(EXPERIMENT, id="e2"),))),
    "with another spec": (
        "another spec",
        [SUBMITTED],
        replace(EVIDENCE, experiments=(replace(EXPERIMENT, spec=SPEC | {"seed": 7}),)),
    ),
    "without a repetition": (
        "other repetitions",
        [SUBMITTED],
        replace(EVIDENCE, experiments=(replace(EXPERIMENT, repetitions=()),)),
    ),
    "refused and there": ("yet there", [replace(SUBMITTED, status=422)], EVIDENCE),
    "nobody's": ("nobody submitted", [], EVIDENCE),
    "failed inside": ("the service failed", [SUBMITTED, verb("read", 500)], EVIDENCE),
    "denied": ("said not to exist", [SUBMITTED, verb("read", 404)], EVIDENCE),
    "cancelled in vain": ("cancel: acknowledged, and without effect", [SUBMITTED, verb("cancel")], EVIDENCE),
    "begun although stopped": (
        "stop: acknowledged, and without effect",
        [SUBMITTED, verb("stop", sent_at=2.0)],
        EVIDENCE,
    ),
    "begun while paused": (
        "pause: acknowledged, and without effect",
        [SUBMITTED, verb("pause", sent_at=2.0), verb("resume")],
        EVIDENCE,
    ),
    "extended in vain": (
        "extend: acknowledged, and without effect",
        [SUBMITTED, replace(verb("extend"), body={"iterations": 1_000})],
        EVIDENCE,
    ),
    "experiment stuck": (
        "e1 is stuck",
        [SUBMITTED],
        replace(EVIDENCE, experiments=(replace(EXPERIMENT, state="RUNNING"),)),
    ),
    "repetition stuck": ("e1/0 is stuck", [SUBMITTED], with_repetition(state="QUEUED")),
    "check stuck": ("check c1 is stuck", [SUBMITTED], replace(EVIDENCE, checks={"c1": "RUNNING"})),
    "completed without a completed one": (
        "none of its repetitions is",
        [SUBMITTED],
        with_repetition(state="FAILED", error="lost 5 times"),
    ),
    "failed": ("failed: ValueError", [SUBMITTED], with_repetition(state="FAILED", error="ValueError: no")),
    "a hole": ("4 steps are counted", [SUBMITTED], with_repetition(places=(0, 1, 3, 4))),
    "a step lost": ("4 steps are counted", [SUBMITTED], with_repetition(log=LOG[:3], places=(0, 1, 2))),
    "a step of other numbers": ("step 3 is another", [SUBMITTED], with_repetition(log=(*LOG[:3], "other"))),
    "a step too many": (
        "step 4 is another",
        [SUBMITTED],
        with_repetition(log=(*LOG, "more"), places=(0, 1, 2, 3, 4), steps=5),
    ),
    "completed too early": ("COMPLETED with 2 of 4", [SUBMITTED], with_repetition(log=LOG[:2], places=(0, 1), steps=2)),
    "two winners": (
        "two winners",
        [SUBMITTED],
        replace(EVIDENCE, moves=(CLAIMED, CLAIMED._replace(id=2, owner="b"), STORED, ENDED)),
    ),
    "an epoch skipped": (
        "from epoch 0 to 2",
        [SUBMITTED],
        replace(EVIDENCE, moves=(CLAIMED._replace(epoch=2), STORED, ENDED)),
    ),
    "a forbidden move": (
        "from COMPLETED to RUNNING",
        [SUBMITTED],
        replace(EVIDENCE, moves=(CLAIMED, STORED, ENDED, move(4, "COMPLETED", "RUNNING", steps=(4, 4)))),
    ),
    "a late write": (
        "whose epoch it is not",
        [SUBMITTED],
        replace(EVIDENCE, moves=(CLAIMED, STORED._replace(owner="b"), ENDED)),
    ),
    "steps taken back": (
        "from 4 to 2 steps",
        [SUBMITTED],
        replace(EVIDENCE, moves=(CLAIMED, STORED, replace_steps(STORED, 4, 2), replace_steps(ENDED, 2, 4))),
    ),
    "steps nobody stored": (
        "from 4 to 4 steps, after 3",
        [SUBMITTED],
        replace(EVIDENCE, moves=(CLAIMED, replace_steps(STORED, 0, 3), ENDED)),
    ),
    "a corrupt file": ("page 7", [SUBMITTED], replace(EVIDENCE, complaints=("page 7 is never used",))),
}


@pytest.mark.parametrize("case", BROKEN)
def test_it_finds_what_was_broken(case: Any) -> None:
    sentence, history, evidence = BROKEN[case]

    assert any(sentence in each for each in found(history, evidence)), found(history, evidence)


def test_what_is_expected_is_computed_once_and_differs_between_repetitions() -> None:
    first = undisturbed(SPEC, 0)

    assert undisturbed(SPEC | {"name": "other"}, 0) is first
    assert undisturbed(SPEC, 1) != first
    assert len(set(first)) == len(first)


@pytest.mark.parametrize(("strategy", "state", "count"), [("random", "FAILED", 1), ("misbehaving_raises", "FAILED", 0)])
def test_an_experiment_may_fail_if_it_was_itself_at_fault(strategy: Any, state: Any, count: Any) -> None:
    failed = (replace(DONE, state=state, error="ValueError: x", log=(), steps=0, places=()),)
    experiment = replace(EXPERIMENT, state=state, spec=SPEC | {"strategy": {"name": strategy}}, repetitions=failed)

    failures = [each for each in results((), Evidence((experiment,)), expected) if "failed" in each]

    assert len(failures) == count


def test_an_experiment_that_was_itself_at_fault_must_end_all_the_same() -> None:
    running = (replace(DONE, state="RUNNING"),)
    spec = SPEC | {"strategy": {"name": "misbehaving_hangs"}}

    stuck = [*ends(Evidence((replace(EXPERIMENT, state="RUNNING", spec=spec, repetitions=running),)))]

    assert stuck == ["e1 is stuck: RUNNING", "e1/0 is stuck: RUNNING"]


TAKE = Record(
    "take",
    "/requests/r1/take",
    {},
    1.0,
    2.0,
    200,
    {"id": "r1", "experiment": "e1", "repetition": 0, "genome": [0.5], "takes": 1},
)
ANSWER = Record(
    "answer", "/requests/r1/measurements", {}, 3.0, 4.0, 201, {"id": "a1", "request": "r1", "state": "counted"}
)
OTHER_TAKE = replace(TAKE, sent_at=5.0, answered_at=6.0, answer=TAKE.answer | {"id": "r2"})
ANSWERS = {"a1": Answer("r1", "counted")}


@pytest.mark.parametrize(
    ("history", "answers", "violation"),
    [
        ([TAKE, ANSWER], ANSWERS, None),
        ([TAKE, ANSWER], {}, "a1 is not there"),
        ([TAKE, ANSWER], ANSWERS | {"a2": Answer("r1", "counted")}, "request r1: 2 answers count"),
        ([TAKE, ANSWER], ANSWERS | {"a2": Answer("r1", "conflict")}, None),
        ([TAKE, TAKE, ANSWER], ANSWERS, "take 1 of request r1 has 2 holders"),
        ([TAKE, ANSWER, OTHER_TAKE], ANSWERS, "its controller was measured"),
        ([TAKE, ANSWER, replace(OTHER_TAKE, answer=OTHER_TAKE.answer | {"genome": [0.6]})], ANSWERS, None),
        ([replace(ANSWER, verb="nonsense")], ANSWERS, "was accepted"),
        ([replace(ANSWER, verb="lie")], ANSWERS, "it is a lie"),
        ([replace(ANSWER, verb="lie", answer=ANSWER.answer | {"state": "conflict"})], ANSWERS, None),
    ],
)
def test_measurements_that_are_lost_doubled_or_asked_for_again_are_found(
    history: Any, answers: Any, violation: Any
) -> None:
    (*wrong,) = measurements(history, replace(EVIDENCE, answers=answers))

    assert (violation is None) is not bool(wrong)
    assert violation is None or violation in wrong[0]


def test_an_answer_may_add_steps_of_a_repetition_that_nobody_holds_and_a_correction_may_take_some() -> None:
    waiting = move(1, "WAITING", "WAITING", owner=None, steps=(0, 3))
    corrected = move(2, "WAITING", "QUEUED", owner=None, steps=(3, 2))
    ended = move(3, "QUEUED", "COMPLETED", owner=None, steps=(2, 4))
    on_bench = replace(EXPERIMENT, spec=SPEC | {"reality": SPEC["reality"] | {"kind": "physical"}})
    moves = (CLAIMED, waiting, corrected, ended)

    assert list(epochs(replace(EVIDENCE, experiments=(on_bench,), moves=moves))) == []
    assert len(list(epochs(replace(EVIDENCE, moves=moves)))) == 3


def moves(drive: Any, *at: Any, robot: Any = "r") -> Any:
    return [Command(each, robot, drive) for each in at]


@pytest.mark.parametrize(
    ("commands", "violation"),
    [
        ([*moves("1.1", 1.0, 1.1), *moves("2.1", 1.2, 1.3), *moves("2.2", 1.4)], None),
        ([*moves("1.1", 1.0), *moves("2.1", 1.2), *moves("1.1", 1.3)], "1.1 moved r 1 times from 1.3"),
        ([*moves("1.1", 1.0), *moves("2.1", 1.2, robot="s"), *moves("1.1", 1.3)], None),
        ([*moves("1.1", 1.0), *moves("2.1", 1.2), *moves("1.1", 4.0), *moves("2.1", 4.1, 4.2)], None),
        ([*moves("1.1", 1.0), *moves("2.1", 1.2), *moves("1.1", 4.0, 4.1, 4.4)], "1.1 moved r 1 times from 4.4"),
        ([*moves("1.1", 1.0), *moves("2.1", 1.2), Command(1.3, "r", "1.1", "stop")], None),
    ],
    ids=["in turn", "two at once", "two robots", "a command in hand", "one too late", "a stop"],
)
def test_two_programs_that_move_one_robot_are_found(commands: Any, violation: Any) -> None:
    (*wrong,) = drives(commands)

    assert (violation is None) is not bool(wrong)
    assert violation is None or violation in wrong[0]


@pytest.mark.parametrize(
    ("at", "value", "count"),
    [((1.0, 1.1, 1.2), "0.25", 0), ((1.0, 1.1 + LEASE_S, 1.2 + LEASE_S), "0.25", 1), ((1.0, 1.1), "0.5", 1)],
    ids=["held", "it stood still", "another fitness"],
)
def test_an_answer_of_a_driver_counts_only_of_a_run_that_had_its_take_throughout(
    at: Any, value: Any, count: Any
) -> None:
    commands = [*moves("1.1", *at), Command(at[-1], "r", "1.1", value)]
    answer = Answer("r1", "counted", socket.gethostname(), "r", (0.25,))

    assert len([*held(Evidence(commands=tuple(commands), answers={"a1": answer}))]) == count
