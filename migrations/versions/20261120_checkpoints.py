"""Checkpoints of current steps.

Revision: 0004, after 0003.
"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the table of checkpoints, and count them in each repetition."""
    op.create_table(
        "checkpoint",
        sa.Column("repetition_id", sa.Integer(), nullable=False),
        sa.Column("step", sa.Integer(), nullable=False),
        sa.Column("part", sa.Integer(), nullable=False),
        sa.Column("answers", sa.LargeBinary(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_checkpoint_repetition_id_repetition"),
        sa.PrimaryKeyConstraint("repetition_id", "step", "part", name="pk_checkpoint"),
    )
    with op.batch_alter_table("repetition") as table:
        table.add_column(sa.Column("checkpoints", sa.Integer(), nullable=False, server_default="0"))


def downgrade() -> None:
    """Drop the checkpoints; current steps are simulated again."""
    with op.batch_alter_table("repetition") as table:
        table.drop_column("checkpoints")
    op.drop_table("checkpoint")
