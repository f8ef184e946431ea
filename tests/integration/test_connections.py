"""Clients that send half a request, or take no answer: they are disconnected, and others are served meanwhile."""

import asyncio
import logging
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI, Request

from gaplab.api.app import create_app
from gaplab.api.http.limits import SPARE, RequestLimit, most_requests
from gaplab.api.process.server import Server, TimedConnection, listen
from gaplab.services.logs import Repeats
from gaplab.services.settings import Limits
from gaplab.services.store.session import Store
from tests.waiting import LONGEST_S, wait_until

DEADLINE_S = 120.0
HALF = b"GET /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: "
FILES = 128


def sent(port: int, content: bytes) -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", port), timeout=DEADLINE_S)
    connection.sendall(content)
    return connection


def is_alive(url: str) -> bool:
    try:
        return httpx2.get(f"{url}/livez", timeout=5).status_code == 200
    except httpx2.HTTPError:
        return False


def rest(connection: socket.socket) -> bytes:
    """What the service still sends before it closes the connection."""
    found = b""
    try:
        while part := connection.recv(65536):
            found += part
    except ConnectionResetError:
        pass
    return found


@pytest.mark.release
def test_more_half_sent_requests_than_files_leave_the_service_alive_and_its_log_small(
    tmp_path: Path, sqlite_url: str
) -> None:
    """The real process, which may open few files."""
    log = tmp_path / "log"
    script = (
        "import os, resource, sys\n"
        f"resource.setrlimit(resource.RLIMIT_NOFILE, ({FILES}, {FILES}))\n"
        "from gaplab.api.process import server; from gaplab.services import logs\n"
        "from gaplab.services.settings import Settings\n"
        "logs.configure(); listener = server.listen('127.0.0.1', 0)\n"
        "print(listener.getsockname()[1], flush=True)\n"
        f"server.serve_api(Settings(database_url={sqlite_url!r}), listener)\n"
    )
    with log.open("wb") as output:
        process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=output, text=True)
    try:
        assert process.stdout is not None
        port = int(process.stdout.readline())
        url = f"http://127.0.0.1:{port}"
        wait_until(lambda: is_alive(url))

        with ExitStack() as half_sent:
            for _ in range(4 * FILES):
                half_sent.enter_context(sent(port, HALF))
            wait_until(lambda: is_alive(url))
            wait_until(lambda: httpx2.get(f"{url}/readyz", timeout=DEADLINE_S).status_code == 200)

        for _ in range(5):
            wait_until(lambda: is_alive(url))
    finally:
        process.terminate()
        process.communicate(timeout=LONGEST_S)
    assert log.stat().st_size < 100_000


@contextmanager
def serving(
    app: FastAPI, most: int = 100, connection: type[TimedConnection] = TimedConnection, **times: float
) -> Iterator[int]:
    """The port of a service of this app in a thread, whose connections have other times."""

    class Feed:
        def close(self) -> None:
            """Close nothing."""

    app.state.feed = app.state.rollout_process = Feed()
    app.state.connections = most
    listener = listen("127.0.0.1", 0)
    served = Server(app, type("Connection", (connection,), times))
    thread = threading.Thread(target=served.run, args=([listener],))
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        served.should_exit = True
        thread.join(DEADLINE_S)


@pytest.fixture
def app() -> FastAPI:
    """An app that takes a body, answers at once, and answers with more than a connection holds."""
    app = FastAPI()

    @app.get("/livez")
    async def live() -> str:
        return "ok"

    @app.post("/body")
    async def body(request: Request) -> int:
        return sum([len(part) async for part in request.stream()])

    @app.get("/large")
    async def large() -> str:
        return "x" * 50_000_000

    @app.get("/slow")
    async def slow() -> str:
        await asyncio.sleep(1.0)
        return "late"

    return app


@pytest.mark.parametrize(
    ("content", "answer"),
    [
        (b"", b""),
        (HALF, b"HTTP/1.1 408 Request Timeout"),
        (b"POST /body HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\nhalf", b""),
        (b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n" + HALF, b"HTTP/1.1 200 OK"),
    ],
    ids=["nothing", "half a head", "half a body", "half of a second request"],
)
def test_half_a_request_ends_its_connection(app: FastAPI, content: bytes, answer: bytes) -> None:
    with serving(app, request_s=0.3) as port, sent(port, content) as connection:
        assert rest(connection).startswith(answer)


def test_no_part_of_an_answer_waits_until_the_client_has_confirmed_another(app: FastAPI) -> None:
    """Else every answer on a kept connection takes 40 ms."""
    at_once = []

    class Observed(TimedConnection):
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            at_once.append(transport.get_extra_info("socket").getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))

    with serving(app, connection=Observed) as port:
        assert httpx2.get(f"http://127.0.0.1:{port}/livez").status_code == 200
    assert all(at_once)
    assert at_once


def test_half_an_archive_is_no_incident(sqlite_store: Store, caplog: pytest.LogCaptureFixture) -> None:
    head = b"POST /import HTTP/1.1\r\nHost: x\r\nContent-Type: application/zip\r\nContent-Length: 99\r\n\r\n"
    with serving(create_app(sqlite_store), request_s=0.3) as port, sent(port, head + b"PK") as connection:
        assert rest(connection) == b""

    assert "incident" not in caplog.text
    assert "Exception" not in caplog.text


def test_requests_that_go_on_are_served_however_slow_the_service(app: FastAPI) -> None:
    slow = serving(app, request_s=0.3, slowest_bytes_per_s=1.0)
    with slow as port, httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=DEADLINE_S) as http:

        def parts() -> Iterator[bytes]:
            for _ in range(5):
                yield b"x" * 100
                time.sleep(0.2)

        assert http.post("/body", content=parts()).json() == 500
        assert http.get("/slow").json() == "late"


def test_a_client_that_takes_no_answer_is_disconnected(app: FastAPI) -> None:
    with serving(app, take_s=0.3) as port, sent(port, b"GET /large HTTP/1.1\r\nHost: x\r\n\r\n") as connection:
        time.sleep(1.5)

        assert 0 < len(rest(connection)) < 50_000_000


def test_a_new_connection_takes_the_place_of_the_one_that_waited_longest(app: FastAPI) -> None:
    with serving(app, most=3) as port, ExitStack() as stack:
        waiting = [stack.enter_context(sent(port, HALF)) for _ in range(4)]

        assert rest(waiting[0]) == b""
        waiting[3].sendall(b"\r\n\r\n")
        assert waiting[3].recv(65536).startswith(b"HTTP/1.1 200 OK")


def test_an_idle_connection_outlives_that_of_a_client_so_that_none_closes_while_it_is_used(sqlite_store: Store) -> None:
    assert Server(create_app(sqlite_store)).config.timeout_keep_alive > 2 * httpx2.Limits().keepalive_expiry


def test_beyond_the_most_requests_at_once_all_but_the_sign_of_life_are_refused(app: FastAPI) -> None:
    app.add_middleware(RequestLimit, most=1)
    with serving(app) as port, httpx2.Client(base_url=f"http://127.0.0.1:{port}", timeout=DEADLINE_S) as http:
        with sent(port, b"POST /body HTTP/1.1\r\nHost: x\r\nContent-Length: 9\r\n\r\nhalf") as served:
            refused = wait_until(lambda: answer if (answer := http.get("/slow")).status_code == 503 else None)
            alive = http.get("/livez")
            served.sendall(b"rest!")
            assert served.recv(65536).startswith(b"HTTP/1.1 200 OK")
        room = http.get("/slow")

    assert refused.json()["type"] == "urn:gaplab:problem:busy"
    assert "GAPLAB_MAX_REQUESTS" in refused.json()["detail"]
    assert refused.headers["retry-after"]
    assert (alive.status_code, room.status_code) == (200, 200)


def test_the_files_that_may_be_open_limit_the_requests() -> None:
    for files, most in [(1024, 512 - SPARE), (resource.RLIM_INFINITY, 1_000), (2**20, 1_000), (8, 1)]:
        assert most_requests(Limits(), files) == most


def test_what_a_library_repeats_is_logged_five_times_a_minute_and_counted() -> None:
    now = [0.0]
    repeats = Repeats(lambda: now[0])

    def logged(name: str, message: str, *given: object) -> str | None:
        record = logging.LogRecord(name, logging.ERROR, "", 0, message, given, None)
        return record.getMessage() if repeats.filter(record) else None

    first = [logged("asyncio", "no file left\nsocket: %d", number) for number in range(100)]
    ours = [logged("gaplab.supervisor", "waiting") for _ in range(100)]
    now[0] += 61
    later = [logged("asyncio", "no file left\nsocket: %d", 0) for _ in range(2)]

    assert sum(each is not None for each in first) == 5
    assert None not in ours
    assert later == [
        "no file left\nsocket: 0 (95 more like this were not logged)",
        "no file left\nsocket: 0",
    ]
