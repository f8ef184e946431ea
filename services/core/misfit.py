"""Misfit after tuning: the remaining error, the agreement between repetitions, and tunables at their bounds.

An error that remains in every repetition with a small spread is not bad luck: no setting of the tunables fits. A
tunable that varies over repetitions as much as a random one was not identified. A tunable at its bound may need wider
bounds, or it compensates for an effect that no tunable has.

Source: gaplab.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from gaplab.schemas.curves import from_before
from gaplab.schemas.misfit import Distribution, MisfitPoint, TunableDistribution
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.squared_fitness import SquaredFitness
from gaplab.services.core.space import Space
from gaplab.services.core.types import Fit

AT_BOUND = 0.01
"""Largest distance from a bound, as a share of the distance between the bounds, that counts as at the bound."""

PRIOR_SD = 12**-0.5
"""Standard deviation of a uniform draw between the bounds, as a share of their distance."""

PRIOR_95 = 0.95
"""Width of the central 95 % of such draws, as a share of the distance between the bounds."""

OFTEN = 0.5
"""Share of repetitions at a bound from which a remark says so."""


@dataclass(frozen=True, eq=False)
class Tuning:
    """The best simulator of one iteration of one repetition.

    Attributes:
        parameters: `(p,)`, values of its tunables.
        squared_error: discrepancy summed over its samples, by default Σe²; inf if the physics failed on one.
        samples: number of samples that it was tuned on.
        simulated: simulated fitness of the controller that evolved in it; nan if there is none yet.
        real: fitness of that controller in reality; nan if there is none yet.
        held_out_error: the same over held-out samples; nan if there are none yet, or the physics failed on one.
        held_out: number of held-out samples.
        interval: `(p, 2)`: ends of the 95 % intervals of its tunables; None if the tuner gives none.
        posterior: `(p,)`: standard deviations of the posterior; None if the tuner gives none.
        discrepancy: what tuning minimised.
        fit: how well it reproduces the samples; None if it is not known.
    """

    parameters: FloatArray
    squared_error: float
    samples: int
    simulated: float
    real: float
    held_out_error: float = float("nan")
    held_out: int = 0
    interval: FloatArray | None = None
    posterior: FloatArray | None = None
    discrepancy: Discrepancy = field(default_factory=SquaredFitness)
    fit: Fit | None = None

    @property
    def expected(self) -> float:
        """Error per sample that noise and rough physics alone would leave; nan if it is not known."""
        return float("nan") if self.fit is None else self._error(self.fit.expected_error, self.samples)

    @property
    def error(self) -> float:
        """Error per sample, by default √(Σe² / samples); nan without samples, or if the physics failed."""
        return self._error(self.squared_error, self.samples)

    @property
    def error_on_held_out(self) -> float:
        """Error per held-out sample; nan without any, or if the physics failed."""
        return self._error(self.held_out_error, self.held_out)

    def _error(self, total: float, count: int) -> float:
        return self.discrepancy.error(total / count) if count and np.isfinite(total) else float("nan")


def misfit_point(iteration: int, tunings: Sequence[Tuning], names: Sequence[str], space: Space) -> MisfitPoint:
    """Return the misfit of an iteration, over the tunings of the repetitions that have reached it, maybe none.

    Names and bounds are those of the p tunables.
    """
    parameters = np.array([each.parameters for each in tunings]).reshape(-1, space.size)
    widths = [each.interval[:, 1] - each.interval[:, 0] for each in tunings if each.interval is not None]
    deviations = [each.posterior for each in tunings if each.posterior is not None]
    shares = _shares(widths, PRIOR_95 * space.extent), _shares(deviations, PRIOR_SD * space.extent)
    return MisfitPoint(
        iteration=iteration,
        error=_distribution([each.error for each in tunings]),
        expected_error=_distribution([each.expected for each in tunings]),
        held_out_error=_distribution([each.error_on_held_out for each in tunings]),
        gap=_distribution([abs(each.simulated - each.real) for each in tunings]),
        tunables=tuple(
            map(_tunable_distribution, names, parameters.T, space.lower.tolist(), space.upper.tolist(), *shares)
        ),
    )


def remarks(points: Sequence[MisfitPoint], unit: str, error_unit: str | None = None, known: int = 0) -> tuple[str, ...]:
    """Return the latest point that has an error in sentences; none before the first sample.

    Args:
        points: misfit of each iteration.
        unit: unit of fitness.
        error_unit: unit of errors; by default that of fitness.
        known: number of samples from before the experiment.
    """
    with_error = [each for each in points if each.error.n]
    if not with_error:
        return ()
    last, first = with_error[-1], points[0]
    stuck = [sentence for each in last.tunables for sentence in _stuck(each)]
    return (_remaining(last, unit if error_unit is None else error_unit, known), *_gaps(first, last, unit), *stuck)


def _tunable_distribution(
    name: str, values: FloatArray, lower: float, upper: float, interval: float | None, posterior: float | None
) -> TunableDistribution:
    near, found = AT_BOUND * (upper - lower), _distribution(values)
    return TunableDistribution(
        **found.model_dump(),
        name=name,
        lower=lower,
        upper=upper,
        at_lower=float((values <= lower + near).mean()) if len(values) else None,
        at_upper=float((values >= upper - near).mean()) if len(values) else None,
        spread=None if found.sd is None else found.sd / (PRIOR_SD * (upper - lower)),
        interval=interval,
        posterior=posterior,
    )


def _shares(found: Sequence[FloatArray], prior: FloatArray) -> list[float | None]:
    """Return the mean of each tunable's number over that of the prior; None without any."""
    return [None] * len(prior) if not found else [known(each) for each in np.mean(found, axis=0) / prior]


def _distribution(values: Sequence[float] | FloatArray) -> Distribution:
    there = np.asarray(values, dtype=np.float64)
    there = there[np.isfinite(there)]
    with np.errstate(over="ignore", invalid="ignore"):
        mean = known(there.mean()) if len(there) else None
        sd = known((there - there.min()).std(ddof=1)) if len(there) > 1 else None  # exactly 0 if all are equal
    return Distribution(
        n=len(there),
        mean=mean,
        sd=sd,
        least=float(there.min()) if len(there) else None,
        greatest=float(there.max()) if len(there) else None,
    )


def _remaining(point: MisfitPoint, unit: str, known: int) -> str:
    error = point.error
    deviation = f"SD {error.sd:.2g}, " if error.sd is not None else ""
    counted = f"{_many(point.iteration, 'real-world evaluation')}{from_before(known)}"
    return (
        f"at {counted} the best simulators err by {error.mean:.2g} {unit} "
        f"a sample ({deviation}{error.least:.2g} to {error.greatest:.2g} over {_many(error.n, 'repetition')})"
    )


def _many(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _gaps(first: MisfitPoint, last: MisfitPoint, unit: str) -> tuple[str, ...]:
    if last.gap.mean is None:
        return ()
    before = f", and by {first.gap.mean:.2g} before tuning" if first.gap.mean is not None and not first.error.n else ""
    return (f"the controller evolved in them differs by {last.gap.mean:.2g} {unit} in reality{before}",)


def _stuck(tuned: TunableDistribution) -> tuple[str, ...]:
    sides = (("lower", tuned.lower, tuned.at_lower), ("upper", tuned.upper, tuned.at_upper))
    return tuple(
        f"{tuned.name} is at its {side} bound, {bound:g}, in {100 * share:.0f} % of {_many(tuned.n, 'repetition')}"
        for side, bound, share in sides
        if share is not None and share >= OFTEN
    )
