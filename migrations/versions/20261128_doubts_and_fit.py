"""Doubts about answers, the fit of simulators beside what noise alone leaves, and rollouts of checkpoints.

Revision: 0002, after 0001.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

COLUMNS = (("answer", "doubts", sa.JSON), ("simulator", "fit", sa.JSON))
COLUMNS += (("checkpoint", "rollouts", sa.BigInteger), ("checkpoint", "budget", sa.BigInteger))


def upgrade() -> None:
    """Add the columns."""
    for table, name, kind in COLUMNS:
        always = {} if kind is sa.JSON else {"nullable": False, "server_default": "0"}
        op.add_column(table, sa.Column(name, kind(), **always))


def downgrade() -> None:
    """Drop them."""
    for table, name, _ in reversed(COLUMNS):
        op.drop_column(table, name)
