"""What simulator tuning minimises: the discrepancy of simulators from the samples; and the samples that it never sees.

Held-out samples make the error of simulators on them an honest one. Source: gaplab; cross-validation.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaplab.services.core import repeats
from gaplab.services.core.answers import Answers, Following, nothing
from gaplab.services.core.arrays import NO_READINGS, FloatArray, Genomes, Outcomes, Parameters, frozen, known, nearest
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.fitness import SquaredFitness
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.search import Question
from gaplab.services.core.space import Space
from gaplab.services.core.types import Sample, Simulator

ROUNDING = 1e-9
"""Relative excess of a partial sum over a limit: from it on, the whole sum exceeds the limit in spite of rounding."""


def summed(terms: FloatArray) -> FloatArray:
    """Return the sum over samples of terms `(n, m)` for each simulator, `(m,)`; inf where the physics failed on one.

    The samples are added one by one, so that the sum of a simulator does not depend on the others in the call.
    """
    total = np.zeros(terms.shape[1])
    for row in terms:
        total = total + row
    return np.where(np.isnan(total), np.inf, total)


def sound(simulator: Simulator, space: Space, source: str) -> Simulator:
    """Return a simulator of a tuner with arrays and numbers of Python, whatever the tuner has in their place.

    Args:
        simulator: as the tuner returned it.
        space: of the tunables.
        source: subject of the error's sentence, like `tuner 'search'`.

    Raises:
        PluginBroken: its parameters are not one vector within the bounds, or its error is not a number.
    """
    parameters = space.check(simulator.parameters, source)
    try:
        interval = None if simulator.interval is None else frozen(simulator.interval)
        weight = None if simulator.weight is None else float(simulator.weight)
        return replace(
            simulator,
            parameters=parameters,
            squared_error=float(simulator.squared_error),
            interval=interval,
            weight=weight,
        )
    except (TypeError, ValueError) as error:
        raise PluginBroken(f"{source} returned a simulator whose error, interval or weight is not a number") from error


class Misfit:
    """Minus the discrepancy of simulators from all samples; its sum stops once it is certain to be below a threshold.

    The samples with the largest errors so far come first. The sum itself is in the order of the samples, and only the
    rollouts that were needed count. So no number, not even a count, depends on how many rollouts run at once.

    Args:
        answers: answers of the simulators.
        samples: at least one sample; all measurements succeeded.
        discrepancy: how much an answer differs from a sample; default: the squared difference in fitness.
        times_s: `(q,)`: time of each reading.
    """

    def __init__(
        self,
        answers: Answers,
        samples: Sequence[Sample],
        discrepancy: Discrepancy | None = None,
        times_s: FloatArray = NO_READINGS,
    ) -> None:
        self.discrepancy = discrepancy or SquaredFitness()
        self._answers = answers
        self._times_s = times_s
        self._genomes = np.array([sample.genome for sample in samples])
        self._measured = np.array([self._seen(sample) for sample in samples])
        self._weights = repeats.weights(samples)
        self._noise = 0.0 if self.discrepancy.senses else repeats.variance_of_mean(samples)
        self._erred = np.zeros(len(samples))
        self._asked = np.zeros(len(samples))

    def __call__(self, question: Question) -> FloatArray:
        """Return minus the discrepancy, `(m,)`, of simulators `(m, p)`; -inf where it is below the threshold."""
        simulators, thresholds = question.genomes, question.thresholds
        if np.all(np.isneginf(thresholds)):
            return -self.of(simulators)
        return np.array([self._one(row[None, :], -least) for row, least in zip(simulators, thresholds, strict=True)])

    @property
    def samples(self) -> int:
        """Return the number of samples, k: a simulator costs so many rollouts."""
        return len(self._measured)

    @property
    def noise(self) -> float:
        """Return the variance of a difference of the right simulator, as far as it is known; else 0."""
        return self.discrepancy.noise(self._measured, self._times_s) or self._noise

    def of(self, parameters: Parameters) -> FloatArray:
        """Return the whole discrepancy, `(m,)`, of simulators `(m, p)`; inf where the physics failed on a sample."""
        terms = self._terms(self._outcomes(self._genomes, parameters), slice(None))
        for index, row in enumerate(terms):
            self._learn(index, row)
        return summed(terms)

    def residuals(self, parameters: Parameters) -> FloatArray:
        """Return `(m, r)`: all differences of simulators `(m, p)`, whose squares sum to the discrepancy."""
        outcomes = self._beside(self._outcomes(self._genomes, parameters), self._measured)
        found = self.discrepancy.residuals(outcomes, self._measured, self._times_s)
        if self._weights is not None:
            found = found * np.sqrt(self._weights)[:, None, None]
        return np.moveaxis(found, 1, 0).reshape(len(parameters), -1)

    def reading_errors(self, parameters: FloatArray) -> FloatArray:
        """Return `(q,)`: root mean square differences of readings over the samples, of a simulator `(p,)`.

        They are in units of noise; nan where no sample has the reading. Empty unless readings are compared.
        """
        if not self.discrepancy.senses:
            return NO_READINGS
        outcomes = self._beside(self._outcomes(self._genomes, parameters[None, :]), self._measured)
        away = outcomes[:, 0, 1:] - self._measured[:, 1:]
        there = np.isfinite(away).sum(axis=0)
        return np.asarray(np.sqrt(np.nansum(away**2, axis=0) / np.where(there, there, np.nan)))

    def _one(self, parameters: Parameters, limit: float) -> float:
        """Return minus the discrepancy of one simulator `(1, p)`, or -inf if the discrepancy exceeds the limit."""
        terms = np.empty((len(self._measured), 1))
        order = np.argsort(-self._erred / np.maximum(self._asked, 1.0), kind="stable")
        genomes, partial = self._genomes[order], 0.0
        for place, index in enumerate(order):
            outcomes = self._outcomes(genomes[place : place + 1], parameters, _first_of(genomes[place + 1 :]))
            terms[index] = self._terms(outcomes, slice(index, index + 1))
            partial += self._learn(int(index), terms[index])
            if not partial <= limit * (1.0 + ROUNDING):
                return -np.inf
        return -float(summed(terms)[0])

    def _outcomes(self, genomes: Genomes, parameters: Parameters, following: Following = nothing) -> Outcomes:
        if self.discrepancy.senses:
            return self._answers.sense(genomes, parameters)
        return self._answers(genomes, parameters, following)[..., None]

    def _terms(self, outcomes: Outcomes, which: slice) -> FloatArray:
        measured = self._measured[which]
        terms = self.discrepancy.terms(self._beside(outcomes, measured), measured, self._times_s)
        return terms if self._weights is None else terms * self._weights[which, None]

    def _beside(self, outcomes: Outcomes, measured: FloatArray) -> Outcomes:
        """Return the outcomes, those of sensors that turn shifted by whole turns next to the measured ones."""
        return nearest(outcomes, measured[:, None], self._answers.periods) if self.discrepancy.senses else outcomes

    def _seen(self, sample: Sample) -> FloatArray:
        return sample.outcome if self.discrepancy.senses else np.array([sample.fitness])

    def _learn(self, sample: int, terms: FloatArray) -> float:
        """Remember how far simulators err on a sample, and return the sum of their terms."""
        self._erred[sample] += np.nansum(terms)
        self._asked[sample] += len(terms)
        return float(terms.sum())


def _first_of(genomes: Genomes) -> Following:
    return lambda count: genomes[:count]


_WHOLE = 1e-9
"""Rounding of a product that may be a whole number."""


def is_held_out(number: int, share: float) -> bool:
    """Return whether sample `number`, from 1, is held out: each fifth with a share of 0.2.

    Samples from before the experiment are the first. It depends on nothing else, so an experiment that is extended
    holds out the same samples.
    """
    return int(number * share + _WHOLE) > int((number - 1) * share + _WHOLE)


def seen_of(samples: int, share: float) -> int:
    """Return how many of the first samples tuning sees."""
    return sum(not is_held_out(number, share) for number in range(1, samples + 1))


def split(samples: Sequence[Sample], share: float) -> tuple[tuple[Sample, ...], tuple[Sample, ...]]:
    """Return those of a repetition's samples, in the order of measurement, that tuning sees, and the others."""
    seen = tuple(each for number, each in enumerate(samples, 1) if not is_held_out(number, share))
    return seen, tuple(each for number, each in enumerate(samples, 1) if is_held_out(number, share))


def tested(simulators: Sequence[Simulator], misfit: Misfit) -> tuple[Simulator, ...]:
    """Return the simulators, best first, of which the best has its discrepancy from held-out samples."""
    best, *others = simulators
    error = float(misfit.of(best.parameters[None, :])[0])
    return (replace(best, held_out_error=known(error)), *others)
