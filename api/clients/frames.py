"""Frames of pandas, which may not be installed."""

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

from gaplab.api.clients.errors import library

if TYPE_CHECKING:
    import pandas

WHOLE = {"repetition", "iteration", "rank", "evaluations", "n", "repeats"}
WHOLE |= {"from_evaluations", "to_evaluations", "n_first", "n_second", "n_paired"}
"""Columns of whole numbers, in whatever table; they are never null."""


def frame(rows: Iterable[Sequence[object]], columns: Sequence[str], others: Collection[str] = ()) -> "pandas.DataFrame":
    """Return a frame whose columns have the same types with and without rows.

    Args:
        rows: values by column.
        columns: names of the columns: of numbers, with nan for null.
        others: those of them that are not numbers.

    Raises:
        ExtraMissing: pandas is not installed.
    """
    made = library("pandas", "notebook").DataFrame(list(rows), columns=list(columns))
    return made.astype({name: "int64" if name in WHOLE else "float64" for name in columns if name not in others})
