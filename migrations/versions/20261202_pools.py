"""Robot files and pools share a table.

Revision: 0007, after 0006.
"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

OLD, NEW = 2_000_000, 8_000_000


def upgrade() -> None:
    """Move the rows into the new table."""
    kinds = sa.Enum("robot", "pool", name="kind", native_enum=False, create_constraint=True, length=16)
    _create("file", NEW, sa.Column("kind", kinds, nullable=False))
    op.execute(
        "INSERT INTO file (sha256, kind, name, text, created_at) "
        "SELECT sha256, 'robot', name, text, created_at FROM robot"
    )
    op.drop_table("robot")
    op.create_index("ix_file_kind_name_created_at", "file", ["kind", "name", "created_at"])


def downgrade() -> None:
    """Move the robots back, and refuse a database with pools, for which the older tables have no place."""
    if op.get_bind().execute(sa.text("SELECT 1 FROM file WHERE kind = 'pool' LIMIT 1")).first():
        raise ValueError("revision 0006 has no place for pools; restore a backup of then")
    _create("robot", OLD)
    op.execute("INSERT INTO robot (sha256, name, text, created_at) SELECT sha256, name, text, created_at FROM file")
    op.drop_table("file")
    op.create_index("ix_robot_name_created_at", "robot", ["name", "created_at"])


def _create(table: str, most: int, *columns: sa.Column[str]) -> None:
    op.create_table(
        table,
        sa.Column("sha256", sa.String(64), nullable=False),
        *columns,
        sa.Column("name", sa.String(60), nullable=False),
        sa.Column("text", sa.String(most), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("sha256", name=f"pk_{table}"),
    )
