"""The whole service as one command: it migrates the database, answers over HTTP and runs queued experiments.

The supervisor that runs them is a separate process. The two meet only in the database, so either can die alone.
"""

import logging
import re
from collections.abc import Mapping
from threading import Event, Thread
from time import monotonic

from gaplab.api.process.child_process import end, start
from gaplab.api.process.server import exit_on_signals, listen, require_token, serve_api
from gaplab.services import logs
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.plugins import folders
from gaplab.services.settings import Settings, address

log = logging.getLogger("gaplab.service")

LONG_LIFE_S = 15.0
"""A supervisor that lived longer is restarted after the shortest pause: its start succeeded."""

LONGEST_PAUSE_S = 30.0
"""Together with the start of Ray, the service recovers within a minute."""

GRACE_S = 24.0
"""Time for the supervisor to store its last steps and stop Ray.

Together with the grace of the API's requests, the service ends within half a minute.
"""


def serve(settings: Settings, *, workers: bool = True) -> None:
    """Serve until SIGINT or SIGTERM, then end in order.

    Args:
        settings: settings of the API and the supervisor.
        workers: whether to run experiments, or only accept and show them.

    Raises:
        CommandError: the address is invalid or taken.
        StoreUnavailable: the database cannot be migrated.
        Unauthenticated: other machines can reach the host, and no token exists.
    """
    logs.configure()
    exit_on_signals()
    folders.load()
    listener = listen(settings.host, settings.port)
    migrate(settings.database_url)
    require_token(settings)
    url = address(settings.host, settings.port)
    log.info("gaplab serves on %s (/docs documents the API; Ctrl-C ends the service)", url)
    supervisor = SupervisorProcess(environment_of(settings)) if workers else None
    try:
        if supervisor:
            supervisor.start()
        serve_api(settings, listener)
    finally:
        if supervisor:
            supervisor.stop()


def migrate(database_url: str) -> None:
    """Migrate the database to the schema of this version.

    Raises:
        StoreUnavailable: the database does not answer or cannot be changed.
    """
    from gaplab.migrations import upgrade

    try:
        upgrade(database_url)
    except StoreUnavailable:
        raise
    except Exception as error:  # each database driver has errors of its own
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        url = re.sub(r"(://[^:/@]*):[^@]*@", r"\1:…@", database_url)  # without the password
        msg = f"the database {url} cannot be migrated: {reason}"
        raise StoreUnavailable(msg) from error


def environment_of(settings: Settings) -> dict[str, str]:
    """Return the settings as environment variables for a child process."""
    values = {
        "GAPLAB_DATABASE_URL": settings.database_url,
        "GAPLAB_RAY_ADDRESS": settings.ray_address,
        "GAPLAB_WORKERS": settings.workers,
        "GAPLAB_LEASE_S": settings.lease_s,
        "GAPLAB_HOST": settings.host,
        "GAPLAB_PORT": settings.port,
    }
    return {name: str(value) for name, value in values.items() if value is not None}


class SupervisorProcess:
    """A supervisor that is restarted when it dies, after a pause that doubles while it keeps dying."""

    def __init__(self, environment: Mapping[str, str], module: str = "gaplab.workers") -> None:
        self._environment = environment
        self._module = module
        self._stopping = Event()
        self._thread = Thread(target=self._keep_running, name="supervisor process", daemon=True)

    def start(self) -> None:
        """Start the supervisor, and restart it whenever it dies."""
        self._thread.start()

    def stop(self) -> None:
        """End the supervisor in order."""
        self._stopping.set()
        self._thread.join()

    def _keep_running(self) -> None:
        pause_s = 1.0
        while not self._stopping.is_set():
            began = monotonic()
            code = self._run_once()
            if self._stopping.is_set():
                return
            pause_s = 1.0 if monotonic() - began > LONG_LIFE_S else min(2 * pause_s, LONGEST_PAUSE_S)
            log.warning("the supervisor ended by itself (exit code %s); another starts in %.0f s", code, pause_s)
            self._stopping.wait(pause_s)

    def _run_once(self) -> int:
        """Run one supervisor until it ends or is told to; return its exit code."""
        process = start(self._module, "serve", environment=self._environment)
        while process.poll() is None and not self._stopping.wait(0.2):
            pass
        end(process, patience_s=GRACE_S)
        return process.returncode
