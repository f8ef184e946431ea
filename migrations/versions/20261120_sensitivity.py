"""Sensitivity checks.

Revision: 0002, after 0001.
"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
STATES = ("QUEUED", "RUNNING", "COMPLETED", "FAILED", "CANCELLED")


def upgrade() -> None:
    """Create the table of checks."""
    state = sa.Enum(*STATES, name="state", native_enum=False, create_constraint=True, length=16)
    op.create_table(
        "sensitivity",
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("spec", sa.JSON(), nullable=False),
        sa.Column("state", state, nullable=False),
        sa.Column("owner", sa.String(length=200)),
        sa.Column("epoch", sa.Integer(), nullable=False),
        sa.Column("heartbeat_at", MOMENT),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("losses", sa.Integer(), nullable=False),
        sa.Column("error", sa.Text()),
        sa.Column("found", sa.JSON()),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("started_at", MOMENT),
        sa.Column("ended_at", MOMENT),
        sa.PrimaryKeyConstraint("id", name="pk_sensitivity"),
    )
    op.create_index("ix_sensitivity_state_created_at", "sensitivity", ["state", "created_at"])


def downgrade() -> None:
    """Drop the table."""
    op.drop_table("sensitivity")
