"""What sensors said in a measurement, and what a tuner knows of a simulator beside its place.

Revision: 0012, after 0011.
"""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; what is stored has nothing in them."""
    with op.batch_alter_table("measurement") as table:
        table.add_column(sa.Column("readings", sa.JSON(none_as_null=True)))
    with op.batch_alter_table("simulator") as table:
        table.add_column(sa.Column("lower", sa.JSON(none_as_null=True)))
        table.add_column(sa.Column("upper", sa.JSON(none_as_null=True)))
        table.add_column(sa.Column("weight", sa.Double()))


def downgrade() -> None:
    """Remove the columns."""
    with op.batch_alter_table("simulator") as table:
        table.drop_column("weight")
        table.drop_column("upper")
        table.drop_column("lower")
    with op.batch_alter_table("measurement") as table:
        table.drop_column("readings")
