"""One table of steps in place of iterations, measurements, simulators and the JSON of branches.

Revision: 0004, after 0003.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

KINDS = ("selected", "measured", "tuned", "transferred", "probed")
PHASES = {"selected": "selection", "tuned": "tuning", "transferred": "transfer"}
COSTS = ("rollouts", "failures", "saved")
OLD = ("measurement", "simulator", "iteration")
_AT_ONCE = 1_000

Row = dict[str, Any]


def upgrade() -> None:
    """Create the table, fill it, and drop those that it replaces."""
    table = op.create_table(
        "step",
        *(sa.Column(name, sa.Integer(), nullable=False, autoincrement=False) for name in ("repetition_id", "branch")),
        sa.Column(
            "kind",
            sa.Enum(*KINDS, name="kind", native_enum=False, create_constraint=True, length=16),
            nullable=False,
        ),
        *(sa.Column(name, sa.Integer(), nullable=False, autoincrement=False) for name in ("iteration", "place")),
        *(sa.Column(name, sa.Double()) for name in ("fitness", "recorded")),
        sa.Column("measured_by", sa.String(200)),
        *(sa.Column(name, sa.BigInteger(), nullable=False) for name in COSTS),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.Column("at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("repetition_id", "branch", "kind", "iteration", name="pk_step"),
        sa.ForeignKeyConstraint(["repetition_id"], ["repetition.id"], name="fk_step_repetition_id_repetition"),
    )
    probes, columns = sa.text("kind = 'probed'"), ["repetition_id", "branch", "kind", "iteration", "recorded"]
    op.create_index("ix_step_curve", "step", columns, sqlite_where=probes, postgresql_where=probes)
    connection = op.get_bind()
    found = sa.MetaData()
    found.reflect(connection, only=["repetition", "branch", *OLD])
    for repetition in connection.execute(sa.select(found.tables["repetition"].c.id)).scalars().all():
        rows = [*_steps(connection, found.tables, repetition), *_closed(connection, found.tables, repetition)]
        for start in range(0, len(rows), _AT_ONCE):
            connection.execute(sa.insert(table), rows[start : start + _AT_ONCE])
    for name in OLD:
        op.drop_table(name)
    op.drop_column("branch", "steps")
    op.drop_column("repetition", "iterations_done")


def downgrade() -> None:
    """Refuse a database with results: the older tables have no place for all of them."""
    if op.get_bind().execute(sa.text("SELECT 1 FROM step LIMIT 1")).first():
        raise ValueError("revision 0003 has no place for a log of steps; restore a backup of then")
    op.drop_table("step")
    op.add_column("branch", sa.Column("steps", sa.JSON(), nullable=False, server_default="[]"))
    op.add_column("repetition", sa.Column("iterations_done", sa.Integer(), nullable=False, server_default="0"))
    for name in reversed(OLD):  # 0001 drops them
        op.create_table(name, sa.Column("iteration", sa.Integer()), sa.Column("fit", sa.JSON()))


def _steps(connection: sa.Connection, tables: Mapping[str, sa.Table], repetition: int) -> Iterator[Row]:
    """Yield the steps of a log. The seconds of an iteration are shared by the rollouts of its steps."""
    measured = {(row["iteration"], row["kind"]): row for row in _rows(connection, tables["measurement"], repetition)}
    simulators: dict[int, list[Row]] = defaultdict(list)
    for row in sorted(_rows(connection, tables["simulator"], repetition), key=lambda row: row["rank"]):
        simulators[row["iteration"]].append(_simulator(row))
    for iteration in sorted(_rows(connection, tables["iteration"], repetition), key=lambda row: row["number"]):
        number = iteration["number"]
        sample, probe = (measured.get((number, kind)) for kind in ("sample", "probe"))
        found = {
            "selected": iteration["selected_genome"] and {"body": {"genome": iteration["selected_genome"]}},
            "measured": sample and _measured(sample, {"genome": sample["genome"]}),
            "tuned": iteration["tuning_rollouts"] is not None and {"body": {"simulators": simulators[number]}},
            "transferred": iteration["transferred_genome"]
            and {"fitness": iteration["simulated_fitness"], "body": {"genome": iteration["transferred_genome"]}},
            "probed": probe and _measured(probe, {}) | {"recorded": iteration["recorded_fitness"]},
        }
        whole = sum(iteration[f"{phase}_rollouts"] or 0 for phase in PHASES.values())
        steps = [(kind, step) for kind, step in found.items() if step]
        for kind, step in steps:
            cost = {name: iteration[f"{PHASES[kind]}_{name}"] or 0 for name in COSTS} if kind in PHASES else {}
            share = cost.get("rollouts", 0) / whole if whole else 1 / len(steps)
            at = {"at": iteration["ended_at"] or datetime.now(UTC), "seconds": iteration["seconds"] * share}
            yield _row(repetition, 0, kind, number, at | cost | step)


def _closed(connection: sa.Connection, tables: Mapping[str, sa.Table], repetition: int) -> Iterator[Row]:
    """Yield the steps of closed branches, whose costs were not stored."""
    for branch in _rows(connection, tables["branch"], repetition):
        for step in branch["steps"]:
            body = {name: step[name] for name in ("genome", "simulators") if name in step}
            body |= {"repeats": step["repeats"]} if step.get("repeats") else {}
            known = {
                "fitness": step.get("fitness", step.get("simulated_fitness")),
                "recorded": step.get("recorded_fitness"),
                "body": body,
                "at": branch["closed_at"],
            }
            known |= {"measured_by": "unknown"} if step["kind"] in ("measured", "probed") else {}
            yield _row(repetition, branch["number"], step["kind"], step["iteration"], known)


def _row(repetition: int, branch: int, kind: str, iteration: int, known: Row) -> Row:
    empty = {"fitness": None, "recorded": None, "measured_by": None, **dict.fromkeys(COSTS, 0), "seconds": 0.0}
    place = len(KINDS) * iteration + KINDS.index(kind) - KINDS.index("tuned")
    own = {"repetition_id": repetition, "branch": branch, "kind": kind, "iteration": iteration, "place": place}
    return empty | known | own


def _measured(row: Row, body: Row) -> Row:
    body |= {name: row[name] for name in ("readings", "repeats") if row[name]}
    by = None if row["left_out"] else row["measured_by"]
    return {"fitness": row["fitness"], "body": body, "measured_by": by, "at": row["measured_at"]}


def _simulator(row: Row) -> Row:
    names = ("parameters", "squared_error", "lower", "upper", "weight", "held_out_error", "fit")
    return {name: row[name] for name in names if row[name] is not None or name == "squared_error"}


def _rows(connection: sa.Connection, table: sa.Table, repetition: int) -> Iterable[Row]:
    query = sa.select(table).where(table.c.repetition_id == repetition)
    return [dict(row) for row in connection.execute(query).mappings()]
