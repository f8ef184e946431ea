"""`python -m workers serve`: run queued work until told to stop. `python -m workers check`: test whether it could."""

import logging
import os
import signal
import sys
from collections.abc import Callable
from secrets import token_hex
from threading import Event

from gaplab.services import logs
from gaplab.services.core.errors import ClusterUnusable, StoreUnavailable
from gaplab.services.plugins import folders
from gaplab.services.settings import Settings
from gaplab.services.store.session import Store


def serve(settings: Settings) -> int:
    """Work until SIGTERM or SIGINT; return 1 if there is no cluster to work on."""
    choose_authentication(settings)
    from gaplab.workers.cluster import cluster  # Ray takes a second to import
    from gaplab.workers.patience import Patience
    from gaplab.workers.supervisor import Supervisor

    logs.adopt("ray")
    logs.configure()
    folders.load()
    store, stop = Store(settings.database_url), Event()
    try:
        with cluster(settings) as joined:
            for signum in (signal.SIGTERM, signal.SIGINT):  # only now, for Ray has put handlers of its own in place
                signal.signal(signum, lambda *_: stop.set())
            logging.getLogger("gaplab.supervisor").info("ready for %d repetitions at once", joined.capacity())
            patience = Patience(settings.rollout_limit_s, settings.step_limit_s)
            supervisor = Supervisor(
                store, joined.capacity, joined.versions, lease_s=settings.lease_s, patience=patience
            )
            supervisor.serve(stop)
    except ClusterUnusable as error:
        sys.stderr.write(f"{error}\n")
        return 1
    finally:
        store.dispose()
    return 0


def choose_authentication(settings: Settings) -> None:
    """Require a token of clients of our own Ray, and send one to a cluster unless the environment forbids it.

    Ray reads these variables when it is imported. By default it sends its token only to a cluster that it started, and
    keeps the token in a file of the home folder that other users may read.
    """
    if settings.ray_address:
        os.environ.setdefault("RAY_AUTH_MODE", "token")
    else:
        os.environ["RAY_AUTH_MODE"] = "token"
        os.environ["RAY_AUTH_TOKEN"] = token_hex(32)


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
