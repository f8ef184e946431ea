"""Rows that belong to repetitions, by experiment."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import ColumnElement, Select, literal_column, select

from gaplab.schemas.records import MeasurementKind
from gaplab.services.store.models import LOG, AnswerRow, RepetitionRow, StepKind, StepRow

MEASURED = {MeasurementKind.SAMPLE: StepKind.MEASURED, MeasurementKind.PROBE: StepKind.PROBED}
"""The kind of step that a measurement is."""


def of_experiments(row: type[AnswerRow | StepRow], experiments: Sequence[str], *columns: Any) -> Select[Any]:  # noqa: ANN401
    """Return a query for columns of a table, joined with the repetitions of these experiments."""
    joined = select(*columns).join(RepetitionRow, RepetitionRow.id == row.repetition_id)
    return joined.where(RepetitionRow.experiment_id.in_(experiments))


def in_log(row: type[StepRow], kind: StepKind) -> ColumnElement[bool]:
    """Return the condition that a step is in the log, and of a kind.

    Its values are part of the statement, so that databases know that the index of the curve serves it.
    """
    return (row.branch == literal_column(str(LOG))) & (row.kind == literal_column(f"'{kind.value}'"))


def steps_of(experiments: Sequence[str], kind: StepKind, *columns: Any) -> Select[Any]:  # noqa: ANN401
    """Return a query for columns of the steps of a kind in the logs of these experiments."""
    return of_experiments(StepRow, experiments, *columns).where(in_log(StepRow, kind))


def same_log(step: type[StepRow], other: type[StepRow], kind: StepKind) -> ColumnElement[bool]:
    """Return the condition that another step is of the same log, and of a kind."""
    return (other.repetition_id == step.repetition_id) & in_log(other, kind)


def best(tuned: type[StepRow]) -> ColumnElement[Any]:
    """Return the best simulator in the body of a tuned step, read without the others."""
    return tuned.body["simulators", 0]
