"""The revisions of the database's schema. `upgrade(url)` brings a database to the latest revision."""

import re
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import Connection, text

from gaplab.services.store import database_errors
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.models.base import is_later, other_schema
from gaplab.services.store.sqlite_file import file_of, refuse_damaged

_LOCK = 0x6761706C6162
"""Key of the advisory lock on Postgres: "gaplab" in ASCII."""


def configuration(connection: Connection | None = None) -> Config:
    """Return Alembic's configuration. With a connection, commands run in its transaction."""
    config = Config(Path(__file__).parent / "alembic.ini")
    config.attributes["connection"] = connection
    return config


def upgrade(url: str, *, only_new: bool = False, to: str = "head") -> None:
    """Bring the database to a later revision, in one transaction; a second process waits for the first.

    Args:
        url: of the database.
        to: the revision; left out: the latest.
        only_new: whether a database that has a revision already stays as it is.

    Raises:
        StoreDamaged: the file of the database is damaged.
        StoreUnavailable: the kind of database is unknown, it is unreachable, it has a revision of a later version, or
            a migration failed; nothing was changed.
    """
    try:
        _upgrade(url, only_new=only_new, to=to)
    except StoreUnavailable:
        raise
    except Exception as error:  # each database driver has errors of its own
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        url = re.sub(r"(://[^:/@]*):.*@", r"\1:…@", url)  # without the password
        raise StoreUnavailable(f"the database {url} cannot be migrated: {reason}") from error


def _upgrade(url: str, *, only_new: bool, to: str) -> None:
    engine = open_engine(url, enforce_foreign_keys=False)
    try:
        if file := file_of(engine.url):
            refuse_damaged(file)
        with database_errors.named(), engine.execution_options(**{WRITES: True}).begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
            found = MigrationContext.configure(connection).get_current_heads()
            if is_later(found):
                raise StoreUnavailable(other_schema(found))
            if not (found and only_new):
                command.upgrade(configuration(connection), to)
    finally:
        engine.dispose()
