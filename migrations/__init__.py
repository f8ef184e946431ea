"""The history of the database's schema. `upgrade(url)` brings a database to the revision that this version needs."""

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection, text

from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.store import database_errors
from gaplab.services.store.engine import WRITES, open_engine

_LOCK = 0x6761706C6162
"""Of the migration, among the advisory locks of a Postgres database: "gaplab"."""


def configuration(connection: Connection | None = None) -> Config:
    """Alembic's configuration; with a connection, its commands run in the transaction of that connection."""
    config = Config(Path(__file__).parent / "alembic.ini")
    config.attributes["connection"] = connection
    return config


def upgrade(url: str) -> None:
    """Bring the database to the head revision, in one transaction; a second process waits until the first is done.

    At head it changes nothing.

    Raises:
        StoreUnavailable: no such kind of database, unreachable, or at a revision of a later version; nothing was
            changed.
    """
    engine = open_engine(url, enforce_foreign_keys=False)
    try:
        with database_errors.named(), engine.execution_options(**{WRITES: True}).begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
            command.upgrade(configuration(connection), "head")
    except CommandError as error:
        msg = f"the database cannot be migrated by this version: {error}"
        raise StoreUnavailable(msg) from error
    finally:
        engine.dispose()
