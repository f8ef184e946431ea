"""The paper's claims C1 to C8, each with its rule.

`levels.py` examines those that compare fitness with direct, `pairs.py` those that strategies differ, and `curves.py`
those on spread and shape.
"""

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.reproduction import paper
from benchmarks.reproduction.curves import NEARER_TO_A_THIRD, curves_flatten, curves_rise, fit_strategies_vary_less
from benchmarks.reproduction.evidence import Examined
from benchmarks.reproduction.levels import (
    all_end_near_direct,
    four_samples_tune_simulators,
    one_sample_is_enough,
    one_sample_tunes_the_simulator,
    starts_at_two_thirds,
    three_samples_reach_direct,
)
from benchmarks.reproduction.pairs import (
    fit_strategies_differ,
    fit_strategies_lead,
    known_fit_leads_random,
    one_sample_wins,
    uniqueness_gains,
    weak_strategies_differ,
)
from benchmarks.reproduction.studies import Study


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        key: its label: C and a number; a letter follows if one sentence of the paper makes several claims.
        title: what it claims, in a few words.
        says: what the paper says.
        rule: the statements that it is made of, and what refutes them.
        examine: examines it in a study.
    """

    key: str
    title: str
    says: str
    rule: str
    examine: Callable[[Study], Examined]


CLAIMS = (
    Claim(
        "C1",
        "controllers of a random simulator start at two thirds of direct",
        f"Before any sample every strategy starts alike, at about {paper.START:.2f} of direct.",
        "Before any sample all strategies do the same: they search in a random simulator. So they start alike, but for "
        f"chance, and are taken together. Their mean is within {paper.START_MARGIN:.2f} of {paper.START:.2f} of "
        "direct: half a unit of the last digit of the paper's 0.9, plus two standard errors. Refuted if it is "
        "shown to be outside. The robot was chosen among trials that start at 0.38 to 0.83, so agreement says little. "
        "Where reality is another engine, the start has the gap between the engines as well, which the paper lacks.",
        starts_at_two_thirds,
    ),
    Claim(
        "C2a",
        "strategies with simulated fit reach direct after three samples and pass it by ten",
        f"The three strategies with simulated fit reach {paper.AFTER_THREE:.2f} of direct after three samples, and "
        f"{paper.AFTER_TEN:.2f} by ten.",
        f"Each of the three is above {paper.LEAST_AFTER_THREE:.2f} of direct after three samples, and above "
        f"{paper.LEAST_AFTER_TEN:.2f} after ten: the paper's 1.3 and 1.4 may be a rounded 1.25 and 1.35. Refuted if "
        "one is shown to be below. Passing direct does not show a good simulator: recorded fitness is the largest of "
        "the samples and a transferred controller. [Fig. 4](#fig-4) has the best of as many direct searches.",
        three_samples_reach_direct,
    ),
    Claim(
        "C2b",
        "after four samples, simulators of strategies with simulated fit are nearly perfect",
        "Strategies with simulated fit have nearly perfectly tuned simulators after three or four samples.",
        "The paper infers it from the recorded fitness (C2a), which may be a sample's. Here the transferred "
        f"controller of each of the three is, by itself, above {paper.LEAST_AFTER_THREE:.2f} of direct after four "
        "samples. Refuted if one is shown to be below.",
        four_samples_tune_simulators,
    ),
    Claim(
        "C3",
        "strategies with simulated fit vary less than 0.58 times as much as the others",
        "The standard deviation of these three is about a third of the others'.",
        "The ratio of the standard deviations, from three samples on, is geometrically nearer to a third than to 1: "
        f"below {NEARER_TO_A_THIRD:.2f}, by a bootstrap over whole repetitions. Refuted if it is shown to be above. "
        f"The effect is smaller than in the paper if the ratio is shown to be above {1 / paper.LEAST_TIMES:.2f}: the "
        f"paper's factor of three may be a rounded {paper.LEAST_TIMES}. The largest of several controllers varies less "
        "than one, so a small ratio does not show that transferred controllers vary less: [both]"
        "(#where-the-recorded-fitness-comes-from).",
        fit_strategies_vary_less,
    ),
    Claim(
        "C4a",
        "with one sample, simulated fit and informative beats every other",
        "With one sample, simulated fit and informative is significantly different from the other strategies "
        "(p < 0.01), and better.",
        "It is above each of the five others after one sample. Refuted if its lead is shown to be smaller than "
        f"{paper.ONE_SAMPLE.least(*paper.SIMULATED_FIT[:2]):.3f} of direct over a strategy with simulated fit, or "
        f"than {paper.ONE_SAMPLE.least(paper.SIMULATED_FIT[0], paper.WEAK[0]):.3f} over another.",
        one_sample_wins,
    ),
    Claim(
        "C4b",
        "with one sample, simulated fit and informative almost reaches direct",
        "Simulated fit and informative has a nearly perfect result after a single sample.",
        f"It is above {paper.LEAST_AFTER_THREE:.2f} of direct after one sample, as others are after three (C2a). "
        "Refuted if it is shown to be below.",
        one_sample_is_enough,
    ),
    Claim(
        "C4c",
        "with one sample, the simulator of simulated fit and informative is nearly optimal",
        "That single sample results in a nearly optimal simulator.",
        f"The controller transferred after it is, by itself, above {paper.LEAST_AFTER_THREE:.2f} of direct. Refuted if "
        "it is shown to be below. The recorded fitness of C4b may be that of the sample, which was selected before any "
        "simulator was tuned.",
        one_sample_tunes_the_simulator,
    ),
    Claim(
        "C5a",
        "strategies with simulated fit are above the others beyond two samples",
        "Beyond two samples, each strategy with simulated fit is better than each without (p ≪ 0.001).",
        "Over 3 to 10 samples, each of the three is above each of the other three. Refuted if a lead is shown to be "
        f"smaller than {paper.BEYOND_TWO.least(paper.SIMULATED_FIT[0], paper.WEAK[0]):.3f} of direct.",
        fit_strategies_lead,
    ),
    Claim(
        "C5b",
        "beyond two samples, unique is above plain simulated fit, and both are above simulated fit and informative",
        "Beyond two samples, the strategies with simulated fit differ from each other (p ≪ 0.001): the unique one is "
        "above plain simulated fit, and both are above simulated fit and informative.",
        "Over 3 to 10 samples, each of the three pairs has this order. Refuted if a lead is shown to be smaller than "
        f"{paper.BEYOND_TWO.least(*paper.SIMULATED_FIT[:2]):.3f} of direct. The paper's p may also be that of each "
        "against the other three strategies (C5a); the order is in its text. With that reading the order has no size, "
        "and is refuted only by a pair whose opposite is shown.",
        fit_strategies_differ,
    ),
    Claim(
        "C5c",
        "known fit is better than random",
        "Beyond two samples, known fit is better than random (p ≈ 0.017).",
        "Over 3 to 10 samples, known fit is above random. Refuted if its lead is shown to be smaller than "
        f"{paper.KNOWN_FIT.least(*paper.WEAK[:2]):.3f} of direct.",
        known_fit_leads_random,
    ),
    Claim(
        "C6",
        "beyond five samples, informative is above known fit, and known fit above random",
        "Beyond five samples, the three weakest strategies differ from one another (p < 0.05): informative is slightly "
        "above the other two, and known fit above random.",
        "Over 6 to 10 samples, each of the three pairs has this order. Refuted if a lead is shown to be smaller than "
        f"{paper.BEYOND_FIVE.least(*paper.WEAK[:2]):.3f} of direct. The paper's p may also be that of each against the "
        "three strategies with simulated fit; [letters](#which-strategies-differ) tell these apart.",
        weak_strategies_differ,
    ),
    Claim(
        "C7",
        "uniqueness gains a little",
        "Uniqueness appears to give a small improvement over plain simulated fit.",
        "Over 3 to 10 samples, simulated fit and unique is above simulated fit. Refuted if it is shown to be below: "
        "the paper tests no such gain. C5b supposes that its p is also of this pair.",
        uniqueness_gains,
    ),
    Claim(
        "C8a",
        "all curves rise",
        "The fitness of all strategies increases with the number of samples.",
        "In each strategy the last recorded fitness is above the first, paired by repetition. Refuted if a rise is "
        f"shown to be smaller than {paper.LEAST_RISE:.2f} of direct, half of the paper's.",
        curves_rise,
    ),
    Claim(
        "C8b",
        "all curves flatten",
        "The increase diminishes with more samples.",
        "In each strategy the first half of the samples gains more per sample than the second, paired by repetition. "
        "Refuted if the second half is shown to gain more.",
        curves_flatten,
    ),
    Claim(
        "C8c",
        "all strategies end near direct",
        f"With more samples, all strategies come to about {paper.AT_LAST:.2f} of direct.",
        f"Each is above {paper.LEAST_AFTER_THREE:.2f} of direct after ten samples: the paper's 1.3 may be a rounded "
        "1.25. Refuted if one is shown to be below.",
        all_end_near_direct,
    ),
)
