"""The verdict on experiments: what curves and tests say, by stated rules, in sentences about pairs and curves."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict

from gaplab.schemas.comparisons import Comparison, EquivalenceVerdict
from gaplab.schemas.curves import Curve
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead, common_count
from gaplab.schemas.reports import Trend, TrendRead, VerdictRead
from gaplab.services.figures.words import evaluations, number_of
from gaplab.services.findings.judged import (
    FEWEST_EVALUATIONS,
    FEWEST_REPETITIONS,
    SMALL,
    CurveEnd,
    Judged,
    judged_curves,
)
from gaplab.services.findings.statistics import SIGNIFICANT
from gaplab.services.findings.wording import interval, listed, number, p_in_words, share, signed

POOLED = (
    "pooled as in the paper: the values of one repetition at several numbers of evaluations are not independent, so "
    "each p is too small; trust the tests with one value for each repetition"
)

HIDDEN = "realities are hidden until the experiments have ended, so they may be different"
OTHER_REALITY = "different realities: a difference may come from the reality, not from the strategy"


def where(first: int, last: int, *known: int) -> str:
    """Return the numbers of real-world evaluations at which experiments are compared, as the start of a sentence."""
    counted = evaluations(last, *known)
    return f"after {counted}" if first == last else f"mean of each repetition over {first} to {counted}"


def streams(one: tuple[int, str], other: tuple[int, str]) -> str:
    """Return why two experiments, each with its seed and its strategy, share their random streams, or not."""
    if one == other:
        return (
            f"both draw the random numbers of seed {one[0]} and the strategy {one[1]}, so repetitions of one number "
            "may be correlated"
        )
    different = [
        what for what, first, second in zip(("seeds", "strategies"), one, other, strict=True) if first != second
    ]
    return f"independent random numbers: different {listed(different)}"


def unlike(what: str, one: str, other: str) -> str:
    """Return the words that two experiments have different robots or tasks, with the names of these unless equal."""
    names = f" ({'; '.join(sorted((one, other)))})" if one != other else ""
    return f"different {what}{names}: their fitness does not mean the same"


def equivalence(
    pair: Comparison, verdict: EquivalenceVerdict, margin: float, p: tuple[float | None, float | None]
) -> str:
    """Return a verdict on the equivalence of a pair, with its p before and after Holm's correction."""
    different = f"different ({p_in_words(pair.trusted.p, pair.trusted.p_holm)})"
    within = f"within ±{number(margin)}"
    if verdict is EquivalenceVerdict.EQUIVALENT:
        return f"equivalent {within} ({p_in_words(*p)}){f', though {different}' if pair.differs else ''}"
    if verdict is EquivalenceVerdict.DIFFERENT:
        return different
    why = "too few values that vary" if p[1] is None else p_in_words(*p)
    return f"undecided: not shown to differ, nor to be equivalent {within} ({why})"


def unreproduced(told: Mapping[str, str], names: Mapping[str, str]) -> Iterator[str]:
    """Yield sentences that no simulator reproduces the samples of an experiment, with its name if there are others."""
    for id_, sentence in told.items():
        begin = f"{names[id_]}: {sentence[0]}" if len(names) > 1 else sentence[0].upper()
        yield f"{begin}{sentence[1:]}."


def standing(learned: Sequence[Judged], pairs: Sequence[Comparison], where: str) -> Iterator[str]:
    """Yield who is ahead, in one sentence."""
    ids = {one.curve.experiment for one in learned}
    compared = [pair for pair in pairs if {pair.first, pair.second} <= ids and pair.trusted.p_holm is not None]
    if len(learned) < 2:
        return
    if any(one.point is not None and one.point.n < FEWEST_REPETITIONS for one in learned):
        yield f"Fewer than {FEWEST_REPETITIONS} repetitions are too few to compare strategies."
        return
    differing = sum(pair.differs for pair in compared)
    ahead = f"at {where}; {learned[0].name} has the highest mean."
    if compared and all(pair.is_equivalent for pair in compared):
        yield f"No difference between strategies {_within(compared)} {ahead}"
    elif not differing:
        yield f"No strategy is shown to differ from another {ahead}"
    else:
        told = (
            f"{differing} of {number_of('pair', len(compared))} of strategies"
            if len(compared) > 1
            else "The strategies"
        )
        yield f"{told} differ {ahead}"


def ranking(
    learned: Sequence[Judged], pairs: Sequence[Comparison], names: Mapping[str, str], where: str
) -> Iterator[str]:
    """Yield which strategy has the highest mean, and from which others it differs."""
    if not learned:
        return
    best = learned[0]
    told = f"{best.name} has the highest mean," if len(learned) > 1 else f"the mean of {best.name} is"
    yield f"After {where}, {told} {_with_interval(best)}."
    ids = {one.curve.experiment for one in learned}
    own = [
        pair
        for pair in pairs
        if best.curve.experiment in {pair.first, pair.second} <= ids and pair.trusted.p_holm is not None
    ]
    yield from _of_best(own, names, best.curve.experiment)
    yield from _disagreements(pairs, names)


def _of_best(pairs: Sequence[Comparison], names: Mapping[str, str], best: str) -> Iterator[str]:
    """Yield from which strategies the one with the highest mean differs, and to which it is equivalent."""
    others = [(pair, names[pair.second if pair.first == best else pair.first]) for pair in pairs]
    if different := [other for pair, other in others if pair.differs]:
        yield f"It differs significantly from {listed(different)}."
    if alike := [other for pair, other in others if pair.is_equivalent]:
        yield f"Its difference from {listed(alike)} is {_within(pairs)}."
    if open_ := [other for pair, other in others if not pair.differs and not pair.is_equivalent]:
        yield f"It is not shown to differ from {listed(open_)}, which may be as good."


def _within(pairs: Sequence[Comparison]) -> str:
    margin = next(pair.equivalence.margin for pair in pairs if pair.equivalence)
    return f"within ±{number(margin)}"


def _disagreements(pairs: Sequence[Comparison], names: Mapping[str, str]) -> Iterator[str]:
    """Yield on which pairs other tests of the same kind, unpaired or paired, disagree with the trusted one."""
    alike: dict[str, list[str]] = {}
    for pair in pairs:
        unpaired = {"Student's t": pair.student, "Mann-Whitney": pair.mann_whitney}
        tests = {"Wilcoxon": pair.wilcoxon} if pair.shared_streams else unpaired
        known = {name: test for name, test in tests.items() if test.p_holm is not None}
        other = [name for name, test in known.items() if test.differs != pair.differs]
        if other and pair.trusted.p_holm is not None:
            found, p = ("differ", "at least") if pair.differs else ("are not shown to differ", "below")
            told = f"{found} by the test that the verdict uses, although p is {p} {SIGNIFICANT} by {listed(other)}"
            alike.setdefault(told, []).append(f"{names[pair.first]} and {names[pair.second]}")
    for told, both in alike.items():
        yield f"Pairs that {told}: {'; '.join(both)}."


def share_of_direct(learned: Sequence[Judged], judged: Sequence[Judged], pairs: Sequence[Comparison]) -> Iterator[str]:
    """Yield the share of the direct baseline's fitness that each strategy reaches."""
    for baseline in judged:
        if not baseline.curve.direct or baseline.mean <= 0 or not learned:
            continue
        shares = [f"{one.name} {share(one.mean / baseline.mean)}" for one in learned]
        yield f"Share of the fitness of {baseline.name}, {_with_interval(baseline)}: {', '.join(shares)}."
        key = baseline.curve.experiment
        known = {
            one.name: pair
            for one in learned
            for pair in pairs
            if {pair.first, pair.second} == {key, one.curve.experiment} and pair.trusted.p_holm is not None
        }
        if same := [name for name, pair in known.items() if pair.is_equivalent]:
            yield f"No difference from {baseline.name} {_within(pairs)}: {listed(same)}."
        if open_ := [name for name, pair in known.items() if not pair.differs and not pair.is_equivalent]:
            yield f"Not shown to differ from {baseline.name}: {listed(open_)}."


def spread(learned: Sequence[Judged]) -> Iterator[str]:
    """Yield how far repetitions vary, for the strategy with the largest standard deviation."""
    spreads = [(one.name, one.point.sd, one.mean) for one in learned if one.point and one.point.sd is not None]
    if spreads:
        name, sd, mean = max(spreads, key=lambda each: each[1])
        of_mean = f", {share(sd / abs(mean))} of its mean" if mean else ""
        unit = learned[0].curve.unit
        yield f"Repetitions vary most with {name}: their standard deviation is {number(sd)} {unit}{of_mean}."


def end_of_curve(one: Judged, end: CurveEnd) -> str:
    """Return the trend at the end of a curve in words, with its numbers."""
    if end.trend is Trend.TOO_FEW or end.gain is None:
        counts = f"{number_of('repetition', end.n)} at {evaluations(end.last, one.curve.known)}"
        return f"{one.name}: {counts} are too few to say whether fitness still rises."
    gain = f"{signed(end.gain)} {one.curve.unit}, {interval(end.lower, end.upper, signed)}"
    words = {
        Trend.RISING: "still rises; continuing is worthwhile",
        Trend.FALLING: "falls: later controllers are worse in reality",
        Trend.FLAT: f"is flat since iteration {end.since}; not worth continuing",
        Trend.UNCLEAR: "may still rise or not; more repetitions would tell",
    }[end.trend]
    return f"{one.name} {words} (gain from {end.since} to {end.last} evaluations: {gain})."


def _endings(trends: Sequence[TrendRead]) -> Iterator[str]:
    """Yield how curves end, those that end alike in one sentence."""
    alike: dict[str, list[str]] = {}
    for trend in trends:
        alike.setdefault(trend.sentence.removeprefix(trend.name), []).append(trend.name)
    for end, names in alike.items():
        yield f"{listed(names)}{end}"


def continuing(trends: Sequence[TrendRead]) -> Iterator[str]:
    """Yield whether more iterations are worthwhile, by the trends of the curves."""
    of = {kind: [trend for trend in trends if trend.trend is kind] for kind in Trend}
    if trends and len(of[Trend.TOO_FEW]) == len(trends):
        yield "Too few repetitions or evaluations to say whether continuing is worthwhile."
        return
    if of[Trend.RISING]:
        yield f"Still rising: {_names_of(of[Trend.RISING])}."
    if flat := of[Trend.FLAT]:
        since = max(trend.since or 0 for trend in flat)
        subject = (
            "Flat" if len(trends) == 1 else "All flat" if len(flat) == len(trends) else f"Flat: {_names_of(flat)},"
        )
        yield f"{subject} since iteration {since}; not worth continuing."
    if of[Trend.UNCLEAR] and not of[Trend.RISING]:
        subject = "It" if len(trends) == 1 else _names_of(of[Trend.UNCLEAR])
        yield f"{subject} may still rise; more repetitions would tell."


def incomplete(experiments: Sequence[ExperimentRead], names: Mapping[str, str]) -> Iterator[str]:
    """Yield what is doubtful or missing: unlikely measurements, and repetitions that still run, stopped or failed."""
    for experiment in experiments:
        progress, state = experiment.progress, experiment.state
        yield from (f"{names[experiment.id]}, {doubt}." for doubt in experiment.doubts)
        done = f"{progress.completed} of {number_of('repetition', progress.repetitions)} completed"
        if experiment.caveat or state is not State.COMPLETED:
            why = f" ({experiment.caveat})" if experiment.caveat else ""
            yield f"{names[experiment.id]} is incomplete: {state.value.lower()}{why}, {done}."


def _with_interval(one: Judged) -> str:
    assert one.point is not None
    lower, upper = one.point.lower, one.point.upper
    ends = f"{interval(lower, upper)}, " if lower is not None else ""
    return f"{number(one.mean)} {one.curve.unit} ({ends}n = {one.point.n})"


def _names_of(trends: Sequence[TrendRead]) -> str:
    return listed([trend.name for trend in trends])


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
    "simulators that stand in for reality with the noise of the measurements, fewer than two leave as much error after "
    "tuning. Up to a fifth, no tunable is called identified.",
    f"Nothing is said of a curve with fewer than {FEWEST_REPETITIONS} repetitions or {FEWEST_EVALUATIONS} evaluations.",
)


def judge(
    curves: Sequence[Curve],
    experiments: Sequence[ExperimentRead],
    pairs: Sequence[Comparison],
    wrong: Mapping[str, str],
) -> VerdictRead:
    """Return the verdict on experiments from their curves, in their order, and pairs after the last common evaluation.

    `wrong` says, by experiment, that no simulator reproduces its samples.
    """
    count = common_count(experiments)
    judged = judged_curves(curves, experiments, count)
    after = evaluations(count or 0, *(curve.known for curve in curves if not curve.level))
    learned = [one for one in judged if not one.curve.direct and one.point]
    learned.sort(key=lambda one: one.mean, reverse=True)
    names = {one.curve.experiment: one.name for one in judged}
    trends = tuple(_trend(one, one.end) for one in judged if one.end is not None)
    told = [
        *ranking(learned, pairs, names, after),
        *share_of_direct(learned, judged, pairs),
        *_endings(trends),
        *spread(learned),
        *incomplete(experiments, names),
    ]
    headline = [*unreproduced(wrong, names), *standing(learned, pairs, after), *continuing(trends)]
    return VerdictRead(
        headline=" ".join(headline or (told[:1] if learned else [])) or NOTHING,
        sentences=tuple(told),
        trends=trends,
        evaluations=count,
        rules=RULES,
    )


def _trend(one: Judged, end: CurveEnd) -> TrendRead:
    return TrendRead(
        experiment=one.curve.experiment,
        name=one.name,
        continuing={Trend.RISING: True, Trend.FLAT: False}.get(end.trend),
        sentence=end_of_curve(one, end),
        **asdict(end),
    )
