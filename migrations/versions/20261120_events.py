"""Events, provenance, and supervisors.

Revision: 0005, after 0004.
"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
NUMBER = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Create the tables, and start the counter; earlier changes have no events."""
    op.create_table(
        "event",
        sa.Column("number", NUMBER, nullable=False, autoincrement=False),
        sa.Column("experiment_id", sa.String(length=32), nullable=False),
        sa.Column("repetition", sa.Integer()),
        sa.Column("kind", sa.String(length=32), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_event"),
    )
    op.create_index("ix_event_experiment_id_number", "event", ["experiment_id", "number"])
    counter = op.create_table(
        "event_counter",
        sa.Column("id", sa.Integer(), nullable=False, autoincrement=False),
        sa.Column("latest", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_event_counter"),
    )
    op.bulk_insert(counter, [{"id": 1, "latest": 0}])
    _create_provenance()
    op.create_table(
        "supervisor",
        sa.Column("owner", sa.String(length=200), nullable=False),
        sa.Column("started_at", MOMENT, nullable=False),
        sa.Column("heartbeat_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("owner", name="pk_supervisor"),
    )
    op.add_column("experiment", sa.Column("computed_with", sa.String(length=300)))
    op.add_column("experiment", sa.Column("refused_by", sa.String(length=300)))
    op.add_column("experiment", sa.Column("sensitivity_id", sa.String(length=32)))
    op.create_index("ix_experiment_sensitivity_id", "experiment", ["sensitivity_id"])
    op.add_column("repetition", sa.Column("provenance_id", sa.String(length=32)))


def downgrade() -> None:
    """Remove the tables and columns."""
    op.drop_column("repetition", "provenance_id")
    op.drop_index("ix_experiment_sensitivity_id", "experiment")
    for column in ("sensitivity_id", "refused_by", "computed_with"):
        op.drop_column("experiment", column)
    for table in ("supervisor", "experiment_provenance", "provenance", "event_counter", "event"):
        op.drop_table(table)


def _create_provenance() -> None:
    op.create_table(
        "provenance",
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("facts", sa.JSON(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_provenance"),
    )
    op.create_table(
        "experiment_provenance",
        sa.Column("experiment_id", sa.String(length=32), nullable=False),
        sa.Column("provenance_id", sa.String(length=32), nullable=False),
        sa.Column("since", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("experiment_id", "provenance_id", name="pk_experiment_provenance"),
        sa.ForeignKeyConstraint(
            ["experiment_id"], ["experiment.id"], name="fk_experiment_provenance_experiment_id_experiment"
        ),
        sa.ForeignKeyConstraint(
            ["provenance_id"], ["provenance.id"], name="fk_experiment_provenance_provenance_id_provenance"
        ),
    )
