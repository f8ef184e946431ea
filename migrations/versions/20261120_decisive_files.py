"""Decisive versions of any length, because they name external plug-in files.

Revision: 0008, after 0007.
"""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

COLUMNS = ("computed_with", "refused_by")
SHORT = sa.String(length=300)
EXPERIMENT = sa.table("experiment", *map(sa.column, COLUMNS))


def upgrade() -> None:
    """Remove the limit of 300 characters."""
    with op.batch_alter_table("experiment") as table:
        for column in COLUMNS:
            table.alter_column(column, existing_type=SHORT, type_=sa.Text(), existing_nullable=True)


def downgrade() -> None:
    """Restore the limit; longer values are truncated, and then match no supervisor."""
    for column in COLUMNS:
        op.execute(sa.update(EXPERIMENT).values({column: sa.func.substr(sa.column(column), 1, 300)}))
    with op.batch_alter_table("experiment") as table:
        for column in COLUMNS:
            table.alter_column(column, existing_type=sa.Text(), type_=SHORT, existing_nullable=True)
