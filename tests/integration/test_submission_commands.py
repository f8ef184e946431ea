"""Submission from a terminal: the cost is shown first, and a person is asked before hours of computation."""

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pexpect
import pytest

from gaplab.api.clients import confirmation
from gaplab.api.clients.client import Client
from gaplab.api.clients.confirmation import NotSubmitted, confirm, duration, sentence
from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.estimates import EstimateRead
from gaplab.services.experiments import listing
from gaplab.services.store.session import Store
from tests.commands import Gaplab
from tests.experiments import listed, submit_one
from tests.integration.test_bench import bench, compute, measure, pending

SMALL = {"strategy": "random", "robot": "toy_function", "budget": "smoke"}

STUDY = {"strategies": ["random"], "robot": "toy_function", "budget": "smoke"}


def test_the_cost_is_shown_before_the_id_is_printed(gaplab: Gaplab) -> None:
    said = gaplab("submit", "-", stdin=json.dumps(SMALL))

    assert said.code == 0
    assert len(said.out.split()) == 1
    assert said.err.startswith("1 experiment, 2 repetitions: at most 720 rollouts, less than a second on ")


def test_a_dry_run_prints_the_complete_spec_and_submits_nothing(gaplab: Gaplab, sqlite_store: Store) -> None:
    text, document = (
        gaplab("submit", "-", "--dry-run", *options, stdin=json.dumps(SMALL)) for options in ([], ["--json"])
    )

    assert listed(sqlite_store) == []
    assert json.loads(text.out)["iterations"] == 2
    assert json.loads(text.out)["engine"]["name"] == "analytic"
    assert "Nothing was submitted" in text.err
    assert json.loads(document.out)["specs"] == [json.loads(text.out)]


@contextmanager
def working(store: Store) -> Iterator[None]:
    """A supervisor beside what is done meanwhile."""
    ended = threading.Event()

    def work() -> None:
        while not ended.wait(0.1):
            compute(store)

    worker = threading.Thread(target=work)
    worker.start()
    try:
        yield
    finally:
        ended.set()
        worker.join()


def test_further_tunables_are_tried_on_the_samples_of_an_experiment(gaplab: Gaplab, sqlite_store: Store) -> None:
    spec = SMALL | {"tunables": ["static_friction", "dynamic_friction"], "repetitions": 1}
    id = gaplab("submit", "-", stdin=json.dumps(spec)).out.strip()
    compute(sqlite_store)
    with working(sqlite_store):
        said = gaplab("try-tunables", id, "restitution", "mass", "--json")

    assert said.code == 0, said.err
    assert "mass is not tried: " in said.err
    assert [(each["added"], each["tuner"], each["unit"]) for each in json.loads(said.out)] == [
        ("nothing", "search", "m/s"),
        ("restitution", "search", "m/s"),
    ]
    assert all(each["error"] >= 0 for each in json.loads(said.out))


@pytest.mark.release
def test_further_tunables_are_tried_on_readings_of_a_robot_on_a_bench(gaplab: Gaplab, sqlite_store: Store) -> None:
    changes = {"robot": "quadruped", "engine": "mujoco", "iterations": 1, "discrepancy": "readings"}
    id = submit_one(sqlite_store, bench(**changes, reality={"repeats": 2, "limits": {"tilt": 2.0}})).id
    compute(sqlite_store)
    readings = tuple((((None, *([0.01] * 4)),) * 10) for _ in range(2))
    while asked := pending(sqlite_store):
        measure(sqlite_store, asked[0], 0.4, 0.5, readings=readings)
        compute(sqlite_store)
    with working(sqlite_store):
        said = gaplab("try-tunables", id, "mass", "kp", "--json")

    assert said.code == 0, said.err
    tried = {each["added"]: each for each in json.loads(said.out)}
    assert "kp is not tried: " in said.err
    assert {name: each["unit"] for name, each in tried.items()} == {"nothing": "× noise", "mass": "× noise"}
    assert all(each["error"] > 0 for each in tried.values())
    told = gaplab("show", tried["mass"]["experiment"]).out
    assert "samples from before the experiment: 3 tuned on" in told


def test_a_program_without_a_terminal_is_not_asked(gaplab: Gaplab, sqlite_store: Store) -> None:
    said = gaplab("submit", "-", stdin='{"engine": "mujoco"}')

    assert said.code == 0
    assert "7 experiments, 280 repetitions" in said.err
    assert len(listing.list_studies(sqlite_store).items) == 1


def test_thousands_of_core_hours_need_a_yes_without_a_terminal_too(gaplab: Gaplab, sqlite_store: Store) -> None:
    refused = gaplab("submit", "-", stdin="{}")

    assert refused.code == Exit.INVALID
    assert "core-hours; more than 1,000 (GAPLAB_MAX_UNCONFIRMED_CORE_HOURS) must be confirmed: confirm" in refused.err
    assert listing.list_studies(sqlite_store).items == ()
    assert gaplab("submit", "-", "--yes", stdin="{}").code == Exit.OK


@pytest.mark.parametrize(("answer", "studies"), [("n", 0), pytest.param("y", 1, marks=pytest.mark.release)])
def test_a_person_is_asked_before_hours_even_if_the_spec_comes_through_a_pipe(
    at_a_terminal: Callable[[str, str, str], pexpect.spawn], sqlite_store: Store, answer: str, studies: int
) -> None:
    child = at_a_terminal("echo '{}' | gaplab submit -", confirmation.QUESTION, answer)

    assert child.exitstatus == (0 if studies else Exit.INTERRUPTED)
    assert len(listing.list_studies(sqlite_store).items) == studies


def test_the_client_asks_a_person_too(url: str, monkeypatch: pytest.MonkeyPatch, sqlite_store: Store) -> None:
    monkeypatch.setattr("gaplab.api.clients.studies.can_ask", lambda: True)
    monkeypatch.setattr("builtins.input", lambda _: "no")
    with Client(url) as client:
        with pytest.raises(NotSubmitted, match="nothing was submitted"):
            client.submit({})
        client.submit(SMALL)
        client.submit({}, yes=True)

    assert len(listed(sqlite_store)) == 1 + 7


def test_an_estimate_of_an_experiment_is_that_of_a_study_with_its_strategy(url: str) -> None:
    with Client(url) as client:
        alone, study = (client.estimate(spec) for spec in (SMALL, STUDY))

    assert alone.rollouts == study.rollouts


def test_only_yes_is_yes(url: str) -> None:
    with Client(url) as client:
        estimate: EstimateRead = client.estimate({})

    assert estimate.seconds > confirmation.LONG_S
    assert not confirm(estimate, None)
    assert confirm(estimate, lambda _: " Yes\n")
    for answer in ("", "n", "yesterday"):
        with pytest.raises(NotSubmitted):
            confirm(estimate, lambda _: answer)  # noqa: B023 - asked at once
    assert "no supervisor runs" in sentence(estimate)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.2, "less than a second"),
        (42.4, "about 42 s"),
        (3_600, "about 1 h"),
        (7_505, "about 2 h 5 min"),
        (200_000, "about 2 d 7 h"),
    ],
)
def test_durations_have_two_units(seconds: float, words: str) -> None:
    assert duration(seconds) == words
