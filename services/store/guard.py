"""What must hold before each use of a database: its file is the same as before, and is not known to be damaged."""

import logging
from threading import Lock
from time import monotonic

from sqlalchemy import Engine

from gaplab.services.store.database_errors import StoreChanged, StoreDamaged, StoreUnavailable
from gaplab.services.store.sqlite_file import HINT, file_of, identity, refuse_damaged

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
