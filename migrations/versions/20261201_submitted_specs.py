"""A study keeps its spec as it was submitted.

Revision: 0006, after 0005.
"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("study", sa.Column("submitted", sa.JSON()))


def downgrade() -> None:
    """Drop it."""
    op.drop_column("study", "submitted")
