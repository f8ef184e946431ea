"""The whole service as one command: it migrates the database, answers over HTTP and runs queued experiments.

The supervisor that runs them is a separate process. The two meet only in the database, so either can die alone.
"""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

from gaplab.api.process.child_process import end, start
from gaplab.api.process.errors import CommandError
from gaplab.api.process.server import exit_on_signals, listen, require_token, serve_api
from gaplab.api.process.supervisor_process import Silence, SupervisorProcess
from gaplab.services import logs
from gaplab.services.plugins import contents, folders
from gaplab.services.settings import Limits, Notify, Settings, address
from gaplab.services.store.engine import parse
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import file_of, is_open_to_others

LOOK_S = 0.5
"""Time between two looks for changed plug-in files."""

END_S = 60.0
"""Longest wait for the end of a service that is started again."""

log = logging.getLogger("gaplab.service")


def serve(settings: Settings, *, workers: bool = True) -> None:
    """Serve until SIGINT, SIGTERM or SIGHUP, then end in order; without workers, only accept and show experiments.

    Raises:
        CommandError: the address is invalid or taken.
        StoreUnavailable: the database cannot be migrated.
        Unauthenticated: other machines can reach the host, and no token exists.
        ValueError: a limit or a setting of notifications is not permitted.
    """
    limits, notify = Limits.from_environment(), Notify.from_environment()  # before anything is changed or started
    logs.configure()
    exit_on_signals()
    folders.load(warn=True)
    listener = listen(settings.host, settings.port)
    migrate(settings.database_url)
    require_token(settings)
    warn_of_readers(settings.database_url)
    url = address(settings.host, settings.port)
    log.info("gaplab serves on %s (/docs documents the API; Ctrl-C ends the service)", url)
    with _kept_supervisor(settings) if workers else nullcontext() as supervisor:
        serve_api(settings, listener, supervisor, limits=limits, notify=notify)


def serve_again_after_edits(settings: Settings, *, workers: bool = True) -> int:
    """Serve in another process, and start that again when a plug-in file changes; return the code with which it ends.

    Raises:
        CommandError: there is no folder to watch.
    """
    if not (watched := folders.named()):
        raise CommandError(f"--reload watches the folders of {folders.VARIABLE}, which names none")
    logs.configure()
    exit_on_signals()
    arguments = ("serve",) if workers else ("serve", "--no-workers")
    while True:
        before = contents.state(watched)
        service = start("gaplab", *arguments, environment=environment_of(settings))
        try:
            while (code := service.poll()) is None and contents.state(watched) == before:
                time.sleep(LOOK_S)
        finally:
            end(service, patience_s=END_S)
        if code is not None:
            return code
        log.info("a plug-in file was changed: the service starts again")


@contextmanager
def _kept_supervisor(settings: Settings) -> Iterator[SupervisorProcess]:
    with Store(settings.database_url) as store:
        supervisor = SupervisorProcess(environment_of(settings), silence=Silence.of(settings), store=store)
        supervisor.start()
        try:
            yield supervisor
        finally:
            supervisor.stop()


def migrate(database_url: str, *, only_new: bool = False) -> None:
    """Migrate the database to the schema of this version; with `only_new`, one that has a schema stays as it is.

    Raises:
        StoreUnavailable: the database does not answer or cannot be changed.
    """
    from gaplab.migrations import upgrade

    upgrade(database_url, only_new=only_new)


def warn_of_readers(database_url: str) -> None:
    """Log a warning if other users of the machine may read the database; a new one is the owner's alone."""
    file = file_of(parse(database_url))
    if file and is_open_to_others(file):
        log.warning("other users of this machine can open the database %s: `chmod 600 %s` keeps them out", file, file)


def environment_of(settings: Settings) -> dict[str, str]:
    """Return the settings as environment variables for a child process."""
    given = settings.model_dump(exclude={"url", "token"}, exclude_none=True)
    return {f"GAPLAB_{name.upper()}": str(value) for name, value in given.items()}
