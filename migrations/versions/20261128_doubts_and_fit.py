"""Doubts about answers, and the fit of simulators beside what noise alone leaves.

Revision: 0002, after 0001.
"""

from typing import Any

import sqlalchemy as sa
from alembic import op
from sqlalchemy.types import TypeEngine

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

COLUMNS: tuple[tuple[str, str, TypeEngine[Any]], ...] = (
    ("answer", "doubts", sa.JSON()),
    ("simulator", "expected_error", sa.Double()),
    ("simulator", "surprise", sa.Double()),
    ("simulator", "interval_scale", sa.Double()),
    ("simulator", "reading_errors", sa.JSON()),
)


def upgrade() -> None:
    """Add the columns."""
    for table, name, kind in COLUMNS:
        op.add_column(table, sa.Column(name, kind))


def downgrade() -> None:
    """Drop them."""
    for table, name, _ in reversed(COLUMNS):
        op.drop_column(table, name)
