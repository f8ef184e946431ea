"""Numbers as text."""

from collections.abc import Iterable, Sequence

import numpy as np

from gaplab.services.core.arrays import FloatArray


def table(head: str, rows: Iterable[str]) -> None:
    """Print a Markdown table, row by row."""
    print(f"\n| {head} |\n|{'---|' * (head.count('|') + 1)}")
    for row in rows:
        print(f"| {row} |", flush=True)
    print()


def mean_and_sd(values: Sequence[float]) -> str:
    """Return mean ± standard deviation and number of values, as text."""
    return f"{np.mean(values):.3f} ± {np.std(values, ddof=1):.3f} (n = {len(values)})"


def numbers(values: FloatArray, between: str = " | ") -> str:
    """Return numbers as text."""
    return between.join(f"{value:.2f}" for value in values)


def bar(share: float) -> str:
    """Return a bar of text, with a block for each hundredth."""
    return "▪" * round(100 * share)
