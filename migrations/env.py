"""Alembic's entry point: compare and migrate the tables of `gaplab.services.store.models`."""

from alembic import context
from sqlalchemy import Connection

from gaplab.services.settings import Settings
from gaplab.services.store.engine import WRITES, open_engine
from gaplab.services.store.models import Base


def migrate(connection: Connection) -> None:
    """Run the migrations on the connection; batch mode rebuilds the tables that SQLite cannot alter."""
    context.configure(connection=connection, target_metadata=Base.metadata, render_as_batch=True)
    with context.begin_transaction():
        context.run_migrations()


def migrate_configured_database() -> None:
    """Run the migrations on the database of the environment, for Alembic's own command."""
    engine = open_engine(Settings.from_environment().database_url, enforce_foreign_keys=False)
    with engine.execution_options(**{WRITES: True}).begin() as connection:
        migrate(connection)
    engine.dispose()


if (connection := context.config.attributes.get("connection")) is not None:
    migrate(connection)
else:
    migrate_configured_database()
