"""The time of each experiment's latest turn.

Revision: 0016, after 0015.
"""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None

INDEX = "ix_experiment_turn"
BEFORE, AFTER = (["claimable", "precedence", "running", since, "position", "id"] for since in ("created_at", "turn_at"))


def upgrade() -> None:
    """Add the column; before its first turn, an experiment has been waiting since its submission."""
    op.drop_index(INDEX, "experiment")
    with op.batch_alter_table("experiment") as table:
        table.add_column(sa.Column("turn_at", sa.DateTime(timezone=True)))
    op.execute("UPDATE experiment SET turn_at = created_at")
    with op.batch_alter_table("experiment") as table:
        table.alter_column("turn_at", existing_type=sa.DateTime(timezone=True), nullable=False)
    op.create_index(INDEX, "experiment", AFTER)


def downgrade() -> None:
    """Remove the column."""
    op.drop_index(INDEX, "experiment")
    with op.batch_alter_table("experiment") as table:
        table.drop_column("turn_at")
    op.create_index(INDEX, "experiment", BEFORE)
