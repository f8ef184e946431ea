"""Physical measurements: requests, answers, closed branches, attachments, repeats, and repetitions that wait.

Revision: 0014, after 0013.
"""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
OLD = ("QUEUED", "RUNNING", "COMPLETED", "FAILED", "CANCELLED", "PAUSING", "PAUSED", "STOPPING")
NEW = (*OLD, "WAITING")
OLD_ENDINGS = ("completed", "paused", "stopped", "cancelled", "handed back", "lost", "failed")
NEW_ENDINGS = (*OLD_ENDINGS, "waiting")


def _words(values: tuple[str, ...]) -> str:
    return ", ".join(f"'{value}'" for value in values)


def _choice(name: str, *values: str) -> sa.Enum:
    return sa.Enum(*values, name=name, native_enum=False, create_constraint=True, length=16)


def upgrade() -> None:
    """Add the tables; nothing that is stored waits."""
    _permit(NEW, NEW_ENDINGS)
    with op.batch_alter_table("measurement") as table:
        table.add_column(sa.Column("repeats", sa.JSON()))
        table.add_column(sa.Column("left_out", sa.Boolean(), nullable=False, server_default=sa.false()))
    op.create_table(
        "request",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("repetition_id", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("iteration", sa.Integer(), nullable=False),
        sa.Column("kind", _choice("kind", "sample", "probe"), nullable=False),
        sa.Column("genome", sa.JSON(), nullable=False),
        sa.Column("bench", sa.String(200), nullable=False),
        sa.Column(
            "state", _choice("state", "open", "taken", "measured", "failed", "withdrawn", "stuck"), nullable=False
        ),
        sa.Column("held", sa.String(200)),
        sa.Column("takes", sa.Integer(), nullable=False),
        sa.Column("unanswered", sa.Integer(), nullable=False),
        sa.Column("taken_by", sa.String(200)),
        sa.Column("taken_until", MOMENT),
        sa.Column("lease_s", sa.Double()),
        sa.Column("safety", sa.JSON()),
        sa.Column("branch", sa.Integer()),
        sa.Column("same_as", sa.String(32)),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("ended_at", MOMENT),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_request_repetition_id_repetition"),
        sa.PrimaryKeyConstraint("id", name="pk_request"),
        sa.UniqueConstraint("held", name="uq_request_held"),
    )
    op.create_index("ix_request_repetition_id_place", "request", ["repetition_id", "place"])
    op.create_index("ix_request_state_created_at_id", "request", ["state", "created_at", "id"])
    op.create_index("ix_request_state_bench_created_at_id", "request", ["state", "bench", "created_at", "id"])
    op.create_index("ix_request_state_taken_until", "request", ["state", "taken_until"])
    op.create_table(
        "answer",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("repetition_id", sa.Integer(), nullable=False),
        sa.Column("request_id", sa.String(32), nullable=False),
        sa.Column("take", sa.Integer()),
        sa.Column("state", _choice("state", "counted", "conflict", "replaced", "void", "dismissed"), nullable=False),
        sa.Column("values", sa.JSON()),
        sa.Column("readings", sa.JSON()),
        sa.Column("failed", sa.Text()),
        sa.Column("operator", sa.String(200), nullable=False),
        sa.Column("note", sa.Text()),
        sa.Column("attachments", sa.JSON()),
        sa.Column("traces", sa.JSON()),
        sa.Column("replaces", sa.String(32)),
        sa.Column("reason", sa.Text()),
        sa.Column("token_id", sa.String(32)),
        sa.Column("at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_answer_repetition_id_repetition"),
        sa.ForeignKeyConstraint(["request_id"], ["request.id"], name="fk_answer_request_id_request"),
        sa.PrimaryKeyConstraint("id", name="pk_answer"),
    )
    op.create_index("ix_answer_repetition_id", "answer", ["repetition_id"])
    op.create_index("ix_answer_request_id_at_id", "answer", ["request_id", "at", "id"])
    op.create_table(
        "branch",
        sa.Column("repetition_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("iteration", sa.Integer(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("steps", sa.JSON(), nullable=False),
        sa.Column("closed_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_branch_repetition_id_repetition"),
        sa.PrimaryKeyConstraint("repetition_id", "number", name="pk_branch"),
    )
    op.create_table(
        "attachment",
        sa.Column("id", sa.String(64), nullable=False),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("media_type", sa.String(100), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_attachment"),
    )


def downgrade() -> None:
    """Remove them; what waits for a measurement is paused, because nothing can answer it."""
    for name in ("attachment", "branch", "answer", "request"):
        op.drop_table(name)
    with op.batch_alter_table("measurement") as table:
        table.drop_column("left_out")
        table.drop_column("repeats")
    op.execute("UPDATE repetition SET state = 'QUEUED' WHERE state = 'WAITING'")
    op.execute("UPDATE experiment SET state = 'PAUSED' WHERE state = 'WAITING'")
    op.execute("UPDATE attempt SET ending = 'handed back' WHERE ending = 'waiting'")
    _permit(OLD, OLD_ENDINGS)


def _permit(states: tuple[str, ...], endings: tuple[str, ...]) -> None:
    last = _last_repetition()
    for name, column, values in (
        ("experiment", "state", states),
        ("repetition", "state", states),
        ("sensitivity", "state", states),
        ("attempt", "ending", endings),
    ):
        with op.batch_alter_table(name, table_kwargs={"sqlite_autoincrement": name == "repetition"}) as table:
            table.drop_constraint(op.f(f"ck_{name}_{column}"), type_="check")
            table.create_check_constraint(op.f(f"ck_{name}_{column}"), f"{column} IN ({_words(values)})")
    if last is not None:
        op.execute("DELETE FROM sqlite_sequence WHERE name = 'repetition'")
        insert = sa.text("INSERT INTO sqlite_sequence (name, seq) VALUES ('repetition', :last)")
        op.get_bind().execute(insert, {"last": last})


def _last_repetition() -> int | None:
    """Return the last id that SQLite gave to a repetition; a rebuilt table would give those of deleted ones again."""
    if op.get_bind().dialect.name != "sqlite":
        return None
    sequence = sa.text("SELECT seq FROM sqlite_sequence WHERE name = 'repetition'")
    last: int | None = op.get_bind().execute(sequence).scalar()
    return last
