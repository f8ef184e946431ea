"""Notifications of ends, and webhooks of studies and experiments.

Revision: 0011, after 0010.
"""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns and tables; nobody is told of what ended before."""
    for name in ("study", "experiment"):
        with op.batch_alter_table(name) as table:
            table.add_column(sa.Column("webhook", sa.Text()))
    op.create_table(
        "notification",
        sa.Column("event", sa.BigInteger(), autoincrement=False, nullable=False),
        sa.Column("subject_id", sa.String(32), nullable=False),
        sa.Column("channel", sa.String(16), nullable=False),
        sa.Column("experiment_id", sa.String(32), nullable=False),
        sa.Column("message", sa.JSON(), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("next_at", sa.DateTime(timezone=True)),
        sa.Column("error", sa.Text()),
        sa.Column("delivered_at", sa.DateTime(timezone=True)),
        sa.PrimaryKeyConstraint("event", "subject_id", "channel", name="pk_notification"),
    )
    op.create_index("ix_notification_next_at_event", "notification", ["next_at", "event"])
    op.create_table(
        "notifier",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("after", sa.BigInteger()),
        sa.Column("owner", sa.String(200)),
        sa.Column("until", sa.DateTime(timezone=True)),
        sa.PrimaryKeyConstraint("id", name="pk_notifier"),
    )
    op.execute("INSERT INTO notifier (id) VALUES (1)")


def downgrade() -> None:
    """Remove them."""
    op.drop_table("notifier")
    op.drop_index("ix_notification_next_at_event", table_name="notification")
    op.drop_table("notification")
    for name in ("experiment", "study"):
        with op.batch_alter_table(name) as table:
            table.drop_column("webhook")
