"""First tables.

Revision: 0001, after nothing.
"""

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)
STATES = ("QUEUED", "RUNNING", "COMPLETED", "FAILED", "CANCELLED")


def choice(name: str, *permitted: str) -> sa.Enum:
    """Return a text column type with a named constraint on its values."""
    return sa.Enum(*permitted, name=name, native_enum=False, create_constraint=True, length=16)


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "study",
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_study"),
    )
    op.create_index("ix_study_created_at_id", "study", ["created_at", "id"])

    op.create_table(
        "experiment",
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("study_id", sa.String(length=32)),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("strategy", sa.String(length=100), nullable=False),
        sa.Column("state", choice("state", *STATES), nullable=False),
        sa.Column("spec", sa.JSON(), nullable=False),
        sa.Column("spec_version", sa.Integer(), nullable=False),
        sa.Column("iterations", sa.Integer(), nullable=False),
        sa.Column("rollouts", sa.BigInteger(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("started_at", MOMENT),
        sa.Column("ended_at", MOMENT),
        sa.ForeignKeyConstraint(["study_id"], ["study.id"], name="fk_experiment_study_id_study"),
        sa.PrimaryKeyConstraint("id", name="pk_experiment"),
    )
    op.create_index("ix_experiment_created_at_position_id", "experiment", ["created_at", "position", "id"])
    op.create_index("ix_experiment_study_id", "experiment", ["study_id"])

    op.create_table(
        "repetition",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("experiment_id", sa.String(length=32), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("state", choice("state", *STATES), nullable=False),
        sa.Column("owner", sa.String(length=200)),
        sa.Column("epoch", sa.Integer(), nullable=False),
        sa.Column("heartbeat_at", MOMENT),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("losses", sa.Integer(), nullable=False),
        sa.Column("error", sa.Text()),
        sa.Column("steps", sa.Integer(), nullable=False),
        sa.Column("iterations_done", sa.Integer(), nullable=False),
        sa.Column("rollouts_done", sa.BigInteger(), nullable=False),
        sa.Column("rollouts_failed", sa.BigInteger(), nullable=False),
        sa.Column("rollouts_saved", sa.BigInteger(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.Column("started_at", MOMENT),
        sa.Column("ended_at", MOMENT),
        sa.ForeignKeyConstraint(["experiment_id"], ["experiment.id"], name="fk_repetition_experiment_id_experiment"),
        sa.PrimaryKeyConstraint("id", name="pk_repetition"),
        sa.UniqueConstraint("experiment_id", "number", name="uq_repetition_experiment_id_number"),
    )
    op.create_index("ix_repetition_state_heartbeat_at", "repetition", ["state", "heartbeat_at"])

    op.create_table(
        "iteration",
        sa.Column("repetition_id", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("selected_genome", sa.JSON()),
        sa.Column("selection_rollouts", sa.BigInteger()),
        sa.Column("selection_failures", sa.BigInteger()),
        sa.Column("selection_saved", sa.BigInteger()),
        sa.Column("tuning_rollouts", sa.BigInteger()),
        sa.Column("tuning_failures", sa.BigInteger()),
        sa.Column("tuning_saved", sa.BigInteger()),
        sa.Column("transferred_genome", sa.JSON()),
        sa.Column("simulated_fitness", sa.Double()),
        sa.Column("transfer_rollouts", sa.BigInteger()),
        sa.Column("transfer_failures", sa.BigInteger()),
        sa.Column("transfer_saved", sa.BigInteger()),
        sa.Column("recorded_fitness", sa.Double()),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.Column("ended_at", MOMENT),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_iteration_repetition_id_repetition"),
        sa.PrimaryKeyConstraint("repetition_id", "number", name="pk_iteration"),
    )
    op.create_table(
        "measurement",
        sa.Column("repetition_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("iteration", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("kind", choice("kind", "sample", "probe"), nullable=False),
        sa.Column("genome", sa.JSON(), nullable=False),
        sa.Column("fitness", sa.Double()),
        sa.Column("measured_by", sa.String(length=100), nullable=False),
        sa.Column("measured_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(
            ["repetition_id", "iteration"],
            ["iteration.repetition_id", "iteration.number"],
            name="fk_measurement_repetition_id_iteration_iteration",
        ),
        sa.PrimaryKeyConstraint("repetition_id", "iteration", "kind", name="pk_measurement"),
    )
    op.create_table(
        "simulator",
        sa.Column("repetition_id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("iteration", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("rank", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("parameters", sa.JSON(), nullable=False),
        sa.Column("squared_error", sa.Double()),
        sa.ForeignKeyConstraint(
            ["repetition_id", "iteration"],
            ["iteration.repetition_id", "iteration.number"],
            name="fk_simulator_repetition_id_iteration_iteration",
        ),
        sa.PrimaryKeyConstraint("repetition_id", "iteration", "rank", name="pk_simulator"),
    )


def downgrade() -> None:
    """Drop the tables."""
    op.drop_table("simulator")
    op.drop_table("measurement")
    op.drop_table("iteration")
    op.drop_table("repetition")
    op.drop_table("experiment")
    op.drop_table("study")
