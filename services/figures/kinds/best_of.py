"""The best of several direct searches, beside strategies, which record the largest fitness of several controllers."""

from gaplab.schemas.results import Curve
from gaplab.services.figures.marks import Line
from gaplab.services.figures.style import INK, Style


def best_of_line(name: str, direct: Curve, last: float) -> Line | None:
    """Return the expected fitness of the best of e + 1 direct searches, at each number e of real-world evaluations.

    The recorded fitness after e samples is the largest of e + 1 controllers: the samples and the transferred one. In
    perfect simulators, and with searches of equal size, *simulated fit* would follow this line. A curve between the
    level of direct and the line has no better controllers than single direct searches. The samples of *random*, *known
    fit* and *informative* are not searched for fitness, so their curves may stay below.

    Args:
        name: that of the direct baseline in the legend.
        direct: its curve.
        last: largest number of real-world evaluations in the figure.

    Returns:
        A line without markers, which ends at half of the direct searches; None if there are too few.
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


def best_of_in_words(line: Line, last: float) -> str:
    """Return the explanation of the line for the caption."""
    told = f"{line.name}: mean of the best of e + 1, drawn at e evaluations; their own evaluations are not counted."
    return f"{told} It ends at half of them." if len(line.x) <= last else told
