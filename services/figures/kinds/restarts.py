"""The best of several direct searches, beside the curves of strategies that search as often."""

from gaplab.schemas.curves import Curve
from gaplab.services.figures.marks import Line
from gaplab.services.figures.style import INK, Style


def restarts_line(name: str, direct: Curve, last: float) -> Line | None:
    """Return the expected fitness of the best of e + 1 direct searches, at each number e of real-world evaluations.

    A strategy searches for a controller before its first sample and after each, and its recorded fitness is the largest
    of several. So its curve passes the mean of single direct searches even if its simulators are no better than
    reality. If it rises like this line, it does as well as searching in reality as often.

    Args:
        name: that of the direct baseline in the legend.
        direct: its curve.
        last: largest number of real-world evaluations in the figure.

    Returns:
        A line without markers; None if direct has too few repetitions.
    """
    best = direct.best_of[: int(last) + 1]
    if not best:
        return None
    hover = tuple(f"{each:.3f} (best of {size})" if each is not None else "" for size, each in enumerate(best, 1))
    return Line(
        f"{name}, best of as many searches",
        tuple(range(len(best))),
        best,
        Style(INK, "dotted", "circle"),
        hover=hover,
        markers=False,
    )
