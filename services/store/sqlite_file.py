"""The file of a SQLite database: who may read it, whether it is the same as before, and whether it is whole."""

import logging
import os
import sqlite3
from collections.abc import Iterator
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from pathlib import Path
from threading import Lock
from time import monotonic

from sqlalchemy import URL, Engine

from gaplab.services.store.atomic_files import PRIVATE, hand_over
from gaplab.services.store.database_errors import StoreChanged, StoreDamaged, StoreUnavailable

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

HINT = "end the service and run `gaplab restore BACKUP`"
"""What to do about a database that is gone or damaged."""


LONGEST_PATH, LONGEST_NAME = 504, 247
"""Bytes of a database's path and name, which are 8 longer for its journal. Source: os_unix.c, and man 5 ext4."""

COMPANIONS = ("-journal", "-wal", "-shm")
"""Endings of the files that SQLite keeps beside a database; the first two hold transactions that are not in it yet."""


def file_of(url: URL) -> Path | None:
    """Return the file of a SQLite URL, at the end of symbolic links; None for Postgres, and for a database in memory.

    Its lock, its journals and what a restore replaces are beside this file, whichever link leads to it.

    Raises:
        StoreUnavailable: the path is too long.
    """
    name = url.database or ""
    if url.get_backend_name() != "sqlite" or name in {"", ":memory:"}:
        return None
    file = Path(os.path.realpath(name))
    if len(os.fsencode(file)) > LONGEST_PATH or len(os.fsencode(file.name)) > LONGEST_NAME:
        limits = f"at most {LONGEST_PATH} bytes, and {LONGEST_NAME} of its name"
        raise StoreUnavailable(f"the path of the database is too long ({limits}): {str(file)[:100]}…")
    return file


def url_of(file: Path) -> str:
    """Return the URL of a SQLite database, whatever characters its path has."""
    return URL.create("sqlite", database=str(file)).render_as_string()


def identity(file: Path) -> tuple[int, int] | None:
    """Return numbers that differ between a file and another of the same name; None if there is no file."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def create(file: Path) -> None:
    """Create an absent file for its owner alone; SQLite gives its companions the same owner and permissions."""
    with suppress(OSError):  # SQLite says what is wrong
        descriptor = os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, PRIVATE)
        try:
            hand_over(descriptor, file.parent)
        finally:
            os.close(descriptor)


def is_open_to_others(file: Path) -> bool:
    """Return whether other users of the machine may read or write the file."""
    return file.is_file() and bool(file.stat().st_mode & 0o077)


def refuse_damaged(file: Path) -> None:
    """Check the structure of a database that may be absent; it reads the whole file.

    Raises:
        StoreDamaged: it is damaged, or not a database; the message says what to do.
        StoreUnavailable: it cannot be read now.
    """
    if not file.is_file() or not file.stat().st_size:
        return
    try:
        with closing(sqlite3.connect(file, timeout=30)) as connection:
            (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    except sqlite3.OperationalError as error:
        raise StoreUnavailable(f"the database {file} cannot be read: {error}") from error
    except sqlite3.DatabaseError as error:
        found = str(error)
    if found != "ok":
        raise StoreDamaged(f"the database {file} is damaged ({found}): {HINT}")


def in_use(file: Path | None) -> AbstractContextManager[None]:
    """Mark the database as used by a service for as long as the context lasts, so that no restore replaces it.

    Raises:
        StoreUnavailable: a restore replaces it right now, or its lock cannot be opened.
    """
    return _locked(file, f"the database {file} is being restored: start again when that is done")


def unused(file: Path) -> AbstractContextManager[None]:
    """Keep services from the database for as long as the context lasts.

    Raises:
        StoreUnavailable: a service runs on it, or its lock cannot be opened.
    """
    return _locked(file, f"a service runs on the database {file}: end it first", exclusive=True)


@contextmanager
def _locked(file: Path | None, otherwise: str, *, exclusive: bool = False) -> Iterator[None]:
    """Hold a lock on a file beside the database; the kernel drops it when the process ends, however that happens.

    The database itself must not be opened for it: closing it again would drop SQLite's own locks.

    Raises:
        StoreUnavailable: another process holds it; the message is `otherwise`.
    """
    descriptor = _lock_file(file)
    if descriptor is None:
        yield
        return
    try:
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
        except OSError as error:
            raise StoreUnavailable(otherwise) from error
        yield
    finally:
        os.close(descriptor)


def _lock_file(file: Path | None) -> int | None:
    """Return the open lock file of a database; None where there can be none, as in a folder that is read only.

    Raises:
        StoreUnavailable: there is one, and this user may not open it.
    """
    if file is None or fcntl is None:
        return None
    lock = file.with_name(f"{file.name}.lock")
    try:
        return _open_lock(lock, file)
    except PermissionError as error:
        if os.path.exists(lock):
            raise StoreUnavailable(_closed(lock, file)) from error
    except OSError:
        pass
    return None


def _open_lock(lock: Path, file: Path) -> int:
    """Open the lock file; a new one belongs to the owner of the database."""
    try:
        descriptor = os.open(lock, os.O_CREAT | os.O_EXCL | os.O_RDWR, PRIVATE)
    except FileExistsError:
        return os.open(lock, os.O_RDWR)
    with suppress(OSError):
        hand_over(descriptor, file)
    return descriptor


def _closed(lock: Path, file: Path) -> str:
    owner = (file if file.exists() else file.parent).stat()
    return (
        f"this user may not open {lock}, the lock of the database: "
        f"`sudo chown {owner.st_uid}:{owner.st_gid} {lock}` gives it to the owner of the database"
    )


CHECK_AGAIN_S = 10.0
"""Interval between two checks of a damaged file: it may have been copied over in the meantime."""

log = logging.getLogger("gaplab.store")


class Guard:
    """Admits uses of a database. A Postgres, or a database in memory, has no file to look at.

    Args:
        engine: of the database; its connections are closed when the file was replaced.
        pinned: whether this process works on one database for life, as a supervisor does; else it follows the name to
            another file.
    """

    def __init__(self, engine: Engine, *, pinned: bool) -> None:
        self._engine = engine
        self._pinned = pinned
        self._file = file_of(engine.url)
        self._known: tuple[int, int] | None = None
        self._changed: str | None = None
        self._damaged: str | None = None
        self._checked_at = 0.0
        self._lock = Lock()

    def admit(self) -> None:
        """Check what the next use relies on.

        Raises:
            StoreUnavailable: the file is gone.
            StoreChanged: the database is another than before, and this process is bound to that one.
            StoreDamaged: the file is damaged; no more is written to it.
        """
        if self._changed:
            raise StoreChanged(self._changed)
        if self._file is None:
            return
        if (found := identity(self._file)) is None:
            lost = "is gone" if self._known else "does not exist"
            remedy = "put it back, or run `gaplab restore BACKUP` or `python -m migrations`"
            raise StoreUnavailable(f"the database cannot be used now: {self._file} {lost}; {remedy}")
        if found != self._known or self._damaged:
            with self._lock:
                self._look_again(found)

    def change(self, reason: str) -> None:
        """Note that the database is another than before.

        Raises:
            StoreChanged: with the reason; so does every later use if the process is bound to the former one.
        """
        if self._pinned:
            self._changed = reason
        raise StoreChanged(reason)

    def damage(self, error: StoreDamaged) -> None:
        """Note that the file was found damaged.

        Raises:
            StoreDamaged: so does every later use until the file is whole again.
        """
        self._damaged, self._checked_at = f"{error}: {HINT}", monotonic()
        log.error("%s", self._damaged)
        raise StoreDamaged(self._damaged) from error

    def _look_again(self, found: tuple[int, int]) -> None:
        if self._known is None:
            self._known = found
        if found != self._known:
            self._follow(found)
        elif self._damaged:
            self._check_damage()

    def _follow(self, found: tuple[int, int]) -> None:
        """Open the file that has the name now, unless it is damaged or the process is bound to the former one."""
        if self._pinned:
            log.error("the database %s was replaced by another file", self._file)
            self.change(f"the database {self._file} was replaced by another file")
        self._engine.dispose()
        self._known = found
        self._damaged, self._checked_at = f"the database {self._file} was replaced", -CHECK_AGAIN_S
        self._check_damage()
        log.warning("the database %s was replaced by another file, which is used from now on", self._file)

    def _check_damage(self) -> None:
        assert self._file is not None
        if monotonic() - self._checked_at >= CHECK_AGAIN_S:
            self._checked_at = monotonic()
            try:
                refuse_damaged(self._file)
            except StoreUnavailable as error:
                self._damaged = str(error)
            else:
                self._damaged = None
        if self._damaged:
            raise StoreDamaged(self._damaged)
