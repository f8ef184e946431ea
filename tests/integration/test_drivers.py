"""`gaplab drive` with drivers that do what they must not, and with takes that end: the robot is stopped first."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from fastapi import FastAPI

from gaplab.schemas.access import Role
from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.measurements import MeasurementSpec, TakeSpec
from gaplab.services import access
from gaplab.services.experiments import lifecycle
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import answering, taking
from gaplab.services.store.models import RequestRow
from gaplab.services.store.queries.requests import withdraw
from gaplab.services.store.session import Store
from tests.commands import Gaplab, served
from tests.experiments import submit_one, toy
from tests.integration.test_bench import fall_silent, pending
from tests.integration.test_bench_safety import ask, requests_of, submit
from tests.waiting import wait_until

RUNS: list[Callable[[Any], float]] = []
"""What the next runs of the driver do; one too many breaks it, and ends the command."""

DRIVER = """
from threading import Event
from tests.integration import test_drivers

class Driver:
    stopped = Event()
    def connect(self): pass
    def run(self, motion): return test_drivers.RUNS.pop(0)(self)
    def stop(self):
        print("stopped", flush=True)
        self.stopped.set()
"""

MOVING = """
import pathlib, time
from threading import Event

class Driver:
    stopped = Event()
    def connect(self): pass
    def run(self, motion):
        with open("commands", "a") as commands:
            while not self.stopped.wait(0.01):
                print("command", file=commands, flush=True)
            print("stopped", file=commands, flush=True)
        self.stopped.clear()
        return 0.5
    def stop(self):
        self.stopped.set()
"""


@pytest.mark.parametrize(
    ("run", "said"),
    [
        ("return 'fast'", "it must return the fitness"),
        ("return float('nan')", "raise MeasurementFailed"),
        ("1/0", "ZeroDivisionError"),
        ("self.stopped.wait()", "took more than 0.5 s"),
    ],
)
def test_a_driver_that_answers_nonsense_or_nothing_is_stopped_and_sends_nothing(
    sqlite_store: Store, gaplab: Gaplab, tmp_path: Path, run: str, said: str
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)
    driver = tmp_path / "driver.py"
    driver.write_text(
        "import threading\n"
        "class Driver:\n"
        "    stopped = threading.Event()\n"
        "    def connect(self): pass\n"
        f"    def run(self, motion): {run}\n"
        "    def stop(self):\n"
        "        print('stopped', flush=True)\n"
        "        self.stopped.set()\n"
    )

    driven = gaplab("drive", id_, "--driver", str(driver), "--limit-s", "0.5")

    assert driven.code == 1
    assert said in driven.err
    assert "stopped" in driven.out
    (request,) = pending(sqlite_store)
    assert (request.state, request.answers) == ("open", ())


@pytest.fixture
def driver(tmp_path: Path) -> str:
    """The file of a driver that does what `RUNS` says."""
    RUNS.clear()
    file = tmp_path / "driver.py"
    file.write_text(DRIVER)
    return str(file)


def until_stopped(
    then: Callable[[], object], afterwards: Callable[[], object] = lambda: None
) -> Callable[[Any], float]:
    """A run that never ends by itself, in which something happens."""

    def run(driver: Any) -> float:
        then()
        driver.stopped.wait()
        afterwards()
        return 0.5

    return run


def test_a_driver_whose_experiment_is_cancelled_stops_its_robot_and_lets_the_bench_go(
    sqlite_store: Store, gaplab: Gaplab, driver: str
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)
    RUNS.append(until_stopped(lambda: lifecycle.ask(sqlite_store, id_, Verb.CANCEL)))

    driven = gaplab("drive", id_, "--driver", driver, "--limit-s", "60", "--lease-s", "1")

    assert (driven.code, driven.out.count("stopped\n")) == (0, 2)  # the second at the end
    assert "stopped: take 1 of request" in driven.out
    (request,) = requests_of(sqlite_store, id_)
    assert (request.state, request.answers) == ("withdrawn", ())
    with sqlite_store.reading() as session:
        assert session.get_one(RequestRow, request.id).held is None


def test_a_driver_whose_token_is_revoked_stops_its_robot(sqlite_store: Store, gaplab: Gaplab, driver: str) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)
    token = access.create_token(sqlite_store, Role.RUNNER, "driver")
    RUNS.append(until_stopped(lambda: access.revoke_token(sqlite_store, token.token.id)))

    driven = gaplab("drive", id_, "--driver", driver, "--limit-s", "60", "--lease-s", "1", GAPLAB_TOKEN=token.secret)

    assert (driven.code, requests_of(sqlite_store, id_)[0].answers) == (8, ())
    assert "stopped: " in driven.out


def test_a_driver_without_a_network_stops_its_robot_within_its_lease_and_goes_on_later(
    service: tuple[FastAPI, str], url: str, sqlite_store: Store, gaplab: Gaplab, driver: str
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)
    whole = Event()
    whole.set()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        while not whole.is_set():
            await asyncio.sleep(0.05)
        await service[0](scope, receive, send)

    RUNS.append(until_stopped(whole.clear, whole.set))
    with served(app) as network:
        driven = gaplab("drive", id_, "--driver", driver, "--limit-s", "60", "--lease-s", "1", GAPLAB_URL=network)

    assert "stopped: no heartbeat has reached the service for 0.8 s" in driven.out
    assert (driven.code, "the driver's run raised IndexError" in driven.err) == (1, True)
    assert requests_of(sqlite_store, id_)[0].answers == ()


def test_a_driver_goes_on_after_a_request_that_is_not_wanted_any_more(
    sqlite_store: Store, gaplab: Gaplab, driver: str
) -> None:
    reality = {"kind": "physical", "probes": "each"}
    id_ = submit_one(sqlite_store, toy(robot="quadruped", engine="mujoco", repetitions=2, reality=reality)).id
    ask(sqlite_store)
    ask(sqlite_store)
    first, second = pending(sqlite_store)

    def corrected(driver: Any) -> float:  # a correction withdraws what followed
        sqlite_store.write(withdraw, RequestRow.id == first.id)
        return 0.5

    RUNS.append(corrected)
    driven = gaplab("drive", id_, "--driver", driver)

    assert f"not taken: request {first.id} is no longer needed" in driven.out
    assert f"{second.id}: repetition 1" in driven.out


@contextmanager
def driving(url: str, experiment: str, folder: Path) -> Iterator["subprocess.Popen[str]"]:
    """`gaplab drive` as a process, in a run that ends when it is stopped, and its commands in a file."""
    (folder / "driver.py").write_text(MOVING)
    command = [sys.executable, "-m", "gaplab", "drive", experiment, "--driver", "driver.py", "--lease-s", "1"]
    started = subprocess.Popen(
        command,
        cwd=folder,
        env=os.environ | {"GAPLAB_URL": url},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        wait_until(lambda: commands(folder) or started.poll())
        yield started
    finally:
        started.kill()
        started.communicate()


def commands(folder: Path) -> list[str]:
    """What the robot was told."""
    file = folder / "commands"
    return file.read_text().split() if file.exists() else []


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_a_driver_stops_its_robot_and_lets_it_go_when_a_terminal_closes_or_a_machine_shuts_down(
    sqlite_store: Store, url: str, tmp_path: Path, number: signal.Signals
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)

    with driving(url, id_, tmp_path) as driver:
        driver.send_signal(number)
        driver.wait()

    assert (driver.returncode, commands(tmp_path)[-1]) == (130, "stopped")
    assert requests_of(sqlite_store, id_)[0].state == "open"


def test_a_driver_that_wakes_beside_another_stops_its_robot_and_no_measurement_of_both_counts(
    sqlite_store: Store, url: str, tmp_path: Path
) -> None:
    id_ = submit(sqlite_store, "warn")
    ask(sqlite_store)
    with driving(url, id_, tmp_path) as driver:
        driver.send_signal(signal.SIGSTOP)
        wait_until(lambda: fall_silent(sqlite_store))
        (request,) = pending(sqlite_store)
        take = taking.take(sqlite_store, request.id, TakeSpec(operator="Bo"), FREELY).answer.takes
        time.sleep(1.0)  # longer than the lease

        driver.send_signal(signal.SIGCONT)

        wait_until(lambda: pending(sqlite_store)[0].takes > take)
        told = commands(tmp_path)
        answer = answering.answer(sqlite_store, request.id, MeasurementSpec(values=(0.5,), take=take), FREELY).answer
        assert (take, told[-1], answer.state) == (2, "stopped", "conflict")
        assert (commands(tmp_path), driver.poll()) == (told, None)  # it waits for its turn
