"""The discrepancy of the best simulators from held-out samples.

Revision: 0013, after 0012.
"""

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; what is stored held nothing out."""
    with op.batch_alter_table("simulator") as table:
        table.add_column(sa.Column("held_out_error", sa.Double()))


def downgrade() -> None:
    """Remove the column."""
    with op.batch_alter_table("simulator") as table:
        table.drop_column("held_out_error")
