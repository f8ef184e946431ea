"""One soak on one database: faults, then peace, then the check."""

import random
import shutil
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx2

from gaplab.services.plugins import loading
from gaplab.services.store.session import Store
from tests.soak import checker, faults, import_faults, misbehaviour
from tests.soak.clients import Clients
from tests.soak.evidence import checks_under_way, gather
from tests.soak.history import History
from tests.soak.misbehaviour import at_fault
from tests.soak.stage import Stage, until

LEASE_S = 3
"""In production it is 30 s; nothing depends on it but how long a soak takes."""

RECOVERY_S = 180
"""After which what has not come back by itself never will."""

STUCK_S = 300
"""In peace, and without a fault: what has not ended by then is stuck."""


@dataclass
class Outcome:
    """Of a soak.

    Attributes:
        recoveries: seconds from the end of a volley until all was well again, by the faults that were in it.
        violations: what the service did not keep.
    """

    database: str
    recoveries: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    violations: list[str] = field(default_factory=list)
    acknowledged: int = 0
    unanswered: int = 0
    experiments: int = 0
    at_fault: int = 0
    steps: int = 0
    claims: int = 0
    given_up: int = 0
    begun: float = field(default_factory=time.monotonic)
    measured_s: float = float("-inf")

    @property
    def faults(self) -> Any:
        return sum(map(len, self.recoveries.values()))

    def measure(self, stage: Any, say: Any, every_s: float = 300.0) -> None:
        """Say how much memory the service has, if that is due, as a row of a table."""
        now = time.monotonic() - self.begun
        if now - self.measured_s >= every_s:
            self.measured_s, (each, largest) = now, stage.memory()
            sizes = f"{len(each)} processes | {sum(each):.0f} MB | largest {max(each):.0f} MB: {largest}"
            say(f"| {self.database} | {now / 60:.0f} min | {self.faults} faults | {sizes} |")


def soak(
    folder: Path,
    kind: Any,
    number: Any,
    seed: Any,
    at_once: Any = 4,
    say: Any = lambda sentence: None,
    *,
    misbehaviours: Any = misbehaviour.HARMLESS,
) -> Any:
    """Run so many faults on a service in this folder, and check it; the evidence stays there.

    Args:
        folder: empty.
        kind: Sqlite or Postgres.
        number: of faults.
        seed: of their order and of what clients do.
        at_once: faults that the service has to bear together.
        say: is told of every volley.
        misbehaviours: kinds of strategies that do harm.
    """
    folder = Path(folder)
    plugins = Path(shutil.copytree(misbehaviour.FOLDER, folder / "plugins", ignore=shutil.ignore_patterns("__*")))
    loading.load((misbehaviour.FOLDER,))  # the checker computes with the strategy that behaves
    database = kind(folder)
    history, store = History(folder / "history.jsonl"), Store(database.url)
    outcome, stage = Outcome(database.name), Stage(folder, database, LEASE_S, plugins, history)
    kinds = faults.faults(database, misbehaviours)
    clients = Clients(stage.http, history, seed)
    try:
        stage.start()
        stage.clients = clients
        clients.start()
        _attack(stage, store, outcome, number, faults.volleys(kinds, random.Random(seed), at_once), say)
        clients.stop()
        _peace(clients, store, outcome)
        outcome.measure(stage, say, 0.0)
        outcome.violations += [*stage.complaints, *import_faults.broken_lists(stage.http), *stage.stop()]
        _check(history.records(), gather(store, database, stage.journal), outcome)
    finally:
        clients.stop()
        stage.kill()
        store.dispose()
        database.close()
        loading.load(())
    return outcome


def _attack(stage: Any, store: Store, outcome: Any, number: Any, volleys: Any, say: Any) -> None:
    faults.recovered(stage, store, RECOVERY_S)  # from the start
    while outcome.faults < number:
        outcome.measure(stage, say)
        hit = faults.strike(stage, next(volleys)[: number - outcome.faults])
        seconds = faults.recovered(stage, store, RECOVERY_S)
        after = "never well again" if seconds is None else f"well again after {seconds:.1f} s"
        say(f"{stage.database.name} {outcome.faults + len(hit)}: {', '.join(hit)}: {after}")
        if seconds is None:
            outcome.violations.append(f"not well {RECOVERY_S} s after {', '.join(hit)}: {stage.processes()}")
        for name in hit:
            outcome.recoveries[name].append(RECOVERY_S if seconds is None else seconds)


def _peace(clients: Any, store: Store, outcome: Any) -> None:
    def quiet() -> Any:
        try:
            clients.wake()
            return not clients.under_way() and not checks_under_way(store)
        except (httpx2.HTTPError, ValueError):
            return False

    if not until(quiet, STUCK_S, every_s=1.0):
        outcome.violations.append(f"not at rest {STUCK_S} s after the last fault")


def _check(history: Any, evidence: Any, outcome: Any) -> None:
    outcome.violations += checker.violations(history, evidence)
    outcome.acknowledged = sum(each.acknowledged for each in history if each.verb != "read")
    outcome.unanswered = sum(each.status is None for each in history if each.verb != "read")
    outcome.experiments = len(evidence.experiments)
    outcome.at_fault = sum(at_fault(each.spec) for each in evidence.experiments)
    repetitions = [each for one in evidence.experiments for each in one.repetitions if not at_fault(one.spec)]
    outcome.steps = sum(each.steps for each in repetitions)
    outcome.claims = sum(each.epoch for each in repetitions)
    outcome.given_up = sum((each.error or "").startswith(checker.GIVEN_UP) for each in repetitions)
