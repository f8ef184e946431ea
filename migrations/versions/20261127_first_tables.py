"""First tables.

Revision: 0001, after nothing.
"""

from collections.abc import Mapping
from typing import Any

import sqlalchemy as sa
from alembic import op
from sqlalchemy.sql.schema import SchemaItem
from sqlalchemy.types import TypeEngine

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

Columns = Mapping[str, TypeEngine[Any]]  # the type of each column, whose names spaces divide

ID, NAME, TEXT = sa.String(32), sa.String(200), sa.Text()
WHOLE, LARGE, TRUTH = sa.Integer(), sa.BigInteger(), sa.Boolean()
REAL: TypeEngine[Any] = sa.Double()
MOMENT, JSON, BINARY = sa.DateTime(timezone=True), sa.JSON(), sa.LargeBinary()
NUMBER = LARGE.with_variant(WHOLE, "sqlite")

STATES = ("QUEUED", "RUNNING", "COMPLETED", "FAILED", "CANCELLED", "PAUSING", "PAUSED", "STOPPING", "WAITING")
ENDINGS = ("completed", "paused", "stopped", "cancelled", "handed back", "lost", "failed", "waiting")
REQUEST_STATES = ("open", "taken", "measured", "failed", "withdrawn", "stuck")
ANSWER_STATES = ("counted", "conflict", "replaced", "void", "dismissed")

DEFAULTS: dict[str, Any] = dict.fromkeys(("edits", "precedence", "running", "checkpoints"), "0")
DEFAULTS |= dict.fromkeys(("claimable", "left_out"), sa.false())

TABLES = (
    *("study", "provenance", "experiment", "experiment_provenance", "repetition", "attempt", "checkpoint"),
    *("iteration", "measurement", "simulator", "request", "answer", "branch", "attachment", "robot", "sensitivity"),
    *("event", "event_counter", "supervisor", "notification", "notifier", "token", "idempotency", "deletion", "view"),
)
"""Each after those that it refers to."""


def upgrade() -> None:
    """Create the tables, the counter of events, and the place of the notifier."""
    for create in (_experiments, _provenances, _repetitions, _results, _measurements, _work, _events, _callers):
        create()
    op.execute("INSERT INTO event_counter (id, latest) VALUES (1, 0)")
    op.execute("INSERT INTO notifier (id) VALUES (1)")


def downgrade() -> None:
    """Drop the tables."""
    for table in reversed(TABLES):
        op.drop_table(table)


def _table(name: str, key: str, always: Columns, sometimes: Columns, *others: SchemaItem) -> None:
    """Create a table: columns that have a value in each row, those that may be null, and what else it has."""
    columns = [
        sa.Column(each, type_, nullable=False, server_default=DEFAULTS.get(each), autoincrement=False)
        for names, type_ in always.items()
        for each in names.split()
    ]
    columns += [sa.Column(each, type_) for names, type_ in sometimes.items() for each in names.split()]
    numbered = name == "repetition"  # SQLite uses no id of a deleted one again
    primary = sa.PrimaryKeyConstraint(*key.split(), name=f"pk_{name}")
    op.create_table(name, *others, *columns, primary, **({"sqlite_autoincrement": True} if numbered else {}))


def _index(table: str, *indexes: str) -> None:
    for columns in map(str.split, indexes):
        op.create_index(f"ix_{table}_{'_'.join(columns)}", table, columns)


def _one_of(name: str, words: tuple[str, ...]) -> sa.Enum:
    return sa.Enum(*words, name=name, native_enum=False, create_constraint=True, length=16)


def _belongs(table: str, owner: str) -> sa.ForeignKeyConstraint:
    column = f"{owner}_id"
    return sa.ForeignKeyConstraint([column], [f"{owner}.id"], name=f"fk_{table}_{column}_{owner}")


def _of_iteration(table: str) -> sa.ForeignKeyConstraint:
    columns, key = ["repetition_id", "iteration"], ["iteration.repetition_id", "iteration.number"]
    return sa.ForeignKeyConstraint(columns, key, name=f"fk_{table}_repetition_id_iteration_iteration")


def _experiments() -> None:
    always: Columns = {"id": ID, "name": NAME, "edits": WHOLE, "created_at": MOMENT}
    _table("study", "id", always, {"notes tags webhook": TEXT, "archived_at": MOMENT})
    _index("study", "created_at id", "name id")
    _table(
        "experiment",
        "id",
        {
            **always,
            "position spec_version iterations precedence running": WHOLE,
            "strategy": sa.String(100),
            "state": _one_of("state", STATES),
            "spec": JSON,
            "rollouts": LARGE,
            "turn_at": MOMENT,
            "claimable": TRUTH,
        },
        {
            "study_id hardware sensitivity_id token_id": ID,
            "max_parallel": WHOLE,
            "computed_with refused_by paused_because notes tags webhook": TEXT,
            "started_at ended_at archived_at": MOMENT,
        },
        _belongs("experiment", "study"),
    )
    order = "created_at position id"
    _index("experiment", "study_id", "hardware", "sensitivity_id", "name id", "strategy id", "state id")
    _index("experiment", order, f"state {order}", f"strategy {order}")
    turn = ["claimable", "precedence", "running", "turn_at", "position", "id"]
    op.create_index("ix_experiment_turn", "experiment", turn)


def _provenances() -> None:
    _table("provenance", "id", {"id": ID, "facts": JSON, "created_at": MOMENT}, {})
    table, owners = "experiment_provenance", ("experiment", "provenance")
    always: Columns = {"experiment_id provenance_id": ID, "since": MOMENT}
    _table(table, "experiment_id provenance_id", always, {}, *(_belongs(table, owner) for owner in owners))


def _leased() -> tuple[Columns, Columns]:
    """Return the columns of work under a lease."""
    always: Columns = {"state": _one_of("state", STATES), "epoch attempts losses": WHOLE}
    return always, {"owner": NAME, "error": TEXT, "heartbeat_at started_at ended_at": MOMENT}


def _repetitions() -> None:
    always, sometimes = _leased()
    counts: Columns = {
        "number steps checkpoints iterations_done": WHOLE,
        "rollouts_done rollouts_failed rollouts_saved": LARGE,
        "seconds": REAL,
    }
    _table(
        "repetition",
        "id",
        {"experiment_id": ID, **counts, **always},
        {"provenance_id hardware": ID, "measuring_at": MOMENT, "hidden_error": TEXT, **sometimes},
        sa.Column("id", WHOLE, nullable=False),
        _belongs("repetition", "experiment"),
        sa.UniqueConstraint("experiment_id", "number", name="uq_repetition_experiment_id_number"),
        sa.UniqueConstraint("hardware", name="uq_repetition_hardware"),
    )
    _index("repetition", "experiment_id state number", "state heartbeat_at")
    _table(
        "attempt",
        "repetition_id epoch",
        {"repetition_id epoch": WHOLE, "owner": NAME, "started_at": MOMENT},
        {"ended_at": MOMENT, "ending": _one_of("ending", ENDINGS), "reason hidden_reason": TEXT},
        _belongs("attempt", "repetition"),
    )
    key = "repetition_id step part"
    always = {key: WHOLE, "answers": BINARY, "seconds": REAL}
    _table("checkpoint", key, always, {}, _belongs("checkpoint", "repetition"))


def _results() -> None:
    key, phases, cost = "repetition_id number", ("selection", "tuning", "transfer"), ("rollouts", "failures", "saved")
    _table(
        "iteration",
        key,
        {key: WHOLE, "seconds": REAL},
        {
            "selected_genome transferred_genome": JSON,
            " ".join(f"{phase}_{each}" for phase in phases for each in cost): LARGE,
            "simulated_fitness recorded_fitness": REAL,
            "ended_at": MOMENT,
        },
        _belongs("iteration", "repetition"),
    )
    of, kind = "repetition_id iteration", _one_of("kind", ("sample", "probe"))
    always: Columns = {of: WHOLE, "kind": kind, "genome": JSON, "measured_by": sa.String(100), "measured_at": MOMENT}
    sometimes: Columns = {"fitness": REAL, "readings repeats": JSON}
    _table("measurement", f"{of} kind", {**always, "left_out": TRUTH}, sometimes, _of_iteration("measurement"))
    always = {f"{of} rank": WHOLE, "parameters": JSON}
    sometimes = {"squared_error weight held_out_error": REAL, "lower upper": JSON}
    _table("simulator", f"{of} rank", always, sometimes, _of_iteration("simulator"))


def _measurements() -> None:
    sometimes: Columns = {"held taken_by": NAME, "taken_until ended_at": MOMENT, "lease_s": REAL, "safety": JSON}
    _table(
        "request",
        "id",
        {
            "id": ID,
            "repetition_id place iteration takes unanswered": WHOLE,
            "kind": _one_of("kind", ("sample", "probe")),
            "genome": JSON,
            "bench": NAME,
            "state": _one_of("state", REQUEST_STATES),
            "created_at": MOMENT,
        },
        {**sometimes, "branch": WHOLE, "same_as": ID},
        _belongs("request", "repetition"),
        sa.UniqueConstraint("held", name="uq_request_held"),
    )
    _index("request", "repetition_id place", "state created_at id", "state bench created_at id", "state taken_until")
    state, owners = _one_of("state", ANSWER_STATES), ("repetition", "request")
    always: Columns = {"id request_id": ID, "repetition_id": WHOLE, "state": state, "operator": NAME, "at": MOMENT}
    sometimes = {"values readings attachments traces": JSON, "failed note reason": TEXT, "replaces token_id": ID}
    _table("answer", "id", always, {"take": WHOLE, **sometimes}, *(_belongs("answer", owner) for owner in owners))
    _index("answer", "repetition_id", "request_id at id")


def _work() -> None:
    always: Columns = {"repetition_id number iteration": WHOLE, "reason": TEXT, "steps": JSON, "closed_at": MOMENT}
    _table("branch", "repetition_id number", always, {}, _belongs("branch", "repetition"))
    always = {"id": sa.String(64), "name": NAME, "media_type": sa.String(100), "content": BINARY, "created_at": MOMENT}
    _table("attachment", "id", always, {})
    always = {"sha256": sa.String(64), "name": sa.String(60), "text": sa.String(2_000_000), "created_at": MOMENT}
    _table("robot", "sha256", always, {})
    _index("robot", "name created_at")
    always, sometimes = _leased()
    always = {"id": ID, "spec": JSON, "created_at": MOMENT, **always}
    _table("sensitivity", "id", always, {"found": JSON, **sometimes})
    _index("sensitivity", "state created_at")


def _events() -> None:
    always: Columns = {"number": NUMBER, "experiment_id kind": ID, "body": JSON, "at": MOMENT}
    _table("event", "number", always, {"repetition": WHOLE})
    _index("event", "experiment_id number")
    _table("event_counter", "id", {"id": WHOLE, "latest": LARGE}, {})
    _table("supervisor", "owner", {"owner": NAME, "started_at heartbeat_at": MOMENT}, {})
    always = {"event": LARGE, "subject_id experiment_id": ID, "channel": sa.String(16), "message": JSON}
    sometimes: Columns = {"next_at delivered_at": MOMENT, "error": TEXT}
    _table("notification", "event subject_id channel", {**always, "attempts": WHOLE}, sometimes)
    _index("notification", "next_at event")
    _table("notifier", "id", {"id": WHOLE}, {"after": LARGE, "owner": NAME, "until": MOMENT})


def _callers() -> None:
    role = _one_of("role", ("reader", "runner", "admin"))
    always: Columns = {"id": ID, "name": NAME, "role": role, "digest": sa.String(64), "created_at": MOMENT}
    _table("token", "id", always, {"last_used_at revoked_at": MOMENT})
    always = {"caller": ID, "key": sa.String(255), "digest": sa.String(64), "created_at": MOMENT}
    _table("idempotency", "caller key", always, {"answer": JSON})
    _index("idempotency", "created_at")
    always = {"id": ID, "name": NAME, "deleted_at": MOMENT}
    _table("deletion", "id", always, {"study_id token_id": ID})
    always = {"name": sa.String(60), "shows": sa.String(16), "sort": sa.String(20), "created_at": MOMENT}
    _table("view", "name", always, {"query": TEXT})
