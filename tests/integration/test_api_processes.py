"""The processes of the service: what is started is ended, what dies is started again, and trouble is a sentence."""

import json
import os
import re
import shlex
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from gaplab.api.clients.client import Client
from gaplab.api.clients.errors import ServiceUnreachable
from gaplab.api.process import local_service
from gaplab.api.process.child_process import end, start
from gaplab.api.process.errors import CommandError
from gaplab.api.process.local_service import start_service
from gaplab.api.process.server import listen, require_token
from gaplab.api.process.service import environment_of, migrate
from gaplab.api.process.supervisor_process import SupervisorProcess
from gaplab.schemas.access import Role
from gaplab.services.access import Unauthenticated, create_token, revoke_token
from gaplab.services.settings import Settings
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store
from tests.fakes import CAREFUL
from tests.ports import free_port
from tests.processes import processes_with
from tests.waiting import LONGEST_S, wait_until


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().split(")")[1].split()[0] != "Z"
    except OSError:
        return False


FREED = """
from signal import SIGTERM, raise_signal

class Freed:
    def __del__(self):
        raise_signal(SIGTERM)

Freed()
"""

LINGERING = "from threading import Event, Thread\n\nThread(target=Event().wait).start()\n"


def serve(environment: dict[str, str], *arguments: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-m", "gaplab", "serve", *arguments],
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def ended(environment: dict[str, str], *arguments: str) -> tuple[int, str]:
    """Return the exit code and the output of a service that does not start; one that does is ended, and fails."""
    process = serve(environment, *arguments)
    try:
        said, _ = process.communicate(timeout=LONGEST_S)
    finally:
        process.terminate()
        process.wait(LONGEST_S)
    return process.returncode, said


@pytest.fixture
def port() -> int:
    return free_port()


def test_a_signal_that_comes_while_python_frees_an_object_ends_the_service(
    tmp_path: Path, sqlite_url: str, port: int
) -> None:
    (tmp_path / "freed.py").write_text(FREED)
    environment = {"GAPLAB_DATABASE_URL": sqlite_url, "GAPLAB_PLUGINS": str(tmp_path), "GAPLAB_PORT": str(port)}

    code, said = ended(environment, "--no-workers")

    assert "Exception ignored" in said
    assert code == 0


@pytest.mark.parametrize(
    ("arguments", "ready"),
    [
        (("gaplab", "serve", "--no-workers"), "gaplab serves on"),
        (("gaplab.api",), "warning"),
        pytest.param(("gaplab.workers", "serve"), "ready for", marks=pytest.mark.release),
    ],
)
def test_a_thread_of_a_plug_in_keeps_no_process(
    tmp_path: Path, sqlite_url: str, port: int, arguments: tuple[str, ...], ready: str
) -> None:
    (tmp_path / "lingering.py").write_text(LINGERING)
    (tmp_path / "unused.txt").touch()  # which is warned of
    environment = {"GAPLAB_DATABASE_URL": sqlite_url, "GAPLAB_PLUGINS": str(tmp_path), "GAPLAB_PORT": str(port)}
    command = [sys.executable, "-m", *arguments]
    with subprocess.Popen(command, env=os.environ | environment, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert any(ready in line for line in process.stderr)
        process.terminate()

        try:
            assert process.wait(LONGEST_S) == 0
        finally:
            process.kill()


@pytest.mark.parametrize(
    "how",
    [signal.SIGHUP, *(pytest.param(each, marks=pytest.mark.release) for each in (signal.SIGTERM, signal.SIGINT))],
)
def test_a_service_migrates_its_database_answers_and_ends_in_order(
    tmp_path: Path, port: int, how: signal.Signals
) -> None:
    environment = {"GAPLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'new.db'}"}
    process = serve(environment, "--no-workers", "--port", str(port))

    with Client(f"http://127.0.0.1:{port}") as client:
        wait_until(client.ready)
    process.send_signal(how)
    said, _ = process.communicate(timeout=LONGEST_S)

    assert process.returncode == 0, said
    assert json.loads(said)["message"].startswith(f"gaplab serves on http://127.0.0.1:{port}")
    assert said.count("\n") == 1
    assert (tmp_path / "new.db").stat().st_size > 0


def test_a_service_of_an_author_starts_again_when_a_plug_in_file_changes(
    tmp_path: Path, sqlite_url: str, port: int
) -> None:
    environment = {"GAPLAB_DATABASE_URL": sqlite_url, "GAPLAB_PLUGINS": str(tmp_path)}
    process = serve(environment, "--no-workers", "--reload", "--port", str(port))

    with Client(f"http://127.0.0.1:{port}") as client:
        wait_until(client.ready)
        assert "careful" not in names_of(client)
        (tmp_path / "careful.py").write_text(CAREFUL)
        wait_until(lambda: client.ready() and "careful" in names_of(client))
    process.terminate()
    said, _ = process.communicate(timeout=LONGEST_S)

    assert process.returncode == 0, said
    assert said.count("gaplab serves on") == 2
    assert processes_with(f"GAPLAB_PORT={port}") == []


def names_of(client: Client) -> set[str]:
    """The strategies of a service that may be ending; none if it does not answer."""
    with suppress(ServiceUnreachable):
        return {each.name for each in client.catalogue().strategies}
    return set()


def test_without_a_folder_there_is_nothing_to_start_again_for() -> None:
    code, said = ended({"GAPLAB_PLUGINS": ""}, "--reload")

    assert (code, "--reload watches the folders of GAPLAB_PLUGINS" in said) == (1, True)


@pytest.mark.release
def test_links_of_notifications_have_the_port_of_the_command(
    tmp_path: Path, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("GAPLAB_URL", raising=False)
    told = tmp_path / "told"
    environment = {
        "GAPLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'new.db'}",
        "GAPLAB_NOTIFY_COMMAND": shlex.join(["sh", "-c", f"cat > {told}.part && mv {told}.part {told}"]),
    }
    process = serve(environment, "--no-workers", "--port", str(port))
    try:
        with Client(f"http://127.0.0.1:{port}") as client:
            wait_until(client.ready)
            wait_until(lambda: seen(tmp_path / "new.db"))
            spec = {"strategy": "random", "robot": "toy_function", "budget": "smoke", "repetitions": 1}
            made = client.submit(spec).id
            client.cancel(made)
            wait_until(told.exists)
    finally:
        process.terminate()
        process.communicate(timeout=LONGEST_S)

    assert json.loads(told.read_text())["url"] == f"http://127.0.0.1:{port}/#/studies/{made}"


def seen(file: Path) -> bool:
    """Return whether notifications are on: what ended before is not told."""
    connection = sqlite3.connect(file, timeout=30)
    found = connection.execute("SELECT after FROM notifier").fetchone()
    connection.close()
    return found is not None and found[0] is not None


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("GAPLAB_NOTIFY_COMMAND", '"unclosed'),
        pytest.param("GAPLAB_MAX_STREAMS", "many", marks=pytest.mark.release),
        pytest.param("GAPLAB_NOTIFY_URL", "ftp://x", marks=pytest.mark.release),
    ],
)
def test_a_setting_that_is_none_ends_the_start_before_the_database_is_touched(
    tmp_path: Path, port: int, variable: str, value: str
) -> None:
    environment = {"GAPLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'new.db'}", variable: value}

    code, said = ended(environment, "--port", str(port))

    assert code == 1
    assert re.fullmatch(rf"gaplab: {variable} is [^\n]+\n", said)
    assert list(tmp_path.iterdir()) == []


def test_a_service_on_a_database_of_a_later_version_says_what_to_do(sqlite_url: str, sqlite_store: Store) -> None:
    with sqlite_store.transaction() as session:
        session.connection().exec_driver_sql("UPDATE alembic_version SET version_num = '0099'")

    with pytest.raises(StoreUnavailable, match=r"revision 0099.* use the version of gaplab that it is of") as refused:
        migrate(sqlite_url)

    assert "\n" not in str(refused.value)


def test_a_supervisor_on_no_database_of_a_known_kind_ends_with_a_sentence() -> None:
    run = subprocess.run(
        [sys.executable, "-m", "gaplab.workers", "serve"],
        env=os.environ | {"GAPLAB_DATABASE_URL": "mysql://me:secret@127.0.0.1/x"},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )

    assert run.returncode == 1
    assert re.fullmatch(r"the database [^\n]+\n", run.stderr)
    assert "secret" not in run.stderr


@pytest.mark.parametrize("module", ["gaplab", pytest.param("gaplab.api", marks=pytest.mark.release)])
def test_beyond_loopback_a_service_without_a_token_does_not_start_and_says_how_to_make_one(
    tmp_path: Path, port: int, module: str
) -> None:
    environment = {"GAPLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'new.db'}", "GAPLAB_HOST": "0.0.0.0"}
    migrate(environment["GAPLAB_DATABASE_URL"])
    arguments = ["serve", "--no-workers"] if module == "gaplab" else []

    refused = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        env=os.environ | environment | {"GAPLAB_PORT": str(port)},
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )

    assert refused.returncode == 1
    assert refused.stderr.startswith("gaplab: 0.0.0.0 is reachable from other machines")
    assert "gaplab token create" in refused.stderr
    assert refused.stderr.count("\n") == 1


def test_a_host_is_refused_until_a_token_lets_someone_in(store_url: str) -> None:
    store, strangers = Store(store_url), Settings(database_url=store_url, host="0.0.0.0")
    with pytest.raises(Unauthenticated, match="token create"):
        require_token(strangers)
    token = create_token(store, Role.READER).token.id

    require_token(strangers)
    revoke_token(store, token)

    with pytest.raises(Unauthenticated):
        require_token(strangers)
    require_token(Settings(database_url=store_url))
    store.dispose()


def test_a_port_that_is_taken_is_a_sentence(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        process = serve({"GAPLAB_DATABASE_URL": f"sqlite:///{tmp_path / 'x.db'}"}, "--port", str(port))
        said, _ = process.communicate(timeout=LONGEST_S)

    assert process.returncode == 1
    assert re.fullmatch(rf"gaplab: cannot serve on 127\.0\.0\.1:{port}: address already in use\n", said)


@pytest.mark.parametrize(
    ("host", "port"), [("no-such-host.invalid", 9999), ("127.0.0.1", 99999), ("127.0.0.1", -1), ("::1::", 1)]
)
def test_an_address_that_is_none_is_a_sentence(host: str, port: int) -> None:
    with pytest.raises(CommandError, match=f"^cannot serve on {host}:{port}: [^\n]+$"):
        listen(host, port)


@pytest.mark.parametrize(
    "url", ["sqlite:////no/such/folder/x.db", "postgresql+psycopg://me:secret@127.0.0.1:9/x", "nonsense", "mysql://x/y"]
)
def test_a_database_that_cannot_be_migrated_is_a_sentence_without_its_password(url: str) -> None:
    with pytest.raises(StoreUnavailable) as refused:
        migrate(url)

    assert "\n" not in str(refused.value)
    assert "secret" not in str(refused.value)


def test_a_supervisor_that_dies_is_started_again_and_it_is_said(caplog: pytest.LogCaptureFixture) -> None:
    supervisor = SupervisorProcess({}, module="this", longest_pause_s=0.1)

    supervisor.start()
    wait_until(lambda: caplog.text.count("another starts") >= 2)
    supervisor.stop()
    assert "ended by itself (exit code 0)" in caplog.text


def test_a_supervisor_is_ended_when_its_process_is_stopped(tmp_path: Path) -> None:
    supervisor = SupervisorProcess({"PYTHONPATH": str(tmp_path)}, module="sleeper")
    note = tmp_path / "pid"
    (tmp_path / "sleeper.py").write_text(
        f"import os, time; open({str(note)!r}, 'w').write(str(os.getpid())); time.sleep(60)"
    )

    supervisor.start()
    wait_until(lambda: note.exists() and note.read_text())
    supervisor.stop()

    assert not alive(int(note.read_text()))


def test_a_child_ends_when_its_parent_is_killed_outright(tmp_path: Path) -> None:
    note = tmp_path / "pid"
    script = (
        "import time; from gaplab.api.process.child_process import start; "
        f"open({str(note)!r}, 'w').write(str(start('http.server', '0', '--bind', '127.0.0.1').pid)); time.sleep(60)"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_until(lambda: note.exists() and note.read_text())
    time.sleep(1.0)

    parent.kill()
    parent.wait()

    wait_until(lambda: not alive(int(note.read_text())))


def test_a_child_that_does_not_end_when_asked_is_killed(tmp_path: Path) -> None:
    (tmp_path / "stubborn.py").write_text(
        "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('ready', flush=True); time.sleep(60)"
    )
    log = tmp_path / "log"
    with log.open("wb") as output:
        process = start("stubborn", environment={"PYTHONPATH": str(tmp_path)}, log=output)
    wait_until(lambda: b"ready" in log.read_bytes())

    end(process, patience_s=0.2)

    assert process.returncode == -signal.SIGKILL


def test_children_read_the_same_settings() -> None:
    settings = Settings(database_url="sqlite:///x.db", ray_address="auto", workers=3, host="0.0.0.0", port=99)

    assert environment_of(settings) == {
        "GAPLAB_DATABASE_URL": "sqlite:///x.db",
        "GAPLAB_RAY_ADDRESS": "auto",
        "GAPLAB_WORKERS": "3",
        "GAPLAB_LEASE_S": "30",
        "GAPLAB_ROLLOUT_LIMIT_S": "60",
        "GAPLAB_STEP_LIMIT_S": "604800",
        "GAPLAB_HOST": "0.0.0.0",
        "GAPLAB_PORT": "99",
    }


def test_a_client_of_ones_own_service_shows_the_token_of_the_environment_only_if_there_are_tokens(
    sqlite_url: str, sqlite_store: Store
) -> None:
    without = local_service.token_of(sqlite_url)
    create_token(sqlite_store, Role.READER)

    assert (without, local_service.token_of(sqlite_url)) == ("", None)


@pytest.mark.release
def test_the_token_of_another_service_is_not_shown_to_one_of_ones_own(
    sqlite_url: str, sqlite_store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPLAB_TOKEN", f"gaplab_elsewhere_{'0' * 64}")
    with start_service(sqlite_url, tmp_path / "log", workers=False) as client:
        found = client.studies()

    monkeypatch.setenv("GAPLAB_TOKEN", create_token(sqlite_store, Role.READER).secret)
    monkeypatch.setattr(local_service, "LARGEST_LOG", 0)
    with start_service(sqlite_url, tmp_path / "log", workers=False) as client:
        assert client.studies() == found
    assert (tmp_path / "log.old").exists()  # it was too large
