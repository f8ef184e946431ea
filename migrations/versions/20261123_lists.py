"""Tags, archived records, deletions and saved views; ids of repetitions are never used again.

Revision: 0010, after 0009.
"""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add columns and tables; nothing is tagged or archived yet."""
    for name in ("study", "experiment"):
        with op.batch_alter_table(name) as table:
            table.add_column(sa.Column("tags", sa.Text()))
            table.add_column(sa.Column("archived_at", sa.DateTime(timezone=True)))
    _rebuild_repetitions(autoincrement=True)
    op.create_table(
        "deletion",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("study_id", sa.String(32)),
        sa.Column("name", sa.String(200), nullable=False),
        sa.Column("token_id", sa.String(32)),
        sa.Column("deleted_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_deletion"),
    )
    op.create_table(
        "view",
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("shows", sa.String(16), nullable=False),
        sa.Column("query", sa.Text()),
        sa.Column("sort", sa.String(20), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_view"),
    )


def downgrade() -> None:
    """Remove them."""
    op.drop_table("view")
    op.drop_table("deletion")
    _rebuild_repetitions(autoincrement=False)
    for name in ("experiment", "study"):
        with op.batch_alter_table(name) as table:
            table.drop_column("archived_at")
            table.drop_column("tags")


def _rebuild_repetitions(*, autoincrement: bool) -> None:
    """Rebuild SQLite's table of repetitions with or without AUTOINCREMENT; the sequence of Postgres never goes back."""
    if op.get_bind().dialect.name == "sqlite":
        with op.batch_alter_table(
            "repetition", recreate="always", table_kwargs={"sqlite_autoincrement": autoincrement}
        ):
            pass
