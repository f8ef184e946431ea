"""Frames of pandas, which may not be installed."""

from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from gaplab.api.clients.errors import ExtraMissing

if TYPE_CHECKING:
    import pandas


def pandas_library() -> Any:  # noqa: ANN401 - a module that may be missing
    """Return pandas.

    Raises:
        ExtraMissing: it is not installed.
    """
    try:
        return import_module("pandas")
    except ImportError as error:
        raise ExtraMissing("pandas", "notebook") from error


def frame(
    rows: Sequence[Sequence[object]],
    columns: Sequence[str],
    numeric: Sequence[str],
    whole: Sequence[str] = (),
) -> "pandas.DataFrame":
    """Return a frame whose columns have the same types with and without rows.

    Args:
        rows: values by column.
        columns: names of the columns.
        numeric: columns of numbers, with nan for null, even if every value is null.
        whole: those of them that are whole numbers, and never null.
    """
    pandas = pandas_library()
    made = pandas.DataFrame(rows, columns=columns)
    if made.empty:
        return made.astype({name: "int64" if name in whole else "float64" for name in numeric})
    for name in numeric:
        made[name] = pandas.to_numeric(made[name])
    return made
