"""Failures of reality: when a measurement began, why an experiment was paused, and one holder for each hardware.

Revision: 0009, after 0008.
"""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; what is stored has nothing in them."""
    with op.batch_alter_table("experiment") as table:
        table.add_column(sa.Column("paused_because", sa.Text()))
        table.add_column(sa.Column("hardware", sa.String(32)))
        table.create_index("ix_experiment_hardware", ["hardware"])
    with op.batch_alter_table("repetition") as table:
        table.add_column(sa.Column("measuring_at", sa.DateTime(timezone=True)))
        table.add_column(sa.Column("hidden_error", sa.Text()))
        table.add_column(sa.Column("hardware", sa.String(32)))
        table.create_unique_constraint("uq_repetition_hardware", ["hardware"])
    with op.batch_alter_table("attempt") as table:
        table.add_column(sa.Column("hidden_reason", sa.Text()))


def downgrade() -> None:
    """Remove the columns."""
    with op.batch_alter_table("attempt") as table:
        table.drop_column("hidden_reason")
    with op.batch_alter_table("repetition") as table:
        table.drop_constraint("uq_repetition_hardware", type_="unique")
        table.drop_column("hardware")
        table.drop_column("hidden_error")
        table.drop_column("measuring_at")
    with op.batch_alter_table("experiment") as table:
        table.drop_index("ix_experiment_hardware")
        table.drop_column("hardware")
        table.drop_column("paused_because")
