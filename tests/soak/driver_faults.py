"""Faults of real drivers: two share a robot, and the one that moves it loses its take in the middle of a run."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack, suppress
from itertools import count
from pathlib import Path
from typing import Any

from gaplab.services import access
from gaplab.services.store.session import Store
from tests.proxy import Proxy
from tests.soak import driver
from tests.soak.bench_faults import WAIT_S
from tests.soak.hardware_faults import commands
from tests.soak.operators import PHYSICAL, QUADRUPED
from tests.soak.plugin_faults import submitted
from tests.soak.stage import until

LEASE_S = 2
"""Of a take, without a sign of life."""

HANDOVER_S = 20.0
"""For how long a fault waits for another driver to take over."""

_numbers = count()


class Driven:
    """`gaplab drive` for one experiment, with a token and a network of its own."""

    def __init__(self, stage: Any, experiment: str, robot: str) -> None:
        self.path, self.token, self.network = f"/studies/{experiment}", stage.new_token(), Proxy(stage.port)
        journal = stage.journal.with_name(f"{experiment}.journal")
        command = [sys.executable, "-m", "gaplab", "drive", experiment, "--driver", driver.__file__]
        command += ["--journal", str(journal), "--lease-s", str(LEASE_S)]
        told = {driver.JOURNAL: str(stage.journal), driver.ROBOT: robot, "GAPLAB_TOKEN": self.token.secret}
        told["GAPLAB_URL"] = f"http://127.0.0.1:{self.network.port}"
        with journal.with_suffix(".log").open("ab") as log:
            self.process = subprocess.Popen(command, env=os.environ | told, stdout=log, stderr=log)

    def close(self) -> None:
        """End it in order, if it can."""
        self.process.send_signal(signal.SIGCONT)
        self.process.terminate()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(5.0)
        self.process.kill()
        self.process.wait()
        self.network.close()


def _revoke(stage: Any, victim: Driven) -> None:
    with Store(stage.database.url) as store:
        until(lambda: access.revoke_token(store, victim.token.token.id), HANDOVER_S)


KINDS: dict[str, Callable[[Any, Driven], Any]] = {
    "paused": lambda stage, victim: victim.process.send_signal(signal.SIGSTOP),
    "cut off": lambda stage, victim: victim.network.hang(for_good=True),
    "revoked": _revoke,
    "called off": lambda stage, victim: stage.history.ask(stage.http, "cancel", "POST", f"{victim.path}/cancel"),
}


def inflicting(kind: str) -> Any:
    """Let two drivers share a robot, each for an experiment, and take the take from whichever moves it first."""

    def inflict(stage: Any) -> bool:
        robot = f"robot-{next(_numbers)}"
        spec = QUADRUPED | {"strategy": "simulated_fit", "reality": PHYSICAL | {"bench": robot}}
        with ExitStack() as stack:
            stack.enter_context(stage.clients.reserved(robot))
            drivers = dict[int, Driven]()
            for seed in range(2):
                experiment = submitted(stage, spec | {"seed": seed}, f"driver {kind}")
                if experiment is None:
                    return False
                driven = Driven(stage, experiment, robot)
                stack.callback(driven.close)
                drivers[driven.process.pid] = driven
            if not until(lambda: _movers(stage.journal, robot), WAIT_S):
                return False
            (first, *_) = _movers(stage.journal, robot)
            KINDS[kind](stage, drivers[first])
            until(lambda: len(_movers(stage.journal, robot)) > 1, HANDOVER_S)
            drivers[first].process.send_signal(signal.SIGCONT)
            until(lambda: len(_movers(stage.journal, robot, done=True) - {first}), HANDOVER_S)
            return True

    return inflict


def _movers(journal: Path, robot: str, *, done: bool = False) -> Any:
    """The processes that moved a robot; only those that came to the end of a run, if so asked."""
    given = [each for each in commands(journal, robot) if each.what != "stop" and not (done and each.what == "moves")]
    return {int(each.drive.partition(".")[0]) for each in given}
