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


def frame(rows: Sequence[Sequence[object]], columns: Sequence[str], numeric: Sequence[str]) -> "pandas.DataFrame":
    """Return a frame whose numeric columns have nan for null, even if every value is null."""
    made = pandas_library().DataFrame(rows, columns=columns)
    for name in numeric:
        made[name] = pandas_library().to_numeric(made[name])
    return made
