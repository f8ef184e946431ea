"""Notifications: told at least once, with pauses between attempts, and only to hosts that the owner permits."""

import hmac
import json
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Thread
from time import sleep
from typing import Any

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select, update

from gaplab.api.app import create_app
from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import ExtensionSpec, State, Verb
from gaplab.schemas.notifications import Notification, WebhookSpec
from gaplab.schemas.spec import StudySpec
from gaplab.services import events
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import lifecycle, reading, submission
from gaplab.services.experiments.editing import Deleter, delete
from gaplab.services.experiments.lifecycle import extend
from gaplab.services.notifications import delivery, outbox
from gaplab.services.notifications.delivery import Courier
from gaplab.services.notifications.webhooks import refusal, set_webhook
from gaplab.services.running import execution
from gaplab.services.settings import Notify
from gaplab.services.store.clock import moment
from gaplab.services.store.models import EventRow, NotificationRow, NotifierRow
from gaplab.services.store.session import Store
from tests.experiments import cancel, run, some_log, submit_one, toy
from tests.waiting import wait_until

STUDY = {"strategies": ["random", "known_fit"], "robot": "toy_function", "budget": "smoke", "repetitions": 1}


class Receiver:
    """A real server on loopback that keeps what it is sent, and answers what a test wants."""

    def __init__(self) -> None:
        self.messages: list[dict[str, Any]] = []
        self.headers: list[Any] = []
        self.bodies: list[bytes] = []
        self.status = 200
        self.url = ""


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    kept = Receiver()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            kept.bodies.append(body)
            kept.headers.append(self.headers)
            kept.messages.append(json.loads(body))
            self.send_response(kept.status)
            self.send_header("Location", f"{kept.url}/elsewhere")
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        kept.url = f"http://127.0.0.1:{server.server_address[1]}"
        thread = Thread(target=server.serve_forever)
        thread.start()
        yield kept
        server.shutdown()
        thread.join()


def begun(store: Store, **settings: Any) -> Courier:
    """A courier that has looked at the events once."""
    made = Courier(store, Notify(**settings), "http://lab.example:8000")
    assert made.work()
    return made


def finish(store: Store) -> None:
    while claims := execution.claim(store, "me", 10):
        for claim in claims:
            run(store, claim, some_log(claim.spec.iterations))


def told(store: Store) -> list[tuple[EventKind, dict[str, Any]]]:
    wanted = WantedEvents(kinds=frozenset({EventKind.NOTIFIED, EventKind.NOTIFICATION_FAILED}))
    return [(event.kind, event.body) for event in events.page(store, 0, wanted, limit=100).items]


@contextmanager
def later(store: Store, seconds: float) -> Iterator[None]:
    """As if so much time had passed since the last attempt."""
    row = NotificationRow
    with store.transaction() as session:
        for key in session.scalars(select(row).where(row.next_at.is_not(None))):
            key.next_at = key.next_at - timedelta(seconds=seconds)  # type: ignore[operator]
    yield


def test_a_study_is_told_once_when_its_last_experiment_has_ended(store: Store, receiver: Receiver) -> None:
    bob = begun(store, url=receiver.url)
    study = submission.submit(store, StudySpec.model_validate(STUDY | {"name": "gaits"}))
    cancel(store, study.experiments[0].id)
    bob.work()
    assert receiver.messages == []

    finish(store)
    bob.work()
    bob.work()

    (message,) = receiver.messages
    assert message["text"] == "The study gaits is COMPLETED: 1 CANCELLED, 1 COMPLETED."
    assert (message["subject"], message["state"]) == (study.id, "COMPLETED")
    assert message["url"] == f"http://lab.example:8000/#/studies/{study.id}"
    assert receiver.headers[0]["Gaplab-Notification"] == message["id"]
    assert "Gaplab-Signature" not in receiver.headers[0]
    assert told(store) == [(EventKind.NOTIFIED, {"channel": "webhook", "attempt": 1})]


def test_a_study_that_goes_on_is_told_again(store: Store, receiver: Receiver) -> None:
    bob = begun(store, url=receiver.url)
    alone = submit_one(store, toy(repetitions=1))
    finish(store)
    bob.work()

    extend(store, alone.id, ExtensionSpec(repetitions=2))
    bob.work()
    finish(store)
    bob.work()

    assert [message["subject"] for message in receiver.messages] == [alone.id] * 2
    assert len({message["id"] for message in receiver.messages}) == 2


def test_an_experiment_that_ended_twice_before_anybody_looked_is_told_once(store: Store, receiver: Receiver) -> None:
    bob = begun(store, url=receiver.url)
    alone = submit_one(store, toy(repetitions=1))
    finish(store)
    extend(store, alone.id, ExtensionSpec(repetitions=2))
    finish(store)

    bob.work()

    assert [message["subject"] for message in receiver.messages] == [alone.id]


def test_a_study_whose_last_experiment_was_cancelled_and_deleted_at_once_is_told(
    store: Store, receiver: Receiver
) -> None:
    bob = begun(store, url=receiver.url)
    study = submission.submit(store, StudySpec.model_validate(STUDY))
    first, second = (each.id for each in study.experiments)
    lifecycle.ask(store, second, Verb.PAUSE)
    finish(store)
    bob.work()
    assert receiver.messages == []

    cancel(store, second)
    delete(store, second, Deleter(None, may_delete_all=True))
    bob.work()

    (message,) = receiver.messages
    assert (message["subject"], message["state"]) == (study.id, "COMPLETED")
    assert [each["id"] for each in message["experiments"]] == [first]


@pytest.mark.dialects
def test_what_is_not_delivered_is_tried_again_after_pauses_until_it_is(store: Store, receiver: Receiver) -> None:
    bob = begun(store, url=receiver.url)
    cancel(store, submit_one(store, toy()).id)
    receiver.status = 503

    for pause in (0, 10):
        with later(store, pause):
            bob.work()
            bob.work()
    receiver.status = 200
    with later(store, 60):
        bob.work()

    assert len(receiver.messages) == 3
    assert len({message["id"] for message in receiver.messages}) == 1
    failed = {"channel": "webhook", "reason": "it answered 503"}
    assert told(store) == [
        (EventKind.NOTIFICATION_FAILED, failed | {"attempt": 1, "again_in_s": 10}),
        (EventKind.NOTIFICATION_FAILED, failed | {"attempt": 2, "again_in_s": 60}),
        (EventKind.NOTIFIED, {"channel": "webhook", "attempt": 3}),
    ]


def test_a_notification_is_given_up_after_its_last_pause_or_where_it_is_refused(
    sqlite_store: Store, receiver: Receiver
) -> None:
    bob = begun(sqlite_store, url=receiver.url)
    cancel(sqlite_store, submit_one(sqlite_store, toy()).id)
    receiver.status = 500
    for pause in (0, *outbox.PAUSES_S, 86_400):
        with later(sqlite_store, pause):
            bob.work()
    assert len(receiver.messages) == 1 + len(outbox.PAUSES_S)
    assert told(sqlite_store)[-1][1]["again_in_s"] is None

    for status in (404, 302):
        receiver.messages.clear()
        receiver.status = status
        cancel(sqlite_store, submit_one(sqlite_store, toy()).id)
        bob.work()
        with later(sqlite_store, 86_400):
            bob.work()
        assert len(receiver.messages) == 1


@pytest.mark.dialects
def test_another_process_continues_what_one_that_died_had_begun(store: Store, receiver: Receiver) -> None:
    begun(store, url=receiver.url)
    cancel(store, submit_one(store, toy()).id)
    heir = Courier(store, Notify(url=receiver.url))
    assert not heir.work()
    with store.transaction() as session:
        session.execute(update(NotifierRow).values(until=moment(session) - timedelta(seconds=1)))

    assert heir.work()

    assert len(receiver.messages) == 1


def test_nobody_is_told_of_what_ended_before_or_long_ago(store: Store, receiver: Receiver) -> None:
    cancel(store, submit_one(store, toy()).id)
    bob = begun(store, url=receiver.url)
    cancel(store, submit_one(store, toy()).id)
    with store.transaction() as session:
        session.execute(update(EventRow).values(at=moment(session) - timedelta(days=2)))

    bob.work()

    assert receiver.messages == []


def test_a_database_that_was_restored_tells_what_ends_from_then_on(store: Store, receiver: Receiver) -> None:
    bob = begun(store, url=receiver.url)
    with store.transaction() as session:
        session.execute(update(NotifierRow).values(after=10_000))
    bob.work()
    cancel(store, submit_one(store, toy()).id)

    bob.work()

    assert len(receiver.messages) == 1


def test_a_signature_proves_who_sent_it(sqlite_store: Store, receiver: Receiver) -> None:
    bob = begun(sqlite_store, url=receiver.url, secret="key")
    cancel(sqlite_store, submit_one(sqlite_store, toy()).id)

    bob.work()

    at, digest = (part.partition("=")[2] for part in receiver.headers[0]["Gaplab-Signature"].split(","))
    assert hmac.new(b"key", f"{at}.".encode() + receiver.bodies[0], sha256).hexdigest() == digest


def test_the_owners_command_reads_the_message_and_sees_no_secret(
    sqlite_store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPLAB_NOTIFY_SECRET", "hidden")
    monkeypatch.setenv("PGPASSWORD", "hidden")
    file, script = tmp_path / "said.json", tmp_path / "tell.py"
    script.write_text(
        "import json, os, sys; said = json.load(sys.stdin); said['env'] = {k: v for k, v in os.environ.items() if "
        f"k.startswith('GAPLAB_') or v == 'hidden'}}; open({str(file)!r}, 'w').write(json.dumps(said)); "
        "sys.exit(len(sys.argv) - 2)"
    )
    bob = begun(sqlite_store, command=f"{sys.executable} {script} 'one argument'")
    made = submit_one(sqlite_store, toy(name="$(touch /tmp/never); `id`"))
    cancel(sqlite_store, made.id)

    bob.work()

    said = json.loads(file.read_text())
    assert said["name"] == "$(touch /tmp/never); `id`"
    assert said["env"] == {"GAPLAB_NOTIFICATION": said["id"], "GAPLAB_ID": made.id, "GAPLAB_STATE": "CANCELLED"}
    assert told(sqlite_store)[0][0] is EventKind.NOTIFIED


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("false", "the command ended with code 1"),
        ("/no/such", "be run: No such file"),
    ],
)
def test_a_command_that_fails_is_said(sqlite_store: Store, command: str, reason: str) -> None:
    bob = begun(sqlite_store, command=command)
    cancel(sqlite_store, submit_one(sqlite_store, toy()).id)

    bob.work()

    ((kind, body),) = told(sqlite_store)
    assert kind is EventKind.NOTIFICATION_FAILED
    assert reason in body["reason"]


def test_a_webhook_of_ones_own_is_told_of_that_alone(store: Store, receiver: Receiver) -> None:
    hosts = receiver.url.removeprefix("http://")
    bob = begun(store, hosts=hosts)
    mine, other = (submit_one(store, toy()).id for _ in range(2))
    study = submission.submit(store, StudySpec.model_validate(STUDY))
    shown = set_webhook(store, mine, WebhookSpec(url=f"{receiver.url}/secret"), {hosts})
    set_webhook(store, study.id, WebhookSpec(url=receiver.url), {hosts})

    for id_ in (mine, other):
        cancel(store, id_)
    lifecycle.ask(store, study.id, Verb.CANCEL)
    bob.work()

    assert shown.host == hosts
    assert [message["subject"] for message in receiver.messages] == [mine, study.id]


def test_a_webhook_is_not_told_once_its_host_is_no_longer_permitted(store: Store, receiver: Receiver) -> None:
    hosts = receiver.url.removeprefix("http://")
    made = submit_one(store, toy()).id
    set_webhook(store, made, WebhookSpec(url=receiver.url), {hosts})
    bob = begun(store, hosts="hooks.example.org")
    cancel(store, made)

    bob.work()

    assert receiver.messages == []
    assert "is not permitted" in told(store)[0][1]["reason"]


def test_a_webhook_of_a_user_reaches_no_host_that_the_owner_did_not_list() -> None:
    urls = [
        "http://127.0.0.1/x",
        "http://localhost:8000/experiments",
        "http://[::1]/",
        "http://169.254.169.254/latest/meta-data",
        "http://2130706433/",
        "http://hooks.example.org.evil.example/",
        "http://hooks.example.org:81/",
        "http://hooks.example.org@evil.example/",
        "http://evil.example\\@hooks.example.org/",
        "http://evil.example#hooks.example.org",
        "http://me:secret@hooks.example.org/",
        "file:///etc/passwd",
        "gopher://hooks.example.org/",
        "hooks.example.org",
        "http://",
        "http://[::1",
        "http://hooks.example.org:port/",
    ]

    assert [url for url in urls if not refusal(url, {"hooks.example.org"})] == []
    assert [url for url in urls if not refusal(url, set())] == []


def test_a_permitted_host_is_exact_but_for_case_and_the_usual_port() -> None:
    for url in ("https://hooks.example.org/a", "HTTPS://Hooks.Example.ORG:443/", "http://hooks.example.org:80"):
        assert refusal(url, {"hooks.example.org"}) is None
    assert refusal("http://127.0.0.1:9/", {"127.0.0.1:9"}) is None


def test_the_usual_port_may_be_listed_and_written_or_left_out() -> None:
    for hosts in ("hooks.example.org:443", "Hooks.example.org", "other, hooks.example.org:443"):
        for url in ("https://hooks.example.org/a", "https://HOOKS.example.org:443/a"):
            assert refusal(url, Notify(hosts=hosts).permitted_hosts) is None


def test_a_listed_port_permits_no_other() -> None:
    assert refusal("http://hooks.example.org/", {"hooks.example.org:443"})
    assert refusal("https://hooks.example.org:8443/", {"hooks.example.org:443"})
    assert refusal("http://[::1]/", {"[::1]:80"}) is None


def test_a_webhook_after_the_end_is_refused_until_there_is_another_end(store: Store) -> None:
    notify = Notify(hosts="hooks.example.org")
    webhook = {"url": "https://hooks.example.org/x"}
    study = submission.submit(store, StudySpec.model_validate(STUDY))
    path, one = f"/studies/{study.id}", f"/studies/{study.experiments[0].id}"
    with TestClient(create_app(store, notify=notify)) as api:
        cancel(store, study.experiments[0].id)
        half = api.put(f"{path}/webhook", json=webhook).status_code
        alone = api.put(f"{one}/webhook", json=webhook)
        finish(store)
        ended = api.put(f"{path}/webhook", json=webhook)
        removed = api.delete(f"{path}/webhook").json()
        api.post(f"{path}/extend", json={"repetitions": 2})
        again = api.put(f"{path}/webhook", json=webhook)

    assert (half, alone.status_code, ended.status_code) == (200, 409, 409)
    assert f"one experiment of the study {study.id!r}" in alone.json()["detail"]
    assert f"({study.id}) has ended, so nothing would be sent" in ended.json()["detail"]
    assert removed == {"host": None}
    assert again.json() == {"host": "hooks.example.org"}


def test_without_listed_hosts_a_webhook_is_refused_with_the_setting(sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy()).id
    with TestClient(create_app(sqlite_store)) as api:
        refused = api.put(f"/studies/{made}/webhook", json={"url": "https://hooks.example.org/secret"})
        assert api.get(f"/studies/{made}/webhook").json() == {"host": None}
        assert api.delete(f"/studies/{made}/webhook").json() == {"host": None}

    assert refused.status_code == 422
    assert "GAPLAB_NOTIFY_HOSTS" in refused.json()["errors"][0]["message"]
    assert "secret" not in refused.text


def test_no_notification_changes_a_spec_or_is_shown_with_its_address(sqlite_store: Store) -> None:
    made = submit_one(sqlite_store, toy())
    hosts = {"hooks.example.org"}
    set_webhook(sqlite_store, made.id, WebhookSpec(url="https://hooks.example.org/T0/secret"), hosts)

    assert reading.read_experiment(sqlite_store, made.id) == made
    with pytest.raises(InvalidSpec):
        set_webhook(sqlite_store, made.id, WebhookSpec(url="https://other.example/"), hosts)


def test_the_courier_works_in_the_background_until_it_is_stopped(sqlite_store: Store, receiver: Receiver) -> None:
    with Courier(sqlite_store, Notify(url=receiver.url), "") as bob:
        assert bob.work()
        cancel(sqlite_store, submit_one(sqlite_store, toy()).id)
        wait_until(lambda: told(sqlite_store))
    assert len(receiver.messages) == 1


@contextmanager
def dripping() -> Iterator[str]:
    """The address of a server that sends a byte of its header each tenth of a second, for a minute."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(60.0)

        def drip() -> None:
            connection, _ = server.accept()
            with connection, suppress(OSError):
                connection.sendall(b"HTTP/1.1 200 OK\r\nX-Slow: ")
                for _ in range(600):
                    connection.sendall(b"x")
                    sleep(0.1)
                connection.sendall(b"\r\nContent-Length: 0\r\n\r\n")

        thread = Thread(target=drip)
        thread.start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}/"
        thread.join()


def message() -> Notification:
    about: Any = {"id": "1-x", "subject": "x", "name": "x", "state": State.FAILED, "text": "x"}
    return Notification(**about, experiments=(), ended_at=datetime(2026, 1, 1, tzinfo=UTC))


def test_a_server_that_sends_byte_by_byte_has_no_more_time() -> None:
    with dripping() as url:
        outcome = delivery.post(url, message(), within_s=0.5)

    assert outcome.failure == "it did not answer within 0.5 s"


def test_a_host_that_is_looked_up_for_long_has_no_more_time(monkeypatch: pytest.MonkeyPatch) -> None:
    found = Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: found.wait(60.0))

    outcome = delivery.post("http://hooks.example.org/", message(), within_s=0.5)

    assert not found.is_set()
    found.set()
    assert outcome.failure == "it did not answer within 0.5 s"


def test_a_turn_is_longer_than_a_delivery_that_begins_in_it(store: Store) -> None:
    bob = begun(store, command="true")
    with store.transaction() as session:
        session.get_one(NotifierRow, 1).until = moment(session) + timedelta(seconds=delivery.COMMAND_S + 1)

    bob.work()

    with store.reading() as session:
        until = session.get_one(NotifierRow, 1).until
        assert until is not None
        assert (until - moment(session)).total_seconds() > 1.25 * delivery.COMMAND_S


def test_a_setting_that_is_none_is_named_without_secrets() -> None:
    wrong = (("URL", "ftp://x"), ("HOSTS", "a b;c"), ("URL", "http://"), ("COMMAND", '"unclosed'), ("COMMAND", " "))
    for variable, value in wrong:
        with pytest.raises(ValueError, match=f"GAPLAB_NOTIFY_{variable} is"):
            Notify.from_environment({f"GAPLAB_NOTIFY_{variable}": value})
