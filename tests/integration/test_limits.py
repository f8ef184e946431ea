"""Limits: beyond each there is a problem that names it, and what is within is let in."""

import asyncio
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi import Request
from fastapi.responses import JSONResponse
from fastapi.testclient import TestClient
from sqlalchemy import update
from starlette.types import Message, Receive, Scope, Send

from gaplab.api.app import create_app
from gaplab.api.http.limits import BodyLimit, Streams
from gaplab.schemas.access import Role
from gaplab.services.access import create_token
from gaplab.services.core.errors import LimitReached
from gaplab.services.experiments import reading
from gaplab.services.running import execution
from gaplab.services.settings import Limits, Settings, variable_of
from gaplab.services.store.models import AttachmentRow, RepetitionRow
from gaplab.services.store.queries.attachments import UNNAMED_LIVE
from gaplab.services.store.session import Store
from gaplab.services.waiting_line import WaitingLine
from tests.commands import served as served_by
from tests.experiments import run
from tests.integration.test_bench import compute
from tests.waiting import LONGEST_S, wait_until

TOY = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "iterations": 2, "repetitions": 3}
STUDY = {
    "strategies": ["random", "direct", "known_fit"],
    "robot": "toy_function",
    "budget": "smoke",
    "repetitions": 3,
    "iterations": 2,
}


def served(store: Store, **limits: int) -> TestClient:
    return TestClient(create_app(store, limits=Limits(**limits)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("limits", "path", "body", "name"),
    [
        ({"iterations": 1}, "/experiments", TOY, "iterations"),
        ({"repetitions": 2}, "/experiments", TOY, "repetitions"),
        ({"repetitions": 8}, "/studies", STUDY, "repetitions"),
    ],
)
def test_a_submission_that_asks_for_too_much_is_refused_for_good(
    sqlite_store: Store, limits: dict[str, int], path: str, body: dict[str, object], name: str
) -> None:
    answer = served(sqlite_store, **limits).post(path, json=body)

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == f"/{name}"
    assert variable_of(name) in answer.json()["detail"]
    assert served(sqlite_store, **{name: limits[name] + 1}).post(path, json=body).status_code == 202


@pytest.mark.parametrize("name", ["experiments", "experiments_per_token", "rollouts", "rollouts_per_token"])
def test_what_is_full_is_full_until_something_ends(store: Store, name: str) -> None:
    api = served(store, **{name: 1 if name.startswith("experiments") else 4_000})
    answers = [api.post("/experiments", json=TOY) for _ in range(30)]
    taken = [each.json()["id"] for each in answers if each.status_code == 202]
    refused = [each for each in answers if each.status_code != 202]

    api.post(f"/studies/{taken[0]}/cancel")
    room = api.post("/experiments", json=TOY)

    assert refused
    assert {each.status_code for each in refused} == {429}
    assert variable_of(name) in refused[0].json()["detail"]
    assert refused[0].json()["type"] == "urn:gaplab:problem:limit-reached"
    assert int(refused[0].headers["retry-after"]) > 0
    assert room.status_code == 202
    assert api.post("/experiments", json=TOY).status_code == 429


def test_what_is_extended_stays_within_the_limits_too(sqlite_store: Store) -> None:
    made = served(sqlite_store).post("/experiments", json=TOY).json()["id"]
    for claim in execution.claim(sqlite_store, "me", 9):
        run(sqlite_store, claim)

    refused = served(sqlite_store, repetitions=4).post(f"/studies/{made}/extend", json={"repetitions": 5})
    full = served(sqlite_store, rollouts=1).post(f"/studies/{made}/extend", json={"repetitions": 4})
    extended = served(sqlite_store, repetitions=4).post(f"/studies/{made}/extend", json={"repetitions": 4})

    assert refused.status_code == 422
    assert variable_of("repetitions") in refused.json()["detail"]
    assert full.status_code == 429
    assert extended.status_code == 202


def test_what_is_extended_counts_with_the_rollouts_that_it_has_left(sqlite_store: Store) -> None:
    made = served(sqlite_store).post("/experiments", json=TOY | {"repetitions": 3}).json()
    for claim in execution.claim(sqlite_store, "me", 9):
        run(sqlite_store, claim)
    progress = reading.read_experiment(sqlite_store, made["id"]).progress
    each, done = progress.rollouts // 3, progress.rollouts_done + progress.rollouts_saved
    left = 4 * each - done

    def extended(rollouts: int) -> int:
        path = f"/studies/{made['id']}/extend"
        return served(sqlite_store, rollouts=rollouts).post(path, json={"repetitions": 4}).status_code

    assert done > 0
    assert (extended(left - 1), extended(left)) == (429, 202)


def test_one_token_cannot_take_the_room_of_another(store: Store) -> None:
    api = served(store, experiments_per_token=1, experiments=2)
    first, second, third = ({"Authorization": f"Bearer {create_token(store, Role.RUNNER).secret}"} for _ in range(3))

    found = [api.post("/experiments", json=TOY, headers=each).status_code for each in (first, first, second, third)]

    assert found == [202, 429, 202, 429]


def test_a_study_is_let_in_whole_or_not_at_all(store: Store) -> None:
    api = served(store, experiments=2)

    assert api.post("/studies", json=STUDY).status_code == 429
    assert api.get("/studies").json()["items"] == []


@pytest.mark.dialects
def test_submissions_at_the_same_moment_do_not_pass_a_limit_together(store: Store) -> None:
    api = served(store, experiments=3)

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: api.post("/experiments", json=TOY).status_code, range(8)))

    assert sorted(found) == [202] * 3 + [429] * 5


def test_a_body_has_the_limit_that_is_set(sqlite_store: Store) -> None:
    api = served(sqlite_store, body_bytes=100)

    refused = api.post("/experiments", json=TOY | {"name": "x" * 100})

    assert refused.status_code == 413
    assert "GAPLAB_MAX_BODY_BYTES" in refused.json()["detail"]


def test_bodies_that_do_not_end_share_the_room_for_large_ones() -> None:
    """Two clients of three send all but the end of their body."""
    large, small = b"x" * 100_000, b"x" * 1_000

    async def read(scope: Scope, receive: Receive, send: Send) -> None:
        await JSONResponse(len(await Request(scope, receive).body()))(scope, receive, send)

    async def status(api: BodyLimit, *parts: bytes, leaves: asyncio.Event | None = None) -> Any:
        """The status of the answer to these parts; with `leaves`, the body does not end, and the client leaves then."""
        messages = [{"type": "http.request", "body": each, "more_body": True} for each in parts]
        told: list[Message] = []

        async def receive() -> Message:
            if messages:
                return messages.pop(0)
            if leaves is None:
                return {"type": "http.request", "body": b"", "more_body": False}
            await leaves.wait()
            return {"type": "http.disconnect"}

        async def send(message: Message) -> None:
            told.append(message)

        scope = {"type": "http", "method": "POST", "path": "/attachments", "headers": []}
        await api(scope, receive, send)
        return [each["status"] for each in told if "status" in each]

    async def found() -> Any:
        api, leaves = BodyLimit(read, most_bytes=1, most_at_once=250_000), asyncio.Event()
        waiting = [asyncio.create_task(status(api, large, leaves=leaves)) for _ in range(2)]
        await asyncio.sleep(0)
        during = [await status(api, large), await status(api, small)]
        leaves.set()
        return during, [await each for each in waiting], await status(api, large)

    assert asyncio.run(found()) == ([[503], [200]], [[], []], [200])


def test_an_export_waits_for_its_turn_and_is_refused_if_that_does_not_come(sqlite_store: Store) -> None:
    app = create_app(sqlite_store)
    app.state.exports = WaitingLine("exports", longest_s=0.0)
    api = TestClient(app)
    path = f"/studies/{api.post('/experiments', json=TOY).json()['id']}/export"

    with app.state.exports.turn():
        refused = api.get(path)

    assert refused.status_code == 429
    assert api.get(path).status_code == 200


def test_who_waits_for_a_lock_on_the_database_holds_up_no_reader(sqlite_store: Store) -> None:
    """Another process writes; more requests write than the service has threads."""
    assert sqlite_store.file
    app = create_app(sqlite_store)
    with (
        served_by(app) as url,
        httpx2.Client(base_url=url, timeout=LONGEST_S) as http,
        closing(sqlite3.connect(sqlite_store.file, isolation_level=None)) as other,
        ThreadPoolExecutor(60) as pool,
    ):
        other.execute("BEGIN IMMEDIATE")
        writes = [pool.submit(http.post, "/experiments", json=TOY) for _ in range(60)]
        wait_until(lambda: "are writing, and others wait" in http.get("/readyz").text)
        read = http.get("/studies")
        other.execute("ROLLBACK")
        for each in writes:
            each.result()
        room = http.post("/experiments", json=TOY)

    assert read.json()["items"] == []
    assert room.status_code == 202


def test_a_database_that_does_not_answer_is_told_at_once(sqlite_store: Store) -> None:
    assert sqlite_store.file
    with closing(sqlite3.connect(sqlite_store.file, isolation_level=None)) as other:
        other.execute("BEGIN EXCLUSIVE")
        told = TestClient(create_app(sqlite_store)).get("/readyz")

    assert told.status_code == 503
    assert "has not answered for 3 s" in told.json()["detail"]


def test_streams_are_limited_for_a_token_and_in_all_and_a_closed_one_makes_room() -> None:
    streams = Streams(Limits(streams_per_token=2, streams=3))
    with streams.open("a"), streams.open("a"):
        with pytest.raises(LimitReached, match="GAPLAB_MAX_STREAMS_PER_TOKEN"), streams.open("a"):
            pass
        with (
            streams.open("b"),
            pytest.raises(LimitReached, match=r"GAPLAB_MAX_STREAMS\)"),
            streams.open(None),
        ):
            pass
        with streams.open(None):
            pass

    with streams.open("a"), streams.open("a"):
        pass


@pytest.mark.parametrize("path", ["/events/page", "/requests"])
def test_who_waits_for_news_has_a_stream_open_and_who_does_not_wait_has_none(sqlite_store: Store, path: str) -> None:
    app = create_app(sqlite_store, limits=Limits(streams_per_token=1))
    api = TestClient(app)
    wait = {"wait_s": 0.05}

    with app.state.streams.open(None):
        refused = api.get(path, params=wait)
        at_once = api.get(path)
    room = api.get(path, params=wait), api.get(path, params=wait)

    assert refused.status_code == 429
    assert "GAPLAB_MAX_STREAMS_PER_TOKEN" in refused.json()["detail"]
    assert refused.headers["retry-after"]
    assert [at_once.status_code, *(each.status_code for each in room)] == [200, 200, 200]


def test_limits_come_from_the_environment() -> None:
    assert Limits.from_environment({}) == Limits()
    assert Limits.from_environment({"GAPLAB_MAX_ROLLOUTS_PER_TOKEN": "7"}) == Limits(rollouts_per_token=7)
    with pytest.raises(ValueError, match="GAPLAB_MAX_STREAMS is 'many'"):
        Limits.from_environment({"GAPLAB_MAX_STREAMS": "many"})


def test_what_is_set_to_nothing_is_not_set() -> None:
    names = ("DATABASE_URL", "RAY_ADDRESS", "WORKERS", "LEASE_S", "HOST", "PORT", "URL", "TOKEN")

    assert Settings.from_environment({f"GAPLAB_{each}": "" for each in names}) == Settings()


def test_the_service_is_looked_for_where_it_binds() -> None:
    for host, url in (("::1", "http://[::1]:9000"), ("127.0.0.2", "http://127.0.0.2:9000"), ("x", "http://x:9000")):
        assert Settings.from_environment({"GAPLAB_HOST": host, "GAPLAB_PORT": "9000"}).url == url


@pytest.mark.parametrize(
    ("host", "url"), [("0.0.0.0", "http://127.0.0.1:8600"), ("::", "http://[::1]:8600"), ("lab", "http://lab:8600")]
)
def test_the_address_of_the_service_follows_host_and_port_unless_it_is_set(host: str, url: str) -> None:
    followed = Settings().bound(host, 8600)
    given = Settings.from_environment({"GAPLAB_URL": "https://gaplab.example.org"}).bound(host, 8600)

    assert (followed.host, followed.port, followed.url) == (host, 8600, url)
    assert (given.host, given.port, given.url) == (host, 8600, "https://gaplab.example.org")
    assert Settings().bound(None, None) == Settings()


def test_an_address_without_http_is_refused() -> None:
    for address in ("nonsense", "ftp://127.0.0.1", "gaplab.example.org:8000", "http://"):
        with pytest.raises(ValueError, match=f"GAPLAB_URL is '{address}'; it must be an http or https address"):
            Settings.from_environment({"GAPLAB_URL": address})


def test_a_number_that_is_none_is_said_with_its_variable() -> None:
    with pytest.raises(ValueError, match="GAPLAB_PORT is '8²'"):
        Settings.from_environment({"GAPLAB_PORT": "8²"})


def test_every_limit_is_documented_with_its_default() -> None:
    text = (Path(__file__).parents[2] / "docs" / "security.md").read_text()

    for name, field in Limits.model_fields.items():
        assert f"| `{variable_of(name)}` | {field.default:,} |" in text


def test_the_papers_whole_figure_is_let_in(sqlite_store: Store) -> None:
    answer = served(sqlite_store).post("/studies?confirm_cost=true", json={"direct_repetitions": 100})

    assert answer.status_code == 202


@pytest.mark.parametrize(
    ("path", "body"),
    [("/studies", {}), ("/experiments", {"strategy": "simulated_fit", "repetitions": 4_000})],
)
def test_what_takes_thousands_of_core_hours_needs_a_confirmation(
    sqlite_store: Store, path: str, body: dict[str, object]
) -> None:
    api = served(sqlite_store)
    hours = api.post("/studies/estimate", json=body).json()["core_seconds"] / 3_600

    refused, stored = api.post(path, json=body, headers={"Idempotency-Key": "k"}), api.get("/studies").json()["items"]
    let_in = api.post(f"{path}?confirm_cost=true", json=body, headers={"Idempotency-Key": "k"})

    assert (refused.status_code, refused.json()["type"], stored) == (422, "urn:gaplab:problem:cost-unconfirmed", [])
    (error,) = refused.json()["errors"]
    assert (error["pointer"], error["value"], error["permitted"]) == ("confirm_cost", False, "true")
    assert f"about {hours:,.0f} core-hours" in error["message"]
    assert "1,000 (GAPLAB_MAX_UNCONFIRMED_CORE_HOURS)" in error["message"]
    assert let_in.status_code == 202


def test_a_bench_that_nearly_has_the_name_of_another_is_asked_about_once(sqlite_store: Store) -> None:
    api = served(sqlite_store)

    def submit(bench: str, query: str = "") -> Any:
        answer = api.post(f"/experiments{query}", json=TOY | {"reality": {"kind": "physical", "bench": bench}})
        compute(sqlite_store)
        return answer

    known = [submit(name).status_code for name in ("table 1", "table 2", "TABLE 1", "yard")]
    refused, let_in, again = submit("tabel 1"), submit("tabel 1", "?confirm_cost=true"), submit("tabel 1")

    assert known == [202] * 4
    (error,) = refused.json()["errors"]
    assert error["message"].startswith("the bench 'tabel 1' is new, and 'table 1' is known; if they are two robots, ")
    assert (error["pointer"], let_in.status_code, again.status_code) == ("confirm_cost", 202, 202)


@pytest.mark.parametrize("body", [{"engine": "mujoco"}, {"budget": "desk", "direct_repetitions": 100}])
def test_what_a_lab_computes_in_days_needs_none(sqlite_store: Store, body: dict[str, object]) -> None:
    assert served(sqlite_store).post("/studies", json=body).status_code == 202


def test_an_extension_is_confirmed_by_what_it_adds(sqlite_store: Store) -> None:
    made = served(sqlite_store).post("/experiments", json=TOY).json()["id"]
    for claim in execution.claim(sqlite_store, "me", 9):
        run(sqlite_store, claim)
    minutes = update(RepetitionRow).values(seconds=RepetitionRow.rollouts_done * 60.0)  # one for each rollout
    sqlite_store.write(lambda session: session.execute(minutes))
    progress = reading.read_experiment(sqlite_store, made).progress
    each, done = progress.rollouts // 3, progress.rollouts_done + progress.rollouts_saved
    api, path = served(sqlite_store, unconfirmed_core_hours=(6 * each - done) // 60), f"/studies/{made}/extend"

    refused = api.post(path, json={"repetitions": 7})
    extended = api.post(f"{path}?confirm_cost=true", json={"repetitions": 7})

    assert refused.json()["type"] == "urn:gaplab:problem:cost-unconfirmed"
    assert f"about {(7 * each - done) / 60:.0f} core-hours" in refused.json()["detail"]
    assert extended.status_code == 202


def test_files_that_no_answer_names_have_a_limit_that_frees_itself(store: Store) -> None:
    api = TestClient(create_app(store, limits=Limits(unnamed_attachment_bytes=10)))

    first, refused, again = (
        api.post("/attachments?name=a", content=each) for each in (b"1234567", b"1234", b"1234567")
    )
    old = update(AttachmentRow).values(created_at=datetime.now(UTC) - UNNAMED_LIVE - timedelta(minutes=1))
    store.write(lambda session: session.execute(old))
    let_in = api.post("/attachments?name=a", content=b"4321")  # of a greater hash

    assert [each.status_code for each in (first, refused, again, let_in)] == [201, 429, 201, 201]
    assert refused.json()["type"] == "urn:gaplab:problem:limit-reached"
    assert "11 bytes" in refused.json()["detail"]
    assert "at most 10 are permitted (GAPLAB_MAX_UNNAMED_ATTACHMENT_BYTES)" in refused.json()["detail"]
    assert api.get(f"/attachments/{first.json()['id']}").status_code == 404


@pytest.mark.dialects
def test_files_that_are_sent_at_once_keep_the_limit(store: Store) -> None:
    api = TestClient(create_app(store, limits=Limits(unnamed_attachment_bytes=30)))

    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda n: api.post("/attachments?name=a", content=b"x" * 9 + bytes([n])), range(8)))

    assert sorted(each.status_code for each in answers) == [201] * 3 + [429] * 5
