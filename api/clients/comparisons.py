"""Comparisons of experiments, which turn into a frame, or into a table for a paper."""

from typing import TYPE_CHECKING

from gaplab.api.clients.frames import frame
from gaplab.schemas.comparisons import COLUMNS, TEXTS, Comparison, row
from gaplab.services.csv_tables import csv_text
from gaplab.services.findings.tables import comparison, latex

if TYPE_CHECKING:
    import pandas


class Comparisons(tuple[Comparison, ...]):
    """The pairs of a comparison, as a tuple that also has tables."""

    def frame(self) -> "pandas.DataFrame":
        """Return a row for each pair, with a column for each number, named as in CSV; an undefined number is nan.

        Raises:
            ExtraMissing: pandas is not installed.
        """
        return frame(map(row, self), COLUMNS, TEXTS | {"shared_streams"})

    def csv(self) -> str:
        """Return the same rows as CSV."""
        return csv_text(COLUMNS, map(row, self))

    def latex(self) -> str:
        """Return tables for a paper, with p before and after Holm's correction; LaTeX needs the package booktabs."""
        return latex(comparison(self))
