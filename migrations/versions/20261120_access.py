"""Tokens, idempotency keys, notes, and indexes for sorted lists.

Revision: 0006, after 0005.
"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
ORDERS = {"experiment": ("name", "strategy", "state"), "study": ("name",)}


def upgrade() -> None:
    """Add tables and columns; existing rows stay unchanged."""
    role = sa.Enum("reader", "runner", "admin", name="role", native_enum=False, create_constraint=True, length=16)
    op.create_table(
        "token",
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("role", role, nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("last_used_at", MOMENT),
        sa.Column("revoked_at", MOMENT),
        sa.PrimaryKeyConstraint("id", name="pk_token"),
    )
    op.create_table(
        "idempotency",
        sa.Column("caller", sa.String(length=32), nullable=False),
        sa.Column("key", sa.String(length=255), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("answer", sa.JSON()),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("caller", "key", name="pk_idempotency"),
    )
    op.create_index("ix_idempotency_created_at", "idempotency", ["created_at"])
    for table in ("experiment", "study"):
        op.add_column(table, sa.Column("notes", sa.Text()))
        op.add_column(table, sa.Column("edits", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("experiment", sa.Column("token_id", sa.String(length=32)))
    for table, columns in ORDERS.items():
        for column in columns:
            op.create_index(f"ix_{table}_{column}_id", table, [column, "id"])


def downgrade() -> None:
    """Remove the tables, columns and indexes."""
    for table, columns in ORDERS.items():
        for column in columns:
            op.drop_index(f"ix_{table}_{column}_id", table)
    op.drop_column("experiment", "token_id")
    for table in ("experiment", "study"):
        op.drop_column(table, "edits")
        op.drop_column(table, "notes")
    op.drop_table("idempotency")
    op.drop_table("token")
