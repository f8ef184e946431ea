"""Robot files.

Revision: 0015, after 0014.
"""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "robot",
        sa.Column("sha256", sa.String(64), nullable=False),
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("text", sa.String(2_000_000), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("sha256", name="pk_robot"),
    )
    op.create_index("ix_robot_name_created_at", "robot", ["name", "created_at"])


def downgrade() -> None:
    """Remove the table; specs that name its robots cannot run then."""
    op.drop_table("robot")
