"""Answers that repeat, complete or contradict the one that counts, and who gave them."""

from typing import Any

import pytest

from gaplab.schemas.corrections import ConflictSpec
from gaplab.schemas.measurements import MeasurementSpec, ReleaseSpec, TakeSpec
from gaplab.schemas.traces import TracesRead, TracesSpec
from gaplab.services.core.errors import LimitReached
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import answering, corrections, taking
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.replay.process import sent as sent_spec
from gaplab.services.replay.traces import evaluate_traces, said_by_files
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.session import Store
from gaplab.services.waiting_line import WaitingLine
from tests.experiments import submit_one
from tests.integration.test_bench import bench, compute, pending, sent, undecided

ROBOT = '''
"""A function with a sensor."""

import numpy as np

from gaplab.plugins import Sensors, frozen
from gaplab.services.world.robots.toy_function import ToyFunction


class Sensing(ToyFunction):
    """The toy function with one reading."""

    name = "sensing"
    sensors = Sensors(("place",), ("m",), frozen([0.1]), frozen([1.0]))

    def sense(self, trajectory):
        return trajectory.positions_m[..., :1]
'''


def given(store: Store, request: Any, **parts: Any) -> Any:
    return answering.answer(store, request.id, MeasurementSpec(**parts), FREELY).answer


@pytest.fixture
def request_(store: Store, put: Any) -> Any:
    """The request of a robot that senses, taken by Ada."""
    put(sensing=ROBOT)
    submit_one(store, bench(robot="sensing", strategy="random"))
    compute(store)
    (found,) = pending(store)
    return taking.take(store, found.id, TakeSpec(operator="Ada"), FREELY).answer


def test_an_answer_that_adds_or_contradicts_anything_is_kept_as_a_conflict(store: Store, request_: Any) -> None:
    first, second = sent(store, "first"), sent(store, "second")
    whole = {"take": 1, "values": (0.5,), "note": "cold", "attachments": (first,), "readings": (((0.1,),),)}
    counted = given(store, request_, **whole)
    others: list[dict[str, Any]] = [
        {"readings": (((0.2,),),)},
        {"note": "warm"},
        {"attachments": (first, second)},
        {"operator": "Bo"},
        {"take": 2},
    ]

    kept = [given(store, request_, **whole | changes) for changes in others]

    assert (counted.state, counted.operator) == ("counted", "Ada")
    assert [each.state for each in kept] == ["conflict"] * len(others)
    assert kept[0].readings == (((0.2,),),)
    assert kept[1].note == "warm"
    assert kept[2].attachments == (first, second)
    assert [each.id for each in undecided(store)] == [request_.id]
    decision = ConflictSpec(counts="this", reason="the sensor was read again")
    told = corrections.decide(store, kept[0].id, decision, FREELY, dry_run=True).answer
    assert [each.id for each in undecided(store)] == [request_.id]
    done = corrections.decide(store, kept[0].id, decision, FREELY).answer
    assert (told.branch, done.model_copy(update={"branch": None})) == (None, told)
    states = {each.id: each.state for each in taking.read_request(store, request_.id).answers}
    assert (states[counted.id], states[kept[0].id]) == ("replaced", "counted")


def test_readings_that_come_after_their_value_are_kept(store: Store, request_: Any) -> None:
    counted = given(store, request_, take=1, values=(0.5,))

    late = given(store, request_, take=1, values=(0.5,), readings=(((0.1,),),), note="from the log of the robot")

    assert (counted.state, late.state) == ("counted", "conflict")
    assert (late.readings, late.note) == ((((0.1,),),), "from the log of the robot")


@pytest.mark.dialects
def test_an_answer_that_is_sent_again_is_stored_once_also_without_a_key(store: Store, request_: Any) -> None:
    first = sent(store, "first")
    whole = {"take": 1, "values": (0.5,), "note": "co\0ld", "attachments": (first,), "readings": (((None,),),)}
    counted = given(store, request_, **whole, operator="A\0da")

    again = [
        given(store, request_, **whole, operator="A\0da"),
        given(store, request_, **whole),
        given(store, request_, values=(0.5,)),
        given(store, request_, take=1, values=(0.5,), note=""),
    ]

    assert again == [counted] * 4
    assert taking.read_request(store, request_.id).answers == (counted,)


def test_a_failure_that_is_sent_again_is_stored_once(store: Store, request_: Any) -> None:
    counted = given(store, request_, take=1, failed="it f\0ell")

    assert given(store, request_, take=1, failed="it f\0ell") == counted
    assert given(store, request_, take=1, failed="it broke").state == "conflict"
    assert given(store, request_, take=1, values=(0.5,)).state == "conflict"


def test_an_answer_of_an_earlier_take_is_not_said_to_be_of_whoever_took_the_request_since(
    store: Store, request_: Any
) -> None:
    taking.release(store, request_.id, ReleaseSpec(take=1))
    taking.take(store, request_.id, TakeSpec(operator="Bo"), FREELY)

    late = given(store, request_, take=1, values=(0.4,))
    without = given(store, request_, values=(0.3,))
    named = given(store, request_, take=1, values=(0.2,), operator="Ada")
    current = given(store, request_, take=2, values=(0.5,))

    told = [(each.operator, each.state) for each in (late, without, named, current)]
    assert told == [("unknown", "conflict"), ("unknown", "conflict"), ("Ada", "conflict"), ("Bo", "counted")]


def test_an_answer_after_the_end_of_the_latest_take_is_of_its_holder(store: Store, request_: Any) -> None:
    taking.release(store, request_.id, ReleaseSpec(take=1))

    late = given(store, request_, take=1, values=(0.4,))

    assert (late.operator, late.state) == ("Ada", "counted")


class Opened(dict[str, bytes]):
    """Files that say how often each was opened."""

    def __init__(self, files: dict[str, bytes]) -> None:
        super().__init__(files)
        self.opened: list[str] = []

    def __getitem__(self, name: str) -> bytes:
        self.opened.append(name)
        return super().__getitem__(name)


def test_a_trace_is_read_once_and_in_the_line_of_rollouts(store: Store) -> None:
    experiment = submit_one(store, bench(reality={"repeats": 3}))
    compute(store)
    (request,) = pending(store)
    trace = b"time_s,x,y,z,qx,qy,qz,qw\n3,0,0,0,0,0,0,1\n5,1,0,0,0,0,0,1\n"
    files, asked = Opened({"a" * 64: trace, "b" * 64: trace}), TracesSpec(traces=("a" * 64, "b" * 64, "a" * 64))
    line = WaitingLine("replays", longest_s=0.0)
    rollouts = RolloutProcess(line=line)

    spec = spec_of(experiment.spec)
    said = said_by_files(sent_spec(spec), request.genome, [0.5] * len(spec.tunables), asked, files)
    with line.turn(), pytest.raises(LimitReached):
        evaluate_traces(store, rollouts, request.id, TracesSpec(traces=(sent(store, "no trace"),)))

    assert isinstance(said, TracesRead)
    assert said.values == (0.5, 0.5, 0.5)
    assert sorted(files.opened) == ["a" * 64, "b" * 64]
    assert rollouts.pid is None


def test_all_traces_that_cannot_be_read_are_named(store: Store) -> None:
    spec = spec_of(submit_one(store, bench(reality={"repeats": 2})).spec)
    asked = TracesSpec(traces=("a" * 64, "b" * 64))

    said = said_by_files(sent_spec(spec), (), (), asked, {"a" * 64: b"no trace", "b" * 64: b"nor this"})

    assert not isinstance(said, TracesRead)
    assert [each.pointer for each in said] == ["/traces/0", "/traces/1"]
