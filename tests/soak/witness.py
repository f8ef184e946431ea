"""Triggers that write down every move of every repetition, in the transaction that makes it.

Nothing escapes them, whoever writes: what the database ends with says little about how it came to it.
"""

from collections import namedtuple
from typing import Any

from sqlalchemy import text

from gaplab.services.store.session import Store
from tests.soak.misbehaviour import PREFIX

Move = namedtuple("Move", "id repetition was state epoch_was epoch owner steps_was steps at")

_COLUMNS = "repetition, was, state, epoch_was, epoch, owner, steps_was, steps, at"
_VALUES = "OLD.id, OLD.state, NEW.state, OLD.epoch, NEW.epoch, NEW.owner, OLD.steps, NEW.steps"
_TYPES = (
    "repetition INTEGER, was TEXT, state TEXT, epoch_was INTEGER, epoch INTEGER, owner TEXT, "
    "steps_was INTEGER, steps INTEGER, at DOUBLE PRECISION"
)
_MOVED = "OLD.state <> NEW.state OR OLD.epoch <> NEW.epoch OR OLD.steps <> NEW.steps"

_SQLITE = (
    f"CREATE TABLE witness (id INTEGER PRIMARY KEY AUTOINCREMENT, {_TYPES})",
    f"""CREATE TRIGGER witness_moves AFTER UPDATE ON repetition WHEN {_MOVED} BEGIN
        INSERT INTO witness ({_COLUMNS}) VALUES ({_VALUES}, (julianday('now') - 2440587.5) * 86400.0); END""",
)
_POSTGRES = (
    f"CREATE TABLE witness (id BIGSERIAL PRIMARY KEY, {_TYPES})",
    f"""CREATE FUNCTION witness_move() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN
        INSERT INTO witness ({_COLUMNS}) VALUES ({_VALUES}, extract(epoch FROM clock_timestamp()));
        RETURN NULL; END $$""",
    f"CREATE TRIGGER witness_moves AFTER UPDATE ON repetition FOR EACH ROW WHEN ({_MOVED}) "
    "EXECUTE FUNCTION witness_move()",
)


def install(url: Any) -> None:
    """Set the triggers on a database at head."""
    store = Store(url)
    with store.transaction() as session:
        for statement in _SQLITE if url.startswith("sqlite") else _POSTGRES:
            session.execute(text(statement))
    store.dispose()


def moves(store: Store) -> Any:
    """All moves, in their order."""
    with store.reading() as session:
        rows = session.execute(text(f"SELECT id, {_COLUMNS} FROM witness ORDER BY id")).all()
    return [Move(*row) for row in rows]


def last(store: Store) -> Any:
    """The number of the last move."""
    with store.reading() as session:
        return session.execute(text("SELECT coalesce(max(id), 0) FROM witness")).scalar_one()


def owners_since(store: Store, number: Any) -> Any:
    """Who stored steps after the move of this number, except in experiments that are themselves at fault."""
    query = text(
        "SELECT DISTINCT witness.owner FROM witness JOIN repetition ON repetition.id = witness.repetition "
        "JOIN experiment ON experiment.id = repetition.experiment_id WHERE witness.id > :number "
        "AND witness.steps > steps_was AND witness.owner IS NOT NULL AND experiment.strategy NOT LIKE :at_fault"
    )
    with store.reading() as session:
        return set(session.execute(query, {"number": number, "at_fault": f"{PREFIX}%"}).scalars())
