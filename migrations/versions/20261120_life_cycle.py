"""States of the life cycle, scheduling, and attempts.

Revision: 0003, after 0002.
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
OLD = ("QUEUED", "RUNNING", "COMPLETED", "FAILED", "CANCELLED")
NEW = (*OLD, "PAUSING", "PAUSED", "STOPPING")
ENDINGS = ("completed", "paused", "stopped", "cancelled", "handed back", "lost", "failed")
WITH_STATE = ("experiment", "repetition", "sensitivity")

RUNNING = """
    UPDATE experiment SET running =
        (SELECT COUNT(*) FROM repetition WHERE repetition.experiment_id = experiment.id AND state = 'RUNNING')
    WHERE state IN ('QUEUED', 'RUNNING')
"""
CLAIMABLE = """
    UPDATE experiment SET claimable = true
    WHERE state IN ('QUEUED', 'RUNNING')
        AND EXISTS (SELECT 1 FROM repetition WHERE repetition.experiment_id = experiment.id AND state = 'QUEUED')
"""
ATTEMPTS = """
    INSERT INTO attempt (repetition_id, epoch, owner, started_at)
    SELECT id, epoch, owner, started_at FROM repetition WHERE state = 'RUNNING' AND owner IS NOT NULL
"""


def upgrade() -> None:
    """Add states, scheduling columns and attempts; earlier experiments keep their order."""
    _permit(NEW)
    with op.batch_alter_table("experiment") as table:
        table.add_column(sa.Column("precedence", sa.Integer(), nullable=False, server_default="0"))
        table.add_column(sa.Column("max_parallel", sa.Integer()))
        table.add_column(sa.Column("running", sa.Integer(), nullable=False, server_default="0"))
        table.add_column(sa.Column("claimable", sa.Boolean(), nullable=False, server_default=sa.false()))
    turn = ["claimable", "precedence", "running", "created_at", "position", "id"]
    op.create_index("ix_experiment_turn", "experiment", turn)
    by_state = ["experiment_id", "state", "number"]
    op.create_index("ix_repetition_experiment_id_state_number", "repetition", by_state)
    op.create_table(
        "attempt",
        sa.Column("repetition_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("epoch", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("owner", sa.String(length=200), nullable=False),
        sa.Column("started_at", MOMENT, nullable=False),
        sa.Column("ended_at", MOMENT),
        sa.Column("ending", sa.Enum(*ENDINGS, name="ending", native_enum=False, create_constraint=True, length=16)),
        sa.Column("reason", sa.Text()),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_attempt_repetition_id_repetition"),
        sa.PrimaryKeyConstraint("repetition_id", "epoch", name="pk_attempt"),
    )
    for statement in (RUNNING, CLAIMABLE, ATTEMPTS):
        op.execute(statement)


def downgrade() -> None:
    """Remove them; paused and stopping experiments continue."""
    op.drop_table("attempt")
    op.drop_index("ix_repetition_experiment_id_state_number", "repetition")
    op.drop_index("ix_experiment_turn", "experiment")
    with op.batch_alter_table("experiment") as table:
        for column in ("claimable", "running", "max_parallel", "precedence"):
            table.drop_column(column)
    op.execute("UPDATE experiment SET state = 'RUNNING' WHERE state IN ('PAUSING', 'PAUSED', 'STOPPING')")
    _permit(OLD)


def _permit(states: tuple[str, ...]) -> None:
    words = ", ".join(f"'{state}'" for state in states)
    for name in WITH_STATE:
        with op.batch_alter_table(name) as table:
            table.drop_constraint(op.f(f"ck_{name}_state"), type_="check")
            table.create_check_constraint(op.f(f"ck_{name}_state"), f"state IN ({words})")
