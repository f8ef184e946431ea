"""Events: what is told, in which order, and that a reader who resumes misses nothing."""

import asyncio
import json
import random
import threading
import time
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import count
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI
from fastapi.responses import StreamingResponse
from fastapi.testclient import TestClient
from sqlalchemy import delete, update

from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable
from gaplab.api.http import access as http_access
from gaplab.api.http import event_feed as feeding
from gaplab.api.http.event_feed import EventFeed
from gaplab.api.process.server import Server, listen
from gaplab.schemas.access import Role
from gaplab.schemas.corrections import ConflictSpec, CorrectionSpec, VoidSpec
from gaplab.schemas.editing import Edit
from gaplab.schemas.events import EventKind, EventPage, EventRead
from gaplab.schemas.lifecycle import ExtensionSpec, Verb
from gaplab.schemas.measurements import ReleaseSpec, TakeSpec
from gaplab.schemas.notifications import Channel
from gaplab.services import access, archives, events
from gaplab.services.core.errors import NotFound
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import editing, lifecycle, submission
from gaplab.services.experiments.checks import queue_for
from gaplab.services.experiments.editing import Deleter
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import corrections, taking
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.notifications import outbox
from gaplab.services.running import execution, provenance, sensitivity
from gaplab.services.running.leases import MAX_LOSSES
from gaplab.services.running.versions import provenance as own
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.lease import Failure
from gaplab.services.store.models import EventCounterRow, EventRow
from gaplab.services.store.queries.events import note, write
from gaplab.services.store.queries.experiments import insert_study
from gaplab.services.store.session import Store
from tests.experiments import cancel, run, some_log, submit_one, toy
from tests.integration import test_bench_safety
from tests.integration.test_bench import bench, compute, fall_silent, measure
from tests.waiting import wait_until

DEADLINE_S = 180
OTHER = own().model_copy(update={"architecture": "riscv64"})


def told(store: Store, which: WantedEvents | None = None, after: int = 0) -> tuple[EventRead, ...]:
    return events.page(store, after, which or WantedEvents(), limit=1_000).items


def kinds(store: Store, which: WantedEvents | None = None) -> list[str]:
    return [each.kind.value for each in told(store, which)]


@pytest.mark.dialects
def test_the_life_of_an_experiment_is_told_step_by_step(store: Store) -> None:
    id_ = submit_one(store, toy(repetitions=1, iterations=1)).id
    (claim,) = execution.claim(store, "me", 1)
    run(store, claim, some_log(1))

    found = told(store)

    steps = ["tuned", "transferred", "probed", "selected", "measured", "tuned", "transferred", "probed"]
    assert [each.kind.value for each in found] == [
        "submitted",
        "started",
        "repetition_claimed",
        *steps,
        "repetition_completed",
        "completed",
    ]
    assert [each.number for each in found] == list(range(1, len(found) + 1))
    assert {each.experiment for each in found} == {id_}
    assert [each.repetition for each in found] == [None, None, *[0] * 10, None]
    measured, probed = (next(each for each in found if each.kind == kind) for kind in ("measured", "probed"))
    assert measured.body == {"iteration": 1, "fitness": None}
    assert probed.body == {"iteration": 0, "fitness": 1.0, "recorded_fitness": 1.0}


def everything_that_can_happen(store: Store) -> None:
    submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)
    run(store, claim)
    submit_one(store, toy(repetitions=2))
    fails, waits = execution.claim(store, "me", 2)
    execution.record(store, waits, next(some_log()))
    execution.fail(store, fails, Failure("it is broken"))
    execution.hand_back(store, waits)
    execution.claim(store, "other", 1, OTHER)
    provenance.accept_versions(store, waits.experiment_id)
    for _ in range(MAX_LOSSES):
        (waits,) = execution.claim(store, "me", 1)
        execution.release(store, waits, "killed")
    cancelled = submit_one(store, toy())
    execution.claim(store, "me", 1)
    cancel(store, cancelled.id)
    all_verbs(store)
    check = sensitivity.claim(store, "me")
    assert check is not None
    sensitivity.fail(store, check, "no legs")
    lifecycle.ask(store, waits.experiment_id, Verb.RETRY)
    kept_and_told_of(store)
    on_a_bench(store)


def on_a_bench(store: Store) -> None:
    """Takes that end without an answer, answers in conflict, a correction, a void, and a refusal."""
    reality = {"kind": "physical", "probes": "never"}
    submit_one(store, toy(strategy="random", repetitions=1, priority=10, reality=reality))
    compute(store, most=1)
    (request,) = taking.list_requests(store, RequestFilter()).items
    for _ in range(2):
        taken = taking.take(store, request.id, TakeSpec(operator="Ada"), FREELY).answer
        if taken.takes == 1:
            taking.release(store, request.id, ReleaseSpec(take=1))
    assert fall_silent(store) == 1
    measure(store, request, 0.4)
    other = measure(store, request, 0.3)
    corrections.decide(store, other.id, ConflictSpec(counts="this", reason="the first was another"), FREELY)
    corrected = corrections.correct(store, other.id, CorrectionSpec(values=(0.2,), reason="a slip"), FREELY).answer
    corrections.void(store, corrected.answer or "", VoidSpec(reason="the floor was wet"), FREELY)
    while claims := execution.claim(store, "me", 9):
        execution.hand_back(store, *claims)
        cancel(store, claims[0].experiment_id)
    test_bench_safety.submit(store, "refuse")
    test_bench_safety.ask(store, safety=test_bench_safety.safety("it tips over"))


def kept_and_told_of(store: Store) -> None:
    outbox.collect(store, "me", [Channel.COMMAND])
    ended = cancel(store, submit_one(store, toy()).id).id
    outbox.collect(store, "me", [Channel.COMMAND])
    letter = outbox.next_letter(store)
    assert letter is not None
    outbox.settle(store, letter, "no answer")
    outbox.settle(store, replace(letter, attempt=2), None)
    editing.edit(store, ended, Edit(tags=("gait",)), starting_from=None)
    editing.archive(store, ended)
    editing.archive(store, ended, archived=False)
    editing.delete(store, ended, Deleter(None))


def all_verbs(store: Store) -> None:
    """An experiment paused, resumed, stopped, extended; and another, imported."""
    asked = submit_one(store, toy(repetitions=1)).id
    steps = some_log()
    for verb in (Verb.PAUSE, Verb.STOP):
        (claim,) = execution.claim(store, "me", 1)
        lifecycle.ask(store, asked, verb)
        while execution.record(store, claim, next(steps)):
            continue
        if verb is Verb.PAUSE:
            lifecycle.ask(store, asked, Verb.RESUME)
    whole = submit_one(store, toy(repetitions=1)).id
    run(store, *execution.claim(store, "me", 1))  # type: ignore[arg-type]
    lifecycle.extend(store, whole, ExtensionSpec(repetitions=2))
    with archives.export(store, asked).file as file:
        archives.import_archive(store, file)


def test_every_kind_of_event_is_told_and_none_shows_where_reality_is(store: Store) -> None:
    with store.transaction() as session:
        note(session, EventKind.SUBMITTED, "the first")  # so that numbers and ids differ

    everything_that_can_happen(store)

    found = told(store)
    assert {each.kind for each in found} == set(EventKind)
    assert [each.number for each in found] == list(range(1, len(found) + 1))
    assert not any("parameters" in json.dumps(each.body) or "genome" in json.dumps(each.body) for each in found)
    assert [each.body["reason"] for each in found if each.kind is EventKind.REPETITION_LOST] == ["killed"] * 4
    lost = next(each for each in reversed(found) if each.kind is EventKind.REPETITION_FAILED)
    assert lost.body["reason"].startswith("lost 5 times")


def test_an_experiment_submitted_after_its_check_is_told_of_it_at_once(store: Store) -> None:
    before = submit_one(store, toy()).id
    check = sensitivity.claim(store, "me")
    sensitivity.complete(store, check, [])

    later = submit_one(store, toy()).id

    for each in (before, later):
        assert kinds(store, WantedEvents(study=each)) == ["submitted", "sensitivity_ended"]


@pytest.mark.dialects
def test_an_experiment_submitted_while_its_check_ends_is_told_of_it(store: Store) -> None:
    submit_one(store, toy())
    check, spec = sensitivity.claim(store, "me"), resolve_experiment(toy())

    with ThreadPoolExecutor(1) as pool:
        with store.transaction() as session:
            (row,) = insert_study(session, "late", [(spec, submission.extent_of(spec))]).experiments
            queue_for(session, [row])
            ending = pool.submit(sensitivity.complete, store, check, [])
            time.sleep(0.3)  # it waits for what is locked here
        assert ending.result(timeout=30)

    assert kinds(store, WantedEvents(study=row.id)) == ["submitted", "sensitivity_ended"]


def test_a_step_that_is_delivered_twice_is_told_once(store: Store) -> None:
    submit_one(store, toy(repetitions=1))
    (claim,) = execution.claim(store, "me", 1)

    for step in some_log():
        execution.record(store, claim, step)
        execution.record(store, claim, step)

    assert kinds(store, WantedEvents(kinds=frozenset({EventKind.PROBED}))) == ["probed"] * 3


@pytest.mark.dialects
def test_what_is_rolled_back_was_never_told_and_leaves_no_hole(store: Store) -> None:
    submit_one(store, toy())

    def fail(session: Any) -> None:
        note(session, EventKind.CANCELLED, "nobody")
        write(session)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        store.write(fail)
    submit_one(store, toy())

    assert [(each.number, each.kind.value) for each in told(store)] == [(1, "submitted"), (2, "submitted")]


def test_a_number_is_seen_only_with_all_smaller_ones(postgres_store: Store) -> None:
    """The first transaction has its numbers and is slow to commit: the second, which begins later, waits for it."""
    first_counted, let_go = threading.Event(), threading.Event()

    def slow() -> None:
        with postgres_store.transaction() as session:
            note(session, EventKind.STARTED, "slow")
            write(session)
            first_counted.set()
            assert let_go.wait(DEADLINE_S)

    def quick() -> None:
        with postgres_store.transaction() as session:
            note(session, EventKind.STARTED, "quick")

    with ThreadPoolExecutor(2) as pool:
        slowly = pool.submit(slow)
        assert first_counted.wait(DEADLINE_S)
        quickly = pool.submit(quick)
        time.sleep(0.3)
        seen_meanwhile, done_meanwhile = told(postgres_store), quickly.done()
        let_go.set()
        slowly.result(DEADLINE_S)
        quickly.result(DEADLINE_S)

    assert (seen_meanwhile, done_meanwhile) == ((), False)
    assert [(each.number, each.experiment) for each in told(postgres_store)] == [(1, "slow"), (2, "quick")]


def write_many(store: Store, name: int) -> None:
    """Transactions of one, two or three events, a fifth of which are rolled back."""
    chance = random.Random(name)

    def dawdle(session: Any) -> None:
        for part in range(chance.randint(1, 3)):
            note(session, EventKind.PROBED, "some experiment", part=part)
        time.sleep(chance.random() * 0.01)
        if chance.random() < 0.2:
            write(session)
            raise ZeroDivisionError

    for _ in range(25):
        with suppress(ZeroDivisionError):
            store.write(dawdle)


@pytest.mark.dialects
def test_a_reader_that_resumes_among_many_writers_misses_nothing(store: Store) -> None:
    """Writers commit, roll back and dawdle; whoever reads meanwhile, a page after the other, sees every number once."""
    over = threading.Event()

    def read() -> list[int]:
        seen: list[int] = []
        while True:
            ended = over.is_set()
            page = events.page(store, seen[-1] if seen else 0, WantedEvents(), limit=7)
            seen += [each.number for each in page.items]
            if ended and not page.items:
                return seen

    with ThreadPoolExecutor(6) as pool:
        readers = [pool.submit(read) for _ in range(2)]
        list(pool.map(write_many, [store] * 4, range(4)))
        over.set()
        seen = [each.result(DEADLINE_S) for each in readers]

    stored = [each.number for each in told(store)]
    assert stored == list(range(1, len(stored) + 1))
    assert len(stored) > 50
    assert seen == [stored, stored]


def test_supervisors_that_record_claim_and_end_at_once_do_not_wait_for_each_other_in_a_circle(
    postgres_store: Store,
) -> None:
    store = postgres_store
    for _ in range(3):
        submit_one(store, toy(repetitions=5))

    def work(owner: str) -> int:
        done = 0
        while claims := execution.claim(store, owner, 2):
            for claim in claims:
                run(store, claim)
                done += 1
        return done

    with ThreadPoolExecutor(4) as pool:
        assert sum(pool.map(work, "abcd")) == 15

    found = [each.number for each in events.page(store, 0, WantedEvents(), limit=1_000).items]
    assert found == list(range(1, len(found) + 1))


@contextmanager
def served(store: Store, port: int = 0) -> Iterator[tuple[str, EventFeed]]:
    """A service in a thread, ended as the real one is."""
    app = create_app(store)
    with serving(app, port) as url:
        yield url, app.state.feed


@contextmanager
def serving(app: FastAPI, port: int = 0) -> Iterator[str]:
    """The address of a service of this app in a thread."""
    listener = listen("127.0.0.1", port)
    server = Server(app)
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join(DEADLINE_S)
        assert not thread.is_alive()


def take(stream: Iterator[EventRead], many: int) -> list[EventRead]:
    return [next(stream) for _ in range(many)]


def test_a_stream_has_what_was_and_what_comes(store: Store) -> None:
    submit_one(store, toy(repetitions=1))
    with served(store) as (url, feed), Client(url) as client:
        stream = client.events()
        first = take(stream, 1)
        (claim,) = execution.claim(store, "me", 1)
        run(store, claim)
        rest = take(stream, 17)
        assert feed.open == 1
        stream.close()  # type: ignore[attr-defined]
        wait_until(lambda: feed.open == 0)

    assert [each.number for each in (*first, *rest)] == list(range(1, 19))
    assert rest[-1].kind is EventKind.COMPLETED
    assert (*first, *rest) == told(store)


def test_streams_are_filtered(sqlite_store: Store) -> None:
    wanted, other = (submit_one(sqlite_store, toy(repetitions=1)).id for _ in range(2))
    for claim in execution.claim(sqlite_store, "me", 2):
        run(sqlite_store, claim)
    with served(sqlite_store) as (url, _), Client(url) as client:
        of_one = take(client.events(study=wanted, kind=["probed", "completed"]), 4)
        with pytest.raises(ServiceError, match="there is no study or experiment 'nobody'"):
            next(client.events(study="nobody"))
        with pytest.raises(ServiceError, match="kind"):
            next(client.events(kind=["nonsense"]))

    assert [each.kind.value for each in of_one] == ["probed"] * 3 + ["completed"]
    assert {each.experiment for each in of_one} == {wanted} != {other}


def test_a_stream_resumes_after_the_last_event_that_the_header_names(sqlite_store: Store) -> None:
    for _ in range(5):
        submit_one(sqlite_store, toy())
    with served(sqlite_store) as (url, _), httpx2.Client(base_url=url, timeout=DEADLINE_S) as http:
        with http.stream("GET", "/events?after=1", headers={"Last-Event-ID": "3"}) as answer:
            lines = answer.iter_lines()
            found = [next(lines) for _ in range(3)]
        refused = http.get("/events", headers={"Last-Event-ID": "yesterday"})

    assert answer.headers["content-type"].startswith("text/event-stream")
    assert found[0] == "event: submitted"
    assert json.loads(found[1].removeprefix("data: "))["number"] == 4
    assert found[2] == "id: 4"
    assert refused.status_code == 422


def test_a_stream_that_fell_behind_catches_up_from_the_database(sqlite_store: Store) -> None:
    many = 2 * feeding.PAGE
    with served(sqlite_store) as (url, feed), Client(url) as client:
        feed._recent = type(feed._recent)(maxlen=2)
        id = submit_one(sqlite_store, toy()).id
        stream = client.events()
        first = take(stream, 1)
        with sqlite_store.transaction() as session:
            for _ in range(many):
                note(session, EventKind.EDITED, id)
        found = first + take(stream, many)

    assert [each.number for each in found] == list(range(1, many + 2))


def test_all_streams_together_ask_the_database_once_a_look(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = count()
    page = events.page

    def counted(*given: Any, **named: Any) -> Any:
        next(asked)
        return page(*given, **named)

    monkeypatch.setattr(events, "page", counted)
    with served(sqlite_store) as (url, feed), Client(url) as client:
        submit_one(sqlite_store, toy())
        streams = [client.events() for _ in range(8)]
        for each in streams:
            take(each, 1)
        assert feed.open == 8
        before, began = next(asked), time.monotonic()
        time.sleep(1.0)
        looks, seconds = next(asked) - before, time.monotonic() - began
        submit_one(sqlite_store, toy())
        second = [take(each, 1)[0].number for each in streams]

    assert looks <= seconds / feeding.POLL_S + 2  # eight streams that each ask would be eight times as many
    assert second == [2] * 8


def test_a_stream_that_nobody_takes_from_keeps_no_failed_reader(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    submit_one(sqlite_store, toy())
    page, failing = events.page, [False]

    def fail_once(*asked: object, **named: object) -> EventPage:
        if failing.pop():
            msg = "a mistake of ours"
            raise ValueError(msg)
        return page(*asked, **named)  # type: ignore[arg-type]

    async def follow() -> list[int]:
        feed = EventFeed(sqlite_store, every_s=0.01)
        stalled, resumed = feed.follow(0, WantedEvents()), feed.follow(0, WantedEvents())
        first = await anext(stalled)
        failing.append(True)
        monkeypatch.setattr(events, "page", fail_once)
        while failing == [False, True]:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.05)
        monkeypatch.setattr(events, "page", page)
        second = await asyncio.wait_for(anext(resumed), DEADLINE_S)
        await stalled.aclose()  # type: ignore[attr-defined]
        await resumed.aclose()  # type: ignore[attr-defined]
        return [first.number, second.number]

    assert asyncio.run(follow()) == [1, 1]


def test_a_stream_whose_reader_failed_is_resumed_by_the_client(
    sqlite_store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    submit_one(sqlite_store, toy())
    latest, failing = events.latest, iter([True])

    def fail_once(store: Store) -> int:
        if next(failing, False):
            msg = "a mistake of ours"
            raise ValueError(msg)
        return latest(store)

    monkeypatch.setattr(events, "latest", fail_once)
    with served(sqlite_store) as (url, _), Client(url) as client:
        found = take(client.events(retry_s=0.05), 1)

    assert found[0].number == 1
    assert next(failing, None) is None


def test_an_idle_stream_says_that_it_lives_and_holds_no_transaction(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fastapi.routing._PING_INTERVAL", 0.2)
    with served(store) as (url, _), httpx2.Client(base_url=url, timeout=DEADLINE_S) as http:
        answer = http.send(http.build_request("GET", "/events"), stream=True)
        said, held = next(answer.iter_lines()), store._engine.pool.checkedout()  # type: ignore[attr-defined]
        answer.close()

    assert said == ": ping"
    assert held <= 1  # the look of the moment


def test_a_service_that_stops_ends_its_streams(sqlite_store: Store) -> None:
    ended = threading.Event()

    def follow(url: str) -> None:
        with httpx2.Client(base_url=url, timeout=DEADLINE_S) as http, http.stream("GET", "/events") as answer:
            list(answer.iter_lines())
        ended.set()

    with served(sqlite_store) as (url, feed):
        listening = threading.Thread(target=follow, args=(url,))
        listening.start()
        wait_until(lambda: feed.open == 1)

    assert ended.wait(DEADLINE_S)
    listening.join()


def test_a_client_goes_on_where_it_was_when_the_service_comes_back(sqlite_store: Store) -> None:
    submit_one(sqlite_store, toy())
    with served(sqlite_store) as (url, _):
        client = Client(url)
        stream = client.events(retry_s=0.05)
        found = take(stream, 1)
    submit_one(sqlite_store, toy())

    with ThreadPoolExecutor(1) as pool:
        second = pool.submit(take, stream, 1)  # nothing answers yet
        time.sleep(0.3)
        with served(sqlite_store, httpx2.URL(url).port):
            found += second.result(DEADLINE_S)
            client.close()

    assert [each.number for each in found] == [1, 2]


def test_events_can_be_polled_page_by_page(store: Store) -> None:
    submit_one(store, toy(repetitions=1))
    run(store, *execution.claim(store, "me", 1))  # type: ignore[arg-type]
    with TestClient(create_app(store)) as api:
        pages, after = [], 0
        while (page := api.get("/events/page", params={"after": after, "limit": 5}).json())["items"]:
            pages += page["items"]
            after = page["last"]

    assert [each["number"] for each in pages] == [each.number for each in told(store)]
    assert page["last"] == page["latest"] == len(pages)


def test_a_poll_may_wait_for_what_comes(sqlite_store: Store) -> None:
    id_ = submit_one(sqlite_store, toy()).id
    with served(sqlite_store) as (url, feed), httpx2.Client(base_url=url, timeout=DEADLINE_S) as http:
        asked = {"after": 1, "kind": "cancelled", "wait_s": 60}
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(http.get, "/events/page", params=asked)  # type: ignore[arg-type]
            wait_until(lambda: feed.open == 1)
            cancel(sqlite_store, id_)
            found = answer.result(DEADLINE_S).json()
        nothing = http.get("/events/page", params={"after": 2, "wait_s": 0.1}).json()

    assert [each["kind"] for each in found["items"]] == ["cancelled"]
    assert nothing["items"] == []
    assert nothing["last"] == 2


def test_who_waits_for_a_request_looks_at_the_database_when_something_happened(sqlite_store: Store) -> None:
    id_ = submit_one(sqlite_store, bench()).id
    with (
        served(sqlite_store) as (url, feed),
        httpx2.Client(base_url=url, timeout=DEADLINE_S) as http,
        ThreadPoolExecutor(1) as pool,
    ):
        answer = pool.submit(http.get, "/requests?wait_s=60")
        wait_until(lambda: feed.open == 1)
        compute(sqlite_store)
        (request,) = answer.result(DEADLINE_S).json()["items"]
        taking.take(sqlite_store, request["id"], TakeSpec(operator="o"), FREELY)
        never = pool.submit(http.get, f"/requests?experiment={id_}&conflicts=true&wait_s=60")
        wait_until(lambda: feed.open == 1)
        cancel(sqlite_store, id_)
        ended = never.result(DEADLINE_S).json()

    assert request["experiment"] == id_
    assert ended["items"] == []


def test_events_of_a_study_are_those_of_its_experiments(sqlite_store: Store) -> None:
    from gaplab.schemas.spec import StudySpec

    study = submission.submit(
        sqlite_store, StudySpec.model_validate({"robot": "toy_function", "budget": "smoke", "strategies": ["random"]})
    )
    submit_one(sqlite_store, toy())

    found = told(sqlite_store, WantedEvents(study=study.id))

    assert [each.experiment for each in found] == [study.experiments[0].id]
    assert found[0].study == study.id
    with pytest.raises(NotFound, match="there is no study"):
        events.check(sqlite_store, WantedEvents(study="none"))


@pytest.fixture
def rechecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Callers are checked often."""
    monkeypatch.setattr(http_access, "RECHECK_S", 0.1)


@pytest.mark.usefixtures("rechecked")
def test_a_stream_ends_when_its_token_is_revoked_and_those_of_others_go_on(store: Store) -> None:
    revoked, valid = (access.create_token(store, Role.READER) for _ in range(2))
    submit_one(store, toy())
    with served(store) as (url, feed), Client(url, token=valid.secret) as other:
        kept = other.events()
        take(kept, 1)
        with Client(url, token=revoked.secret) as client:
            stream = client.events(patience_s=0.0)
            take(stream, 1)
            access.revoke_token(store, revoked.token.id)
            with pytest.raises((ServiceError, ServiceUnreachable)):
                next(stream)
            with pytest.raises(ServiceError, match="this token is not valid"):
                next(client.events())
        wait_until(lambda: feed.open == 1)
        submit_one(store, toy())
        assert take(kept, 1)[0].number == 2


@pytest.mark.usefixtures("rechecked")
def test_a_stream_without_a_token_ends_when_tokens_are_needed(sqlite_store: Store) -> None:
    with served(sqlite_store) as (url, feed), httpx2.Client(base_url=url, timeout=DEADLINE_S) as http:
        with http.stream("GET", "/events") as answer:
            wait_until(lambda: feed.open == 1)
            access.create_token(sqlite_store, Role.ADMIN)
            with suppress(httpx2.RemoteProtocolError):
                list(answer.iter_lines())
        wait_until(lambda: feed.open == 0)
        assert http.get("/events").status_code == 401


@pytest.mark.usefixtures("rechecked")
def test_who_waits_for_events_is_refused_when_the_token_is_revoked(sqlite_store: Store) -> None:
    token = access.create_token(sqlite_store, Role.READER)
    headers = {"Authorization": f"Bearer {token.secret}"}
    with (
        served(sqlite_store) as (url, feed),
        httpx2.Client(base_url=url, timeout=DEADLINE_S) as http,
        ThreadPoolExecutor(1) as pool,
    ):
        answer = pool.submit(http.get, "/events/page?wait_s=60", headers=headers)
        wait_until(lambda: feed.open == 1)
        access.revoke_token(sqlite_store, token.token.id)
        refused = answer.result(DEADLINE_S)

    assert refused.status_code == 401
    assert refused.json()["type"] == "urn:gaplab:problem:unauthenticated"


@pytest.mark.usefixtures("rechecked")
def test_a_download_is_broken_off_when_its_token_is_revoked(sqlite_store: Store) -> None:
    token = access.create_token(sqlite_store, Role.READER)
    app = create_app(sqlite_store)

    @app.get("/long")
    async def long() -> StreamingResponse:
        async def parts() -> AsyncIterator[bytes]:
            while True:
                yield b"x" * 100
                await asyncio.sleep(0.02)

        return StreamingResponse(parts(), headers={"Content-Length": str(10**9)})

    headers = {"Authorization": f"Bearer {token.secret}"}
    with serving(app) as url, httpx2.stream("GET", f"{url}/long", headers=headers, timeout=DEADLINE_S) as answer:
        parts = answer.iter_raw()
        assert next(parts)
        access.revoke_token(sqlite_store, token.token.id)
        with pytest.raises(httpx2.RemoteProtocolError):
            list(parts)


@pytest.mark.usefixtures("rechecked")
def test_a_write_under_way_is_answered_by_its_result_also_when_its_token_is_revoked(sqlite_store: Store) -> None:
    token = access.create_token(sqlite_store, Role.RUNNER)
    app, begun = create_app(sqlite_store), threading.Event()

    @app.post("/long")
    def long() -> str:
        begun.set()
        time.sleep(10 * http_access.RECHECK_S)
        return "written"

    headers = {"Authorization": f"Bearer {token.secret}"}
    with serving(app) as url, ThreadPoolExecutor(1) as pool:
        answer = pool.submit(httpx2.post, f"{url}/long", headers=headers, timeout=DEADLINE_S)
        assert begun.wait(DEADLINE_S)
        access.revoke_token(sqlite_store, token.token.id)

    assert (answer.result().status_code, answer.result().json()) == (200, "written")


def test_a_number_beyond_the_latest_event_is_refused_with_both(store: Store) -> None:
    submit_one(store, toy())
    with TestClient(create_app(store)) as api:
        answers = [
            api.get("/events", headers={"Last-Event-ID": "2"}),
            api.get("/events", params={"after": 2}),
            api.get("/events/page", params={"after": 2, "wait_s": 60}),
        ]

    assert [each.status_code for each in answers] == [409] * 3
    assert all(each.json()["detail"].startswith("there is no event 2; the latest is 1.") for each in answers)


@pytest.mark.dialects
def test_streams_end_when_the_database_is_replaced_by_an_earlier_one(store: Store) -> None:
    for _ in range(3):
        submit_one(store, toy())
    with served(store) as (url, _), Client(url) as client:
        stream = client.events()
        take(stream, 3)
        with store.transaction() as session:
            session.execute(delete(EventRow).where(EventRow.number > 1))
            session.execute(update(EventCounterRow).values(latest=1))

        with pytest.raises(ServiceError, match="there is no event 3; the latest is 1"):
            next(stream)
