"""The paper's numbers, as ratios to its direct baseline, and what they imply.

Source: Klaus, Glette and Tørresen, A Comparison of Sampling Strategies for Parameter Estimation of a Robot Simulator,
SIMPAR 2012, section 3 and the caption of Fig. 4.
"""

from math import sqrt

from scipy import stats

REPETITIONS, ITERATIONS, DIRECT_REPETITIONS = 40, 10, 100
EVALUATIONS = (10_000, 10_000, 2_000)
"""Evaluations of the search for a controller, for a sample (its reading) and for a simulator."""

DIRECT, DIRECT_SD = 1.33, 0.10
"""Evolution in reality itself, in the paper's unit of fitness."""

START = 0.9 / DIRECT
"""Every strategy before any sample: "roughly the same expected fitness, about 0.9"."""

AFTER_THREE, AFTER_TEN, AT_LAST = 1.3 / DIRECT, 1.4 / DIRECT, 1.3 / DIRECT
"""The strategies with simulated fit after three samples, "at least 1.3", and after ten.

All strategies at last: "with more iterations, fitnesses improved (diminishingly) to more or less 1.3".
"""

LEAST_AFTER_THREE, LEAST_AFTER_TEN = 1.25 / DIRECT, 1.35 / DIRECT
"""The least that fitnesses printed as 1.3 and 1.4 may have been."""

LEARNED_SD = (0.10 / DIRECT, 0.15 / DIRECT)
"""Least and greatest standard deviation with simulated fit."""

TIMES, LEAST_TIMES = 3.0, 2.5
"""How many times smaller these are than those of the others: "about three times", and the least that this may be."""

NEARER_TO_A_THIRD, LEAST_RATIO = (1 / 3) ** 0.5, 1 / LEAST_TIMES
"""Ratios of standard deviations: as far from a third as from 1, by factors; and the greatest that is the paper's."""

LEAST_RISE = (1.3 / DIRECT - START) / 2
"""Half of the rise of all curves, from about 0.9 "to more or less 1.3"."""

FIT = ("simulated_fit", "simulated_fit_and_unique", "simulated_fit_and_informative")
WEAK = ("informative", "random", "known_fit")
STRATEGIES = (*FIT[:2], WEAK[0], FIT[2], *WEAK[1:])
"""The six strategies, in the paper's order."""

START_MARGIN = 0.05 / DIRECT + 2 * TIMES * sum(LEARNED_SD) / 2 / sqrt(len(STRATEGIES) * REPETITIONS)
"""How far from `START` the paper's start may have been: half of its last digit, and two standard errors."""

POWER = 1 / 3
"""Power with which the paper's design would have found the least effect that agrees with its result.

Source: Simonsohn 2015, Small Telescopes: Detectability and the Evaluation of Replication Results.
"""

CORRELATIONS = (0.5, 0.1)
"""Correlations of the recorded fitnesses of one repetition after several numbers of samples, which the paper pools.

With simulated fit, and of the other three. The paper does not state them. In gaplab's figures in MuJoCo, over three to
ten samples, they are 0.46 to 0.79, and 0.01 to 0.07, but 0.30 for `informative` where reality is in PhysX: a strategy
that does not search for fit samples starts each time from nothing.
"""


def deviation(strategy: str) -> float:
    """Return the standard deviation of a strategy's values in the paper, as a share of direct."""
    learned = sum(LEARNED_SD) / 2
    return learned if strategy in FIT else TIMES * learned


def least(pair: tuple[str, str], p: float, counts: int) -> float:
    """Return the difference, as a share of direct, that the paper's design finds with the power `POWER`.

    Its test takes the values of a repetition as independent. The true error of a mean of correlated values is larger,
    so smaller differences would have been found as well.

    Args:
        pair: the strategies.
        p: the p that the paper prints, of Student's t.
        counts: numbers of samples whose values the test takes together.
    """
    values = REPETITIONS * counts
    stated = sum(deviation(each) ** 2 for each in pair)
    true = sum(deviation(each) ** 2 * (1 + (counts - 1) * CORRELATIONS[each not in FIT]) for each in pair)
    found = stats.t.ppf(1 - p / 2, 2 * values - 2) * sqrt(stated) + stats.norm.ppf(POWER) * sqrt(true)
    return float(found / sqrt(values))
