"""When a supervisor gives up, and when it takes what another has lost; for a release, as a process with its own Ray."""

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest
from ray._common.utils import try_to_create_directory
from sqlalchemy import select

from gaplab.api.process.supervisor_process import Silence, SupervisorProcess
from gaplab.schemas.measurements import TakeSpec
from gaplab.services.experiments import reading
from gaplab.services.experiments.lease_ends import Silences
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import taking
from gaplab.services.running import execution
from gaplab.services.running.pulse import PulsePipe
from gaplab.services.store.database_errors import StoreChanged
from gaplab.services.store.models import SupervisorRow
from gaplab.services.store.session import Store
from gaplab.workers import cluster
from gaplab.workers.cluster import PREFIX, ray_folder
from gaplab.workers.errors import ClusterUnusable, RayGone
from gaplab.workers.ray_tasks import RayTasks
from gaplab.workers.supervisor import Supervisor
from tests.experiments import submit_one, toy
from tests.integration.test_bench import bench, compute, pending
from tests.waiting import wait_until
from tests.without_ray import Here, Stop

DEADLINE_S = 180


def part_of(pid: int, name: str) -> Any:
    """The process of a part of Ray that a process started."""
    for path in Path(f"/proc/{pid}/task").glob("*/children"):
        for child in path.read_text().split():
            if f"/{name}\0".encode() in Path(f"/proc/{child}/cmdline").read_bytes():
                return int(child)
    return None


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "log"


@pytest.fixture
def supervisor(sqlite_url: str, log: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """A supervisor that is ready to work."""
    environment = os.environ | {"GAPLAB_DATABASE_URL": sqlite_url, "GAPLAB_WORKERS": "1", "GAPLAB_LEASE_S": "3"}
    with log.open("wb") as output:
        command = [sys.executable, "-m", "gaplab.workers", "serve"]
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
    wait_until(lambda: b"ready for" in log.read_bytes(), otherwise=log.read_text)
    yield process
    process.kill()
    process.wait()


@pytest.mark.release
@pytest.mark.parametrize("part", ["raylet", "gcs_server"])
def test_a_supervisor_whose_ray_died_ends_so_that_another_is_started(supervisor: Any, log: Path, part: str) -> None:
    os.kill(part_of(supervisor.pid, part), signal.SIGKILL)

    assert supervisor.wait(DEADLINE_S) == 1, log.read_text()
    assert f"Ray died on this machine: its {part} ended" in log.read_text()


@pytest.mark.usefixtures("ray")
def test_a_ray_that_answers_no_more_or_lost_a_part_is_told_from_one_that_works(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    watched = cluster.RayWatch(own=True, clock=lambda: now[0])
    watched.stop()

    assert watched.cores() == 2
    now[0] += cluster.SILENT_S + 1
    with pytest.raises(RayGone, match="does not answer: it was last heard of 16 s ago"):
        watched.cores()
    dead = SimpleNamespace(dead_processes=lambda: [("log_monitor", None), ("raylet", None)])
    monkeypatch.setattr(cluster, "_node", lambda: dead)
    with pytest.raises(RayGone, match="Ray died on this machine: its raylet ended"):
        watched.cores()


def test_a_supervisor_that_waits_for_the_database_says_so_with_its_signs_of_life(sqlite_url: str) -> None:
    file = Path(sqlite_url.removeprefix("sqlite:///"))
    heard, told = os.pipe()
    aside = file.rename(file.with_suffix(".aside"))
    with Store(sqlite_url) as store, os.fdopen(heard) as lines, os.fdopen(told, "w"):
        here = Here(store)
        here.serve(Stop(2), PulsePipe(told))  # type: ignore[arg-type]
        aside.rename(file)
        here.serve(Stop(2), PulsePipe(told))  # type: ignore[arg-type]
        os.write(told, b"end\n")
        found = list(iter(lines.readline, "end\n"))

    (first, second, *_, last) = (each for each in found if each.startswith("."))
    assert (first, last) == (".\n", ".\n")
    assert "the database cannot be used now" in second


def test_ray_keeps_its_files_where_only_their_owner_looks_and_removes_them(tmp_path: Path) -> None:
    with ray_folder() as place:
        try_to_create_directory(place)  # as Ray does
        mode = place.parent.stat().st_mode & 0o777

    assert mode == 0o700
    assert not place.parent.exists()


def test_what_a_killed_supervisor_left_of_its_ray_is_removed_at_the_next_start() -> None:
    with TemporaryDirectory(prefix="g-", dir="/tmp") as made:
        parent = Path(made)
        left, starting = (parent / f"{PREFIX}{name}" for name in ("left", "starting"))
        for folder in (left, starting):
            folder.mkdir()
            (folder / "lock").touch()
        os.utime(left, (0, 0))
        with ray_folder(parent) as place:
            held = place.parent
            os.utime(held, (0, 0))
            with ray_folder(parent):
                found = sorted(parent.iterdir())

    assert left not in found
    assert {held, starting} <= set(found)


def test_a_folder_that_ray_cannot_have_is_told_with_the_remedy() -> None:
    with pytest.raises(ClusterUnusable, match=r"let RAY_TMPDIR name a short one .*: .*No such file"):
        ray_folder(Path("/no/such")).__enter__()


def test_sockets_fit_into_a_folder_with_a_long_path(tmp_path: Path) -> None:
    with ray_folder(tmp_path / ("long" * 20)) as place:
        assert place.parent.parent == Path("/tmp")


@pytest.mark.parametrize("how", ["migrated", "replaced", "restored in place"])
def test_a_supervisor_whose_database_is_changed_under_it_writes_nothing_more_and_ends(
    sqlite_url: str, sqlite_template: Path, how: str
) -> None:
    file = Path(sqlite_url.removeprefix("sqlite:///"))
    store = Store(sqlite_url, pinned=True)
    here = Here(store)
    here.step()
    change(file, sqlite_template, how)

    said = {"migrated": "revision 9999", "replaced": "replaced by another file", "restored in place": "heartbeat"}
    with pytest.raises(StoreChanged, match=said[how]):
        here.serve(Event())
    store.dispose()
    with sqlite3.connect(file) as connection:
        assert connection.execute("SELECT count(*) FROM supervisor").fetchone() == (int(how == "migrated"),)
    connection.close()


def change(file: Path, template: Path, how: str) -> None:
    """Do to a database what people do beside a service that runs."""
    if how == "migrated":
        with sqlite3.connect(file, timeout=60) as connection:
            connection.execute("UPDATE alembic_version SET version_num = '9999'")
        connection.close()
    elif how == "replaced":
        Path(shutil.copy(template, file.with_suffix(".new"))).replace(file)
    else:
        shutil.copyfile(template, file)


@pytest.mark.release
def test_as_a_process_it_then_ends_with_a_sentence(
    supervisor: Any, log: Path, sqlite_store: Store, sqlite_url: str, sqlite_template: Path
) -> None:
    wait_until(lambda: owners(sqlite_store), otherwise=log.read_text)
    change(Path(sqlite_url.removeprefix("sqlite:///")), sqlite_template, "replaced")

    assert supervisor.wait(DEADLINE_S) == 1, log.read_text()
    assert "replaced by another file" in log.read_text().splitlines()[-1]


@pytest.mark.release
def test_a_supervisor_that_is_stopped_is_killed_and_another_goes_on(sqlite_url: str, tmp_path: Path) -> None:
    store = Store(sqlite_url)
    experiment = submit_one(store, toy(repetitions=1)).id
    environment = {"GAPLAB_DATABASE_URL": sqlite_url, "GAPLAB_WORKERS": "1"}
    kept = SupervisorProcess(environment, silence=Silence(told_s=1, killed_s=15), store=store)
    kept.start()
    try:
        wait_until(lambda: owners(store))
        (first,) = owners(store)
        os.kill(int(first.split(":")[1]), signal.SIGSTOP)
        wait_until(lambda: kept.trouble)
        wait_until(lambda: owners(store) - {first})
        wait_until(lambda: reading.read_experiment(store, experiment).state.ended)
    finally:
        kept.stop()

    assert not Path(f"/proc/{first.split(':')[1]}").exists()
    store.dispose()


def owners(store: Store) -> set[str]:
    with store.reading() as session:
        return set(session.scalars(select(SupervisorRow.owner)))


def test_work_goes_to_another_when_its_holder_was_silent_for_as_long_as_a_lease_is_set_to(store: Store) -> None:
    submit_one(store, toy(repetitions=1, strategy="direct"))  # without a sensitivity check
    (claim,) = execution.claim(store, "silent", 1)
    patient, hasty = (Supervisor(store, lambda: 0, RayTasks(), lease_s=lease_s) for lease_s in (600, 0.2))
    time.sleep(0.5)

    patient.step()
    still_held = execution.heartbeat(store, [claim])
    time.sleep(0.5)
    hasty.step()

    assert still_held == (claim,)
    assert execution.heartbeat(store, [claim]) == ()


def test_a_time_in_which_nobody_could_show_a_sign_of_life_ends_no_take(
    sqlite_store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    submit_one(sqlite_store, bench())
    compute(sqlite_store)
    (request,) = pending(sqlite_store)
    taking.take(sqlite_store, request.id, TakeSpec(operator="Ada"), FREELY)
    clock, stop = [0.0], Event()
    supervisor = Supervisor(sqlite_store, lambda: 0, RayTasks(), lease_s=0.0)
    supervisor._takes = Silences(lambda: clock[0])
    supervisor.step()
    assert sqlite_store.file is not None
    aside = sqlite_store.file.rename(sqlite_store.file.with_suffix(".aside"))
    with ThreadPoolExecutor() as pool:
        served = pool.submit(supervisor.serve, stop)
        wait_until(lambda: "waiting: " in caplog.text)
        stop.set()
        served.result()
    aside.rename(sqlite_store.file)

    clock[0] = 3600.0
    supervisor.step()
    after = pending(sqlite_store)[0].state
    clock[0] += 601.0
    supervisor.step()

    assert (after, pending(sqlite_store)[0].state) == ("taken", "open")


def test_what_has_begun_is_never_handed_back_for_what_is_more_urgent(sqlite_store: Store) -> None:
    usual = submit_one(sqlite_store, toy(repetitions=2)).id
    here = Here(sqlite_store)
    for _ in range(3):
        here.step()
    submit_one(sqlite_store, toy(repetitions=1, priority=9))

    here.step()

    attempts = [reading.list_attempts(sqlite_store, usual, number) for number in range(2)]
    assert [[each.ending for each in attempt] for attempt in attempts] == [[None], [None]]
