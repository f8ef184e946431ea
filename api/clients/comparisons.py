"""Comparisons of experiments, which turn into a frame, or into a table for a paper."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Self

from gaplab.api.clients.frames import frame
from gaplab.schemas.curves import Comparison

if TYPE_CHECKING:
    import pandas

TESTS = ("student", "welch", "mann_whitney")
OF_A_TEST = ("statistic", "degrees_of_freedom", "p", "p_holm")
TEXTS = ("first", "first_name", "second", "second_name")
NUMBERS = ("from_evaluations", "to_evaluations", "n_first", "n_second", "difference", "effect_size")


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

    def frame(self) -> "pandas.DataFrame":
        """Return a row for each pair, with a column for each number of each test; an undefined number is nan.

        Raises:
            ExtraMissing: pandas is not installed.
        """
        numeric = (*NUMBERS, *(f"{test}_{value}" for test in TESTS for value in OF_A_TEST))
        return frame([_row(pair) for pair in self], (*TEXTS, *numeric), numeric)

    def csv(self) -> str:
        """Return the same rows as CSV."""
        return self._formatted("csv")

    def latex(self) -> str:
        """Return a table for a paper, with Holm's corrected p-values; LaTeX needs the package booktabs."""
        return self._formatted("latex")


def _row(pair: Comparison) -> list[Any]:
    tests = [getattr(getattr(pair, test), value) for test in TESTS for value in OF_A_TEST]
    return [*(getattr(pair, name) for name in (*TEXTS, *NUMBERS)), *tests]
