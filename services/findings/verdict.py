"""The verdict: what curves and tests say, in words, by stated rules."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from gaplab.schemas.comparisons import Comparison, Trend, TrendRead, VerdictRead
from gaplab.schemas.records import ExperimentRead, common_count
from gaplab.schemas.results import Curve
from gaplab.services.figures.words import evaluations
from gaplab.services.findings import sentences
from gaplab.services.findings.judged import Judged, judged_curves
from gaplab.services.findings.statistics import SIGNIFICANT
from gaplab.services.findings.trends import FEWEST_EVALUATIONS, FEWEST_REPETITIONS, SMALL, CurveEnd
from gaplab.services.findings.wording import share

NOTHING = "There are no results yet."

RULES = (
    f"A pair differs if its p is below {SIGNIFICANT}: Welch's t on the recorded fitness at the last number of "
    "real-world evaluations that the experiments share, corrected by Holm's method over all pairs. Experiments of one "
    "seed and one strategy draw the same random numbers; their test is the paired t, by repetition. A p above that "
    "does not show that two strategies are equal. Experiments that failed or were cancelled do not lower the number.",
    "There is no difference within a margin if two one-sided tests (Welch's, or paired) say so at that number, with p "
    f"below {SIGNIFICANT} after Holm's correction over all pairs. Without a margin in the request, the verdict only "
    "says which pairs are not shown to differ.",
    "The gain of a curve is the mean, over repetitions, of the later minus the earlier recorded fitness of the same "
    "repetition, with its 95 % interval by Student's t.",
    "A curve is flat since k, and not worth continuing, if the interval of the gain from k, and from every later "
    "number of evaluations, to the last one contains 0, and the interval of the gain from k ends below "
    f"{share(SMALL)} of the mean fitness; k is at least {FEWEST_EVALUATIONS} evaluations before the last. A curve is "
    f"rising or falling if the interval of the gain over the last {FEWEST_EVALUATIONS} evaluations is above or below "
    "0. Otherwise more repetitions would tell.",
    "No simulator is said to reproduce the samples if at least half of the repetitions are surprised: of 40 plausible "
    "simulators that play reality with the noise of the measurements, fewer than two leave as much error after tuning. "
    "Up to a fifth, no tunable is called identified.",
    f"Nothing is said of a curve with fewer than {FEWEST_REPETITIONS} repetitions or {FEWEST_EVALUATIONS} evaluations.",
)


def judge(
    curves: Sequence[Curve],
    experiments: Sequence[ExperimentRead],
    pairs: Sequence[Comparison],
    unreproduced: Mapping[str, str],
) -> VerdictRead:
    """Return the verdict on experiments from their curves, in their order, and the pairs at the common count.

    `unreproduced` says, by experiment, that no simulator reproduces its samples.
    """
    count = common_count(experiments)
    judged = judged_curves(curves, experiments, count)
    where = evaluations(count or 0, *(curve.known for curve in curves if not curve.level))
    learned = [one for one in judged if not one.curve.direct and one.point]
    learned.sort(key=lambda one: one.mean, reverse=True)
    names = {one.curve.experiment: one.name for one in judged}
    trends = tuple(_trend(one, one.end) for one in judged if one.end is not None)
    told = [
        *sentences.ranking(learned, pairs, names, where),
        *sentences.share_of_direct(learned, judged, pairs),
        *(trend.sentence for trend in trends),
        *sentences.spread(learned),
        *sentences.incomplete(experiments, names),
    ]
    wrong = sentences.unreproduced(unreproduced, names)
    headline = [*wrong, *sentences.standing(learned, pairs, where), *sentences.continuing(trends)]
    return VerdictRead(
        headline=" ".join(headline or (told[:1] if learned else [])) or NOTHING,
        sentences=tuple(told),
        trends=trends,
        evaluations=count,
        rules=RULES,
    )


def _trend(one: Judged, end: CurveEnd) -> TrendRead:
    continuing = {Trend.RISING: True, Trend.FLAT: False}.get(end.trend)
    return TrendRead(
        experiment=one.curve.experiment,
        name=one.name,
        continuing=continuing,
        sentence=sentences.end_of_curve(one, end),
        **asdict(end),
    )
