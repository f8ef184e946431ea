"""Indexes of the filtered lists.

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
    """Let a list of experiments that is filtered be read in its order, however few of all it shows."""
    for column in FILTERED:
        op.create_index(f"ix_experiment_{column}_created_at_position_id", "experiment", [column, *ORDER])


def downgrade() -> None:
    """Take it back."""
    for column in FILTERED:
        op.drop_index(f"ix_experiment_{column}_created_at_position_id", "experiment")
