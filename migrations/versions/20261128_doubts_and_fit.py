"""Doubts about answers, and the fit of simulators beside what noise alone leaves.

Revision: 0002, after 0001.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

COLUMNS = (("answer", "doubts"), ("simulator", "fit"))


def upgrade() -> None:
    """Add the columns."""
    for table, name in COLUMNS:
        op.add_column(table, sa.Column(name, sa.JSON()))


def downgrade() -> None:
    """Drop them."""
    for table, name in reversed(COLUMNS):
        op.drop_column(table, name)
