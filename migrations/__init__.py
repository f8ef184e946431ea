"""The revisions of the database's schema. `upgrade(url)` brings a database to the latest revision."""

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Connection, text

from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.store import database_errors
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.sqlite_file import file_of, refuse_damaged

_LOCK = 0x6761706C6162
"""Key of the advisory lock on Postgres: "gaplab" in ASCII."""


def configuration(connection: Connection | None = None) -> Config:
    """Return Alembic's configuration. With a connection, commands run in its transaction."""
    config = Config(Path(__file__).parent / "alembic.ini")
    config.attributes["connection"] = connection
    return config


def upgrade(url: str) -> None:
    """Bring the database to the latest revision, in one transaction; a second process waits for the first.

    Raises:
        StoreDamaged: the file of the database is damaged.
        StoreUnavailable: the kind of database is unknown, it is unreachable, or it has a revision of a later
            version; nothing was changed.
    """
    engine = open_engine(url, enforce_foreign_keys=False)
    try:
        if file := file_of(engine.url):
            refuse_damaged(file)
        with database_errors.named(), engine.execution_options(**{WRITES: True}).begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": _LOCK})
            command.upgrade(configuration(connection), "head")
    except CommandError as error:
        msg = f"this version of gaplab cannot migrate the database: {error}"
        raise StoreUnavailable(msg) from error
    finally:
        engine.dispose()
