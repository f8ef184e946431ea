"""Indexes for filtered lists.

Revision: 0007, after 0006.
"""

from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

FILTERED = ("state", "strategy")
ORDER = ["created_at", "position", "id"]


def upgrade() -> None:
    """Create indexes that read a filtered list of experiments in its order."""
    for column in FILTERED:
        op.create_index(f"ix_experiment_{column}_created_at_position_id", "experiment", [column, *ORDER])


def downgrade() -> None:
    """Drop the indexes."""
    for column in FILTERED:
        op.drop_index(f"ix_experiment_{column}_created_at_position_id", "experiment")
