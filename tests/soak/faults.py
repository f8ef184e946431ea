"""The faults, and how the service is waited for after them."""

import random
import signal
import time
from collections import namedtuple
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import httpx2

from gaplab.services.store.session import Store
from tests.soak import bench_faults, driver_faults, hardware_faults, import_faults, misbehaviour, plugin_faults, witness
from tests.soak.databases import CLOCK_JUMP
from tests.soak.stage import PAST_THE_LEASE, send, until

DISK_S = 3.0
"""For how long the disk is full, or slow."""

EARLIER_S = 3.0
"""Age of the state that is restored."""

DATABASE_S = 30.0
"""For how long a fault waits for a database that another fault has made unavailable."""

Fault = namedtuple("Fault", "name inflict alone", defaults=(False,))


def _kill(role: Any) -> Any:
    def inflict(stage: Any) -> bool:
        return _signal(stage, role, signal.SIGKILL) is not None

    return Fault(f"SIGKILL {role}", inflict)


def _pause(role: Any) -> Any:
    def inflict(stage: Any) -> bool:
        pid = _signal(stage, role, signal.SIGSTOP)
        if pid is None:
            return False
        try:
            time.sleep(PAST_THE_LEASE * stage.lease_s)
        finally:
            send(pid, signal.SIGCONT)
        return True

    return Fault(f"SIGSTOP {role}", inflict)


def _signal(stage: Any, role: Any, number: Any) -> Any:
    """Send it to one of those that play the role; its id, or None if there is none to be found in a while."""
    found = []
    until(lambda: found.extend(stage.of(role)) or found, 20)  # type: ignore[func-returns-value]
    pid = random.choice(found) if found else None
    return pid if pid and send(pid, number) else None


def _fill(stage: Any) -> bool:
    """Fill the disk for a while, and see whether `/readyz` says so once writes are refused."""
    told = list[bool]()
    stage.database.disk.fill()
    try:
        until(lambda: told.extend(_says_it(stage)), DISK_S, every_s=0.5)  # type: ignore[func-returns-value]
    finally:
        stage.database.disk.free()
    if told and not any(told):
        stage.complaints.append(f"the disk is full, {len(told)} writes were refused, and /readyz does not say so")
    return True


def _says_it(stage: Any) -> Any:
    """Whether `/readyz` names the trouble of a write that is refused; nothing, if none is, or nobody answers."""
    with suppress(httpx2.HTTPError):
        if stage.http.put("/views/disk", json={}).status_code == 503:
            ready = stage.http.get("/readyz")
            return [ready.status_code != 200 or "writ" in ready.text or "full" in ready.text]
    return []


def _stall(stage: Any) -> bool:
    stage.database.stall(DISK_S)
    return True


def _restart(stage: Any) -> bool:
    stage.database.restart()
    return True


def _kill_database(stage: Any) -> bool:
    stage.database.kill()
    return True


def _hang_up(stage: Any) -> bool:
    return until(stage.database.hang_up, DATABASE_S)


def _fall_silent(stage: Any) -> bool:
    stage.database.fall_silent()
    return True


def _set_clock(by: Any) -> Any:
    def inflict(stage: Any) -> bool:
        if not until(lambda: stage.database.set_clock(by), DATABASE_S):
            return False
        return _signal(stage, "supervisor", signal.SIGKILL) is not None

    return inflict


def _restore(stage: Any) -> bool:
    """Put an earlier state back, between which and now no client was told anything."""
    with stage.clients.waiting():
        stage.database.restore(stage, lambda: time.sleep(EARLIER_S))
    return True


def faults(database: Any, misbehaviours: Any = misbehaviour.HARMLESS) -> Any:
    """What can be done to a service on this database, and by these strategies in it."""
    found = [make(role) for role in ("api", "supervisor", "worker", "raylet") for make in (_kill, _pause)]
    found += [Fault("disk slow", _stall), Fault("imports are hostile", import_faults.hostile)]
    if database.disk.small:
        found.append(Fault("disk full", _fill))
    if hasattr(database, "restart"):
        found += [Fault("Postgres restarted", _restart), Fault("SIGKILL Postgres", _kill_database)]
        found += [Fault("connections ended", _hang_up), Fault("connections silent", _fall_silent)]
    found += [Fault("clock set back", _set_clock(-CLOCK_JUMP)), Fault("clock set ahead", _set_clock(CLOCK_JUMP))]
    found += [Fault("earlier state restored", _restore, alone=True), Fault("two drivers", hardware_faults.two_drivers)]
    found += [Fault("plug-in edited", plugin_faults.edited), Fault("plug-in broken", plugin_faults.broken)]
    found += [Fault(kind, bench_faults.inflicting(kind)) for kind in bench_faults.KINDS]
    found += [Fault(f"driver {kind}", driver_faults.inflicting(kind)) for kind in driver_faults.KINDS]
    return found + [Fault(f"plug-in {kind}", plugin_faults.submitting(kind)) for kind in misbehaviours]


def volleys(kinds: Any, rng: Any, at_once: Any) -> Iterator[Any]:
    """Faults without end, one to so many at a time, each kind in turn, in an order that is shuffled."""
    together, alone = [each for each in kinds if not each.alone], [each for each in kinds if each.alone]
    while True:
        order = rng.sample(together, len(together))
        parts = [[each] for each in alone]
        while order:
            size = rng.randint(1, at_once)
            parts.append(order[:size])
            order = order[size:]
        yield from rng.sample(parts, len(parts))


def strike(stage: Any, volley: Any) -> Any:
    """Inflict faults at about the same time; those that hit something."""

    def one(fault: Any) -> Any:
        time.sleep(random.uniform(0, 1.5))
        return fault.name if fault.inflict(stage) else None

    with ThreadPoolExecutor() as threads:
        return [name for name in threads.map(one, volley) if name]


def recovered(stage: Any, store: Store, within_s: Any) -> Any:
    """Seconds until all is well; None if that never came.

    That is when the API answers and each of two supervisors has stored a step, and then another: the first may be one
    that it had in hand when its Ray was hit. Steps of experiments that are themselves at fault do not count.
    """
    begun = time.monotonic()
    for _ in range(2):
        since, left_s = [], within_s - (time.monotonic() - begun)  # type: ignore[var-annotated]
        if not until(lambda since=since: _well(stage, store, since), left_s):
            return None
    return time.monotonic() - begun


def _well(stage: Any, store: Store, since: Any) -> Any:
    if not since:
        since.append(witness.last(store))
    owners = {int(owner.split(":")[1]) for owner in witness.owners_since(store, since[0])}
    supervisors = set(stage.of("supervisor"))
    return len(supervisors) == 2 and supervisors <= owners and stage.answers()
