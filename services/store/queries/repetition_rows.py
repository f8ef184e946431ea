"""Rows that belong to repetitions, by experiment."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import Select, select

from gaplab.services.store.models import AnswerRow, IterationRow, MeasurementRow, RepetitionRow, SimulatorRow

ResultRow = IterationRow | MeasurementRow | SimulatorRow | AnswerRow


def of_experiments(row: type[ResultRow], experiments: Sequence[str], *columns: Any) -> Select[Any]:  # noqa: ANN401
    """Return a query for columns of a table of results, joined with the repetitions of these experiments."""
    joined = select(*columns).join(RepetitionRow, RepetitionRow.id == row.repetition_id)
    return joined.where(RepetitionRow.experiment_id.in_(experiments))
