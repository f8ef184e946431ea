"""What curves cost: rollouts in simulation, or time, at each number of real-world evaluations."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Literal

from gaplab.schemas.curves import Curve
from gaplab.services.figures.kinds.curves import Abscissa
from gaplab.services.store.queries import results
from gaplab.services.store.session import Store

Cost = Literal["rollouts", "time"]

SCALES = ((1.0, ""), (1e3, "thousands"), (1e6, "millions"), (1e9, "thousand millions"))
UNITS_OF_TIME = ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86_400.0, "d"))

WORTH_IT = 3.0
"""The greatest value is at least so many of a unit, or a smaller one is used."""


@dataclass(frozen=True)
class Effort:
    """Mean over the repetitions that have a recorded fitness at a number of real-world evaluations, from their start.

    Attributes:
        rollouts: of controllers and simulators that were evolved, and of selection.
        seconds: that these took on the workers.
    """

    rollouts: float
    seconds: float


def abscissa(store: Store, curves: Sequence[Curve], cost: Cost, *, cost_s: float = 0.0) -> Abscissa:
    """The horizontal axis of curves that are drawn against their cost.

    Args:
        store: that has the experiments.
        curves: of them; the direct baseline is drawn across, and has no place on the axis.
        cost: rollouts until then, or time: of simulation, and of the real-world evaluations.
        cost_s: seconds that one real-world evaluation takes.
    """
    with store.reading() as session:
        found = _efforts(results.efforts(session, [each.experiment for each in curves if not each.direct]))
    if cost == "rollouts":
        return _of_rollouts({key: effort.rollouts for key, effort in found.items()})
    measured = any(effort.seconds for effort in found.values())
    return _of_time({key: key[1] * cost_s + each.seconds for key, each in found.items()}, cost_s, measured=measured)


def _efforts(rows: Iterable[tuple[str, int, int, int, float, bool]]) -> dict[tuple[str, int], Effort]:
    """By experiment and number of evaluations; rows are in the order of the log."""
    so_far: dict[tuple[str, int], tuple[int, float]] = defaultdict(lambda: (0, 0.0))
    found: dict[tuple[str, int], list[tuple[int, float]]] = defaultdict(list)
    for experiment, repetition, iteration, rollouts, seconds, recorded in rows:
        before = so_far[experiment, repetition]
        so_far[experiment, repetition] = (before[0] + rollouts, before[1] + seconds)
        if recorded:
            found[experiment, iteration].append(so_far[experiment, repetition])
    return {
        key: Effort(fmean(rollouts for rollouts, _ in each), fmean(seconds for _, seconds in each))
        for key, each in found.items()
    }


def _of_rollouts(at: Mapping[tuple[str, int], float]) -> Abscissa:
    scale, word = _suited(at, SCALES)
    return Abscissa(
        label=f"Rollouts in simulation ({word})" if word else "Rollouts in simulation",
        note="Rollouts: all that were done until then to select, tune and transfer, mean over repetitions.",
        at={key: value / scale for key, value in at.items()},
    )


def _of_time(at: Mapping[tuple[str, int], float], cost_s: float, *, measured: bool) -> Abscissa:
    scale, unit = _suited(at, UNITS_OF_TIME)
    parts = [f"real-world evaluations at {cost_s:g}\N{NO-BREAK SPACE}s each"] if cost_s else []
    parts += ["simulation as it was measured, mean over repetitions"] if measured else []
    note = f"Time: {' and '.join(parts) or 'none, for no evaluation costs any and none was measured'}."
    if parts and not measured:
        note += " What simulation took is not stored."
    return Abscissa(label=f"Time ({unit})", note=note, at={key: value / scale for key, value in at.items()})


def _suited(at: Mapping[tuple[str, int], float], scales: Sequence[tuple[float, str]]) -> tuple[float, str]:
    """The largest scale on which the greatest value is still worth it."""
    most = max(at.values(), default=0.0)
    return next((each for each in reversed(scales) if most >= WORTH_IT * each[0]), scales[0])
