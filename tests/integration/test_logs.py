"""Logs: one form for people and one for programs, the experiment in each line, and no secret in any."""

import io
import json
import logging
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from gaplab.services import logs
from gaplab.services.store.session import Store
from tests.experiments import submit_one, toy
from tests.waiting import LONGEST_S, wait_until

SECRET = "Zm9vYmFyLTEyMzQ1"
TOKEN = "0123456789abcdef" * 4


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def restored() -> Iterator[None]:
    """The logging of the tests, afterwards."""
    root = logging.getLogger()
    before, level = list(root.handlers), root.level
    yield
    root.handlers, root.level = before, level


def logged(stream: io.StringIO, *given: object, **named: object) -> str:
    logs.configure(stream)
    logging.getLogger("gaplab.test").info(*given, **named)  # type: ignore[arg-type]
    return stream.getvalue()


@pytest.mark.usefixtures("restored")
def test_a_terminal_gets_a_line_that_people_read() -> None:
    line = logged(Terminal(), "continues from step %d", 3, extra={"experiment": "abc", "repetition": 0})

    assert line.endswith(" INFO    gaplab.test abc/0: continues from step 3\n")


@pytest.mark.usefixtures("restored")
def test_anything_else_gets_json() -> None:
    line = logged(io.StringIO(), "on from\nstep %d", 3, extra={"experiment": "abc", "repetition": 0})

    found = json.loads(line)
    assert line.count("\n") == 1
    assert found.pop("at").endswith("+00:00")
    assert found == {
        "level": "info",
        "logger": "gaplab.test",
        "message": "on from\nstep 3",
        "experiment": "abc",
        "repetition": 0,
    }


SECRETIVE = (
    f"Authorization: Bearer {SECRET}",
    f"{{'authorization': 'Bearer {SECRET}'}}",
    f"headers [(b'authorization', b'Bearer {SECRET}')]",
    f"Authorization: {SECRET}",
    f"it sent bearer {SECRET}",
    f"GET /events?after=3&token={SECRET}&kind=probed",
    f"GET /events?access_token={SECRET}",
    f"postgresql://me:{SECRET}@127.0.0.1/gaplab is away",
    f"connection failed: host=db password={SECRET} user=me",
    f"RAY_AUTH_TOKEN={SECRET}",
    f'{{"api_key": "{SECRET}"}}',
    f"GAPLAB_TOKEN: '{SECRET}'",
    f"GET /experiments/gaplab_0a1b2c_{TOKEN} 404",
    f"there is nothing with the id 'gaplab_0a1b2c_{TOKEN[:40]}'",
)


@pytest.mark.usefixtures("restored")
@pytest.mark.parametrize("kind", [io.StringIO, Terminal])
def test_what_looks_like_a_secret_is_left_out(kind: Any) -> None:
    said = {message: logged(kind(), "%s", message) for message in SECRETIVE}

    assert [message for message in said if SECRET in said[message] or TOKEN[:16] in said[message]] == []


@pytest.mark.usefixtures("restored")
def test_a_traceback_has_no_secrets_either() -> None:
    stream = io.StringIO()
    try:
        msg = f"cannot reach postgresql://me:{SECRET}@db/gaplab"
        raise ConnectionError(msg)
    except ConnectionError:
        said = logged(stream, "it failed", exc_info=True)

    assert "ConnectionError" in json.loads(said)["exception"]
    assert SECRET not in said


@pytest.mark.usefixtures("restored")
@pytest.mark.parametrize("kind", [io.StringIO, Terminal])
def test_values_of_a_row_that_postgres_quotes_are_left_out(postgres_store: Store, kind: Any) -> None:
    submit_one(postgres_store, toy(name="peculiar\nname"))
    stream = kind()
    try:
        postgres_store.write(lambda session: session.execute(text("UPDATE experiment SET state = 'NONSENSE'")))
    except IntegrityError:
        logged(stream, "incident", exc_info=True)
    said = stream.getvalue()

    assert "peculiar" not in said
    assert "static_friction" not in said
    assert said.count("DETAIL: …") == 2
    assert "violates check constraint" in said
    assert "The above exception was the direct cause" in said
    assert "[SQL: UPDATE experiment SET state" in said


@pytest.mark.parametrize("before", ["", "  | ", "'duplicate key\\n"])
def test_details_of_postgres_are_left_out_in_groups_and_messages(before: str) -> None:
    said = logs.without_secrets(f"{before}duplicate key\n{before}DETAIL:  Key (name)=({SECRET}) already exists.")

    assert said == f"{before}duplicate key\n{before}DETAIL: …"


@pytest.mark.usefixtures("restored")
def test_what_is_no_secret_is_left_as_it_is() -> None:
    message = "3 tokens of 12; path /experiments/abc?after=3, see http://127.0.0.1:8000/docs, me@example.org"

    assert json.loads(logged(io.StringIO(), "%s", message))["message"] == message


@pytest.mark.parametrize("word", ["a", "token", "password-"])
def test_the_time_for_a_very_long_word_grows_with_its_length_alone(word: str) -> None:
    said = f"GET /{word * (60_000 // len(word))} 404, GAPLAB_TOKEN={SECRET}"
    began = time.process_time()

    found = logs.without_secrets(said)

    assert time.process_time() - began < 10  # as the square of its length it would be minutes
    assert SECRET not in found


def test_a_message_of_any_length_is_logged_in_little_time_and_space() -> None:
    said = logs.without_secrets("unstable; " * 6_000_000 + SECRET)

    assert 1_000_000 < len(said) < 1_000_100
    assert said.endswith("(59,000,016 more characters were not logged)")


def test_the_service_logs_requests_with_their_experiment_and_keeps_what_they_carry_to_itself(tmp_path: Path) -> None:
    """The real process: every line is JSON, probes and assets are left out, and no secret is in any."""
    log = tmp_path / "log"
    script = (
        "import sys; from gaplab.api.process import service; from gaplab.api.process.server import listen\n"
        "taken = listen('127.0.0.1', 0); service.listen = lambda *_: taken\n"
        "open(sys.argv[1], 'w').write(str(taken.getsockname()[1]))\n"
        "from gaplab.services.settings import Settings\n"
        f"service.serve(Settings(database_url='sqlite:///{tmp_path / 'gaplab.db'}'), workers=False)\n"
    )
    place = tmp_path / "port"
    with log.open("wb") as output:
        process = subprocess.Popen([sys.executable, "-c", script, str(place)], stdout=output, stderr=output)
    try:
        wait_until(lambda: place.exists() and place.read_text())
        with httpx2.Client(base_url=f"http://127.0.0.1:{place.read_text()}", timeout=LONGEST_S) as http:
            wait_until(lambda: http.get("/readyz").status_code == 200)
            secret = {"Authorization": f"Bearer {SECRET}", "X-Token": SECRET}
            assert http.get("/assets/dashboard/app.js").status_code == 200
            assert http.get("/experiments/abc", headers=secret).status_code == 401
            assert http.get("/studies/abc").status_code == 404
            assert http.get("/studies", params={"token": SECRET, "x": SECRET}).status_code == 422
            assert http.get(f"/experiments/gaplab_abc_{TOKEN}/curve").status_code == 404
            assert http.get(f"/gaplab%5Fabc%5F{TOKEN}", params={"gaplab_abc_": TOKEN}).status_code == 404
    finally:
        process.terminate()
        process.wait(LONGEST_S)

    said = log.read_text()
    lines = [json.loads(line) for line in said.splitlines()]
    assert SECRET not in said
    assert TOKEN[:16] not in said
    assert lines[0]["message"].startswith("gaplab serves on http://")
    assert [(each["path"], each["status"], each.get("experiment") or each.get("study")) for each in lines[1:]] == [
        ("/experiments/abc", 401, "abc"),
        ("/studies/abc", 404, "abc"),
        ("/studies", 422, None),
        ("/experiments/gaplab_…/curve", 404, "gaplab_…"),
        ("/gaplab_…", 404, None),
    ]
