"""Comparisons of experiments, which turn into a frame, or into a table for a paper."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Self

from gaplab.api.clients.frames import frame
from gaplab.schemas.comparison_columns import COLUMNS, NUMBERS, row
from gaplab.schemas.comparisons import Comparison

if TYPE_CHECKING:
    import pandas


class Comparisons(tuple[Comparison, ...]):
    """The pairs of a comparison, as a tuple that also has tables.

    Args:
        pairs: every pair of experiments.
        formatted: returns the same comparison in a format of the service.
    """

    _formatted: Callable[[str], str]

    def __new__(cls, pairs: Iterable[Comparison], formatted: Callable[[str], str]) -> Self:
        """Return the pairs, and remember how the service formats them."""
        made = super().__new__(cls, pairs)
        made._formatted = formatted
        return made

    def __reduce__(self) -> tuple[type[Self], tuple[tuple[Comparison, ...], Callable[[str], str]]]:
        """Return the class and the arguments from which a copy is made; it has no service to format it."""
        return type(self), (tuple(self), _refused)

    def frame(self) -> "pandas.DataFrame":
        """Return a row for each pair, with a column for each number, named as in CSV; an undefined number is nan.

        Raises:
            ExtraMissing: pandas is not installed.
        """
        return frame([row(pair) for pair in self], COLUMNS, NUMBERS)

    def csv(self) -> str:
        """Return the same rows as CSV.

        Raises:
            RuntimeError: it is a copy.
        """
        return self._formatted("csv")

    def latex(self) -> str:
        """Return tables for a paper, with p before and after Holm's correction; LaTeX needs the package booktabs."""
        return self._formatted("latex")


def _refused(format: str) -> str:  # noqa: A002 - as the API says
    raise RuntimeError(f"a copy of a comparison has no {format}, which the service writes; call `compare` again")
