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

AFTER_THREE = 1.3 / DIRECT
"""The strategies with simulated fit after three samples: "at least 1.3"."""

AT_LEAST = 1.25 / DIRECT
"""The least that a fitness printed as 1.3 may have been."""

AFTER_TEN = 1.4 / DIRECT
"""The strategies with simulated fit after ten samples."""

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


POWER = 1 / 3
"""Power with which the paper's design would have found the least effect that agrees with its result.

Source: Simonsohn 2015, Small Telescopes: Detectability and the Evaluation of Replication Results.
"""


def deviation(strategy: str) -> float:
    """Return the standard deviation of a strategy's values in the paper, as a share of direct."""
    learned = sum(LEARNED_SD) / 2
    return learned if strategy in SIMULATED_FIT else TIMES * learned


@dataclass(frozen=True)
class Difference:
    """A difference that the paper found.

    Attributes:
        p: the p that it prints, of Student's t.
        values: values of each strategy in the test: repetitions times counts.
    """

    p: float
    values: int

    @property
    def effect(self) -> float:
        """Return the effect, in standard deviations, that the paper's design finds with the power `POWER`."""
        freedom = 2 * self.values - 2
        quantile: float = stats.t.ppf(1 - self.p / 2, freedom) + stats.norm.ppf(POWER)
        return quantile * sqrt(2 / self.values)

    def least(self, first: str, second: str) -> float:
        """Return that effect between two strategies as a share of direct, with the paper's standard deviations."""
        return self.effect * sqrt((deviation(first) ** 2 + deviation(second) ** 2) / 2)


ONE_SAMPLE = Difference(0.01, REPETITIONS)
BEYOND_TWO = Difference(0.001, REPETITIONS * 8)
KNOWN_FIT = Difference(0.017, REPETITIONS * 8)
BEYOND_FIVE = Difference(0.05, REPETITIONS * 5)
