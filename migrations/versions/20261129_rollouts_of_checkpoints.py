"""Rollouts of checkpoints: how far a step has come.

Revision: 0003, after 0002.
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

COLUMNS = ("rollouts", "budget")


def upgrade() -> None:
    """Add the columns."""
    for name in COLUMNS:
        op.add_column("checkpoint", sa.Column(name, sa.BigInteger(), nullable=False, server_default="0"))


def downgrade() -> None:
    """Drop them."""
    for name in reversed(COLUMNS):
        op.drop_column("checkpoint", name)
