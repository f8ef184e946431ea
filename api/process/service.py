"""The whole service as one command: the database migrated, the API answering, and a supervisor running what is queued.

The supervisor is a process of its own. The two meet in the database only, so either may die without the other.
"""

import logging
import re
from collections.abc import Mapping
from threading import Event, Thread
from time import monotonic

from gaplab.api.process.child_process import end, start
from gaplab.api.process.server import end_in_order, listen, refuse_strangers, serve_api
from gaplab.services import logs
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.plugins import folders
from gaplab.services.settings import Settings, address

log = logging.getLogger("gaplab.service")

LONG_LIFE_S = 15.0
"""A supervisor that lived so long did not fail at its start; it is started again at once."""

LONGEST_PAUSE_S = 30.0
"""With what Ray takes to start, a service is well again within a minute."""

GRACE_S = 24.0
"""How long the supervisor may take to end: its repetitions deliver once more, and Ray ends.

With the time that the API's last requests have, the service is gone half a minute after it was told to be.
"""


def serve(settings: Settings, *, workers: bool = True) -> None:
    """Serve until told to stop (SIGINT, SIGTERM), then end in order.

    Args:
        settings: of the API and of the supervisor.
        workers: whether experiments are run, or only taken and shown.

    Raises:
        CommandError: the address is taken.
        StoreUnavailable: the database cannot be migrated.
        Unauthenticated: the host is more than loopback, and no token lets anyone in.
        PluginBroken: a plug-in from outside cannot be used.
    """
    logs.configure()
    end_in_order()
    folders.load()
    listener = listen(settings.host, settings.port)
    migrate(settings.database_url)
    refuse_strangers(settings)
    found_at = address(settings.host, settings.port)
    log.info("gaplab serves on %s (/docs lists what it answers to; Ctrl-C ends it)", found_at)
    keeper = Keeper(environment_of(settings)) if workers else None
    try:
        if keeper:
            keeper.start()
        serve_api(settings, listener)
    finally:
        if keeper:
            keeper.stop()


def migrate(database_url: str) -> None:
    """Bring the database to the schema of this version.

    Raises:
        StoreUnavailable: it cannot be reached or changed.
    """
    from gaplab.migrations import upgrade

    try:
        upgrade(database_url)
    except StoreUnavailable:
        raise
    except Exception as error:  # of the database driver, whichever it is
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        msg = f"the database {_without_password(database_url)} cannot be migrated: {reason}"
        raise StoreUnavailable(msg) from error


def _without_password(url: str) -> str:
    return re.sub(r"(://[^:/@]*):[^@]*@", r"\1:…@", url)


def environment_of(settings: Settings) -> dict[str, str]:
    """The settings as a child process reads them."""
    values = {
        "GAPLAB_DATABASE_URL": settings.database_url,
        "GAPLAB_RAY_ADDRESS": settings.ray_address,
        "GAPLAB_WORKERS": settings.workers,
        "GAPLAB_LEASE_S": settings.lease_s,
        "GAPLAB_HOST": settings.host,
        "GAPLAB_PORT": settings.port,
    }
    return {name: str(value) for name, value in values.items() if value is not None}


class Keeper:
    """Keeps a supervisor running: one that dies is started again, after a pause that doubles while it keeps dying."""

    def __init__(self, environment: Mapping[str, str], module: str = "gaplab.workers") -> None:
        self._environment = environment
        self._module = module
        self._stopping = Event()
        self._thread = Thread(target=self._keep, name="keeper", daemon=True)

    def start(self) -> None:
        """Start the supervisor and watch over it."""
        self._thread.start()

    def stop(self) -> None:
        """End the supervisor in order, and start no other."""
        self._stopping.set()
        self._thread.join()

    def _keep(self) -> None:
        pause_s = 1.0
        while not self._stopping.is_set():
            began = monotonic()
            code = self._live()
            if self._stopping.is_set():
                return
            pause_s = 1.0 if monotonic() - began > LONG_LIFE_S else min(2 * pause_s, LONGEST_PAUSE_S)
            log.warning("the supervisor ended by itself (exit code %s); another starts in %.0f s", code, pause_s)
            self._stopping.wait(pause_s)

    def _live(self) -> int:
        """Run one supervisor until it ends, or until it is to be ended."""
        process = start(self._module, "serve", environment=self._environment)
        while process.poll() is None and not self._stopping.wait(0.2):
            pass
        end(process, patience_s=GRACE_S)
        return process.returncode
