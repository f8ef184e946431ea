"""`python -m workers serve`: run queued work until told to stop. `python -m workers check`: test whether it could."""

import logging
import os
import signal
import sys
from collections.abc import Callable, MutableMapping
from math import inf
from secrets import token_hex

from gaplab.services import logs
from gaplab.services.plugins import folders
from gaplab.services.running.pulse import PulsePipe
from gaplab.services.settings import Settings
from gaplab.services.store.database_errors import StoreChanged, StoreUnavailable
from gaplab.services.store.session import ANSWER_S, Store
from gaplab.services.store.sqlite_file import in_use
from gaplab.workers.errors import ClusterUnusable, RayGone

SHORTEST_ANSWER_S = 5.0
"""Least time for a statement in Postgres, however short a lease is."""

RAY_SETTINGS = {
    "RAY_idle_worker_killing_time_threshold_ms": "60000",
    "RAY_gcs_rpc_server_reconnect_timeout_s": "20",
    "RAY_health_check_timeout_ms": "5000",
    "RAY_health_check_failure_threshold": "4",
    "RAY_ROTATION_MAX_BYTES": "1000000",
    "RAY_ROTATION_BACKUP_COUNT": "1",
}
"""Settings of a Ray of our own: idle processes are kept for a minute, a part that died is given up within half, and of
each process and stream the last million bytes or two are kept."""


def serve(settings: Settings) -> int:
    """Work until a signal; return 1 without a cluster or a usable database, or if the latter was changed."""
    choose_authentication(settings)
    pulse = PulsePipe.inherited()
    logs.adopt("ray")
    logs.configure()
    folders.load(warn=True)
    try:
        database = Store(settings.database_url, answer_s=_answer_s(settings.lease_s), pinned=True)
        with database as store, in_use(store.file):
            _work(store, settings, pulse)
    except (ClusterUnusable, StoreUnavailable) as error:
        pulse.explain(str(error))
        sys.stderr.write(f"{error}\n")
        if isinstance(error, RayGone):
            sys.stderr.flush()
            os._exit(1)  # what Ray does at exit waits for a Ray that does not answer
        return 1
    return 0


def _work(store: Store, settings: Settings, pulse: PulsePipe) -> None:
    """Run what is queued until a signal.

    Raises:
        ClusterUnusable: there is no cluster, a node has other versions, or Ray died.
        StoreChanged: the database has another schema, or is another one than at the start.
    """
    from gaplab.workers.cluster import cluster  # Ray takes a second to import
    from gaplab.workers.ray_tasks import RayTasks
    from gaplab.workers.supervisor import Stop, Supervisor
    from gaplab.workers.task import Patience

    _refuse_other_schema(store)
    stop = Stop()
    with cluster(settings) as joined:
        for signum in (signal.SIGTERM, signal.SIGINT):  # only now, for Ray has put handlers of its own in place
            signal.signal(signum, lambda *_: stop.set())
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as `nohup` sets it
            signal.signal(signal.SIGHUP, lambda *_: stop.set())
        logging.getLogger("gaplab.supervisor").info("ready for %d repetitions at once", joined.capacity())
        start_s = inf if settings.ray_address else Patience.start_s
        patience = Patience(settings.rollout_limit_s, settings.step_limit_s, start_s)
        tasks = RayTasks(joined.versions)
        supervisor = Supervisor(store, joined.capacity, tasks, lease_s=settings.lease_s, patience=patience)
        supervisor.serve(stop, pulse)


def _refuse_other_schema(store: Store) -> None:
    """Check the schema before anything is started; a database that is away is waited for later.

    Raises:
        StoreChanged: it is of another version.
    """
    try:
        store.check()
    except StoreChanged:
        raise
    except StoreUnavailable as error:
        logging.getLogger("gaplab.supervisor").warning("the database cannot be used yet: %s", error)


def _answer_s(lease_s: float) -> float:
    """Return the longest time of a statement, after which a lease is not yet lost."""
    return min(ANSWER_S, max(SHORTEST_ANSWER_S, lease_s / 2))


def choose_authentication(settings: Settings, environment: MutableMapping[str, str] = os.environ) -> None:
    """Require a token of clients of our own Ray, and send one to a cluster unless the environment forbids it.

    Ray reads these variables when it is imported. By default it sends its token only to a cluster that it started, and
    keeps the token in a file of the home folder that other users may read.
    """
    if settings.ray_address:
        environment.setdefault("RAY_AUTH_MODE", "token")
    else:
        environment["RAY_AUTH_MODE"] = "token"
        environment["RAY_AUTH_TOKEN"] = token_hex(32)
        for name, value in RAY_SETTINGS.items():
            environment.setdefault(name, value)


def check(settings: Settings) -> int:
    """Return 0 if the database can be used, else 1."""
    try:
        Store(settings.database_url).check()
    except StoreUnavailable as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


COMMANDS: dict[str, Callable[[Settings], int]] = {"serve": serve, "check": check}


def main(arguments: list[str]) -> int:
    """Run the command; return 2 if the arguments or the environment cannot be used."""
    if len(arguments) != 1 or arguments[0] not in COMMANDS:
        sys.stderr.write(f"usage: python -m workers {' | '.join(COMMANDS)}\n")
        return 2
    try:
        settings = Settings.from_environment()
    except ValueError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return COMMANDS[arguments[0]](settings)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
