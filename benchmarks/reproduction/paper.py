"""The paper's numbers, as ratios to its direct baseline, and what they imply.

Source: Klaus, Glette and Tørresen, A Comparison of Sampling Strategies for Parameter Estimation of a Robot Simulator,
SIMPAR 2012, section 3 and the caption of Fig. 4.
"""

from dataclasses import dataclass
from math import sqrt

from scipy import stats

REPETITIONS, ITERATIONS, DIRECT_REPETITIONS = 40, 10, 100
EVALUATIONS = (10_000, 10_000, 2_000)
"""Evaluations of the search for a controller, for a sample (its reading) and for a simulator."""

DIRECT, DIRECT_SD = 1.33, 0.10
"""Evolution in reality itself, in the paper's unit of fitness."""

START = 0.9 / DIRECT
"""Every strategy before any sample: "roughly the same expected fitness, about 0.9"."""

AFTER_THREE, AFTER_TEN = 1.3 / DIRECT, 1.4 / DIRECT
"""The strategies with simulated fit after three samples, "at least 1.3", and after ten."""

LEAST_AFTER_THREE, LEAST_AFTER_TEN = 1.25 / DIRECT, 1.35 / DIRECT
"""The least that fitnesses printed as 1.3 and 1.4 may have been."""

AT_LAST = 1.3 / DIRECT
"""All strategies: "with more iterations, fitnesses improved (diminishingly) to more or less 1.3"."""

LEARNED_SD = (0.10 / DIRECT, 0.15 / DIRECT)
"""Least and greatest standard deviation with simulated fit."""

TIMES = 3.0
"""How many times smaller these are than those of the others: "about three times"."""

LEAST_RISE = (1.3 / DIRECT - START) / 2
"""Half of the rise of all curves, from about 0.9 "to more or less 1.3"."""

SIMULATED_FIT = ("simulated_fit", "simulated_fit_and_unique", "simulated_fit_and_informative")
WEAK = ("informative", "random", "known_fit")
STRATEGIES = (*SIMULATED_FIT[:2], WEAK[0], SIMULATED_FIT[2], *WEAK[1:])
"""The six strategies, in the paper's order."""

START_MARGIN = 0.05 / DIRECT + 2 * TIMES * sum(LEARNED_SD) / 2 / sqrt(len(STRATEGIES) * REPETITIONS)
"""How far from `START` the paper's start may have been: half of its last digit, and two standard errors."""

POWER = 1 / 3
"""Power with which the paper's design would have found the least effect that agrees with its result.

Source: Simonsohn 2015, Small Telescopes: Detectability and the Evaluation of Replication Results.
"""

CORRELATION = 0.8
"""Correlation of the recorded fitnesses of one repetition after several numbers of samples, which the paper pools.

The paper does not state it. In gaplab's own studies it is 0.75 to 0.83.
"""


def deviation(strategy: str) -> float:
    """Return the standard deviation of a strategy's values in the paper, as a share of direct."""
    learned = sum(LEARNED_SD) / 2
    return learned if strategy in SIMULATED_FIT else TIMES * learned


@dataclass(frozen=True)
class PaperDifference:
    """A difference that the paper found.

    Attributes:
        p: the p that it prints, of Student's t.
        counts: numbers of samples whose values the test takes together.
    """

    p: float
    counts: int = 1

    @property
    def effect(self) -> float:
        """Return the effect, in standard deviations, that the paper's design finds with the power `POWER`.

        Its test takes the values of a repetition as independent. The true error of a mean of correlated values is
        larger, so smaller effects would have been found as well.
        """
        values = REPETITIONS * self.counts
        stated = sqrt(2 / values)
        true = stated * sqrt(1 + (self.counts - 1) * CORRELATION)
        return float(stated * stats.t.ppf(1 - self.p / 2, 2 * values - 2) + true * stats.norm.ppf(POWER))

    def least(self, first: str, second: str) -> float:
        """Return that effect between two strategies as a share of direct, with the paper's standard deviations."""
        return self.effect * sqrt((deviation(first) ** 2 + deviation(second) ** 2) / 2)


ONE_SAMPLE = PaperDifference(0.01)
BEYOND_TWO = PaperDifference(0.001, counts=8)
KNOWN_FIT = PaperDifference(0.017, counts=8)
BEYOND_FIVE = PaperDifference(0.05, counts=5)
