"""The sentences of a verdict."""

from collections.abc import Iterator, Mapping, Sequence

from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.lifecycle import State
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.reports import Trend, TrendRead
from gaplab.services.core.trends import FEWEST_REPETITIONS, CurveEnd
from gaplab.services.figures.words import evaluations, number_of
from gaplab.services.reports.judged import SIGNIFICANT, Judged, differs, is_equivalent


def unreproduced(told: Mapping[str, str], names: Mapping[str, str]) -> Iterator[str]:
    """Yield that no simulator reproduces the samples of an experiment, with its name if there are others."""
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
    differing = sum(map(differs, compared))
    ahead = f"at {where}; {learned[0].name} has the highest mean."
    if compared and all(map(is_equivalent, compared)):
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
    """Yield what the highest mean is, and from which strategies it differs."""
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
    if different := [other for pair, other in others if differs(pair)]:
        yield f"It differs significantly from {listed(different)}."
    if alike := [other for pair, other in others if is_equivalent(pair)]:
        yield f"Its difference from {listed(alike)} is {_within(pairs)}."
    if open_ := [other for pair, other in others if not differs(pair) and not is_equivalent(pair)]:
        yield f"It is not shown to differ from {listed(open_)}, which may be as good."


def _within(pairs: Sequence[Comparison]) -> str:
    margin = next(pair.equivalence.margin for pair in pairs if pair.equivalence)
    return f"within ±{margin:.3g}"


def _disagreements(pairs: Sequence[Comparison], names: Mapping[str, str]) -> Iterator[str]:
    """Yield the pairs on which other tests of the same kind, unpaired or paired, disagree with the trusted one."""
    for pair in pairs:
        unpaired = {"Student's t": pair.student.p_holm, "Mann-Whitney": pair.mann_whitney.p_holm}
        tests = {"Wilcoxon": pair.wilcoxon.p_holm} if pair.shared_streams else unpaired
        other = [name for name, p in tests.items() if p is not None and (p < SIGNIFICANT) != differs(pair)]
        if other and pair.trusted.p_holm is not None:
            found, p = (
                ("differ", f"p of at least {SIGNIFICANT}")
                if differs(pair)
                else ("are not shown to differ", f"p below {SIGNIFICANT}")
            )
            both = f"{names[pair.first]} and {names[pair.second]}"
            yield f"{both} {found} by the test that the verdict goes by, although {' and '.join(other)} has a {p}."


def share_of_direct(learned: Sequence[Judged], judged: Sequence[Judged], pairs: Sequence[Comparison]) -> Iterator[str]:
    """Yield the share of the direct baseline's fitness that each strategy reaches."""
    for baseline in judged:
        if not baseline.curve.direct or baseline.mean <= 0 or not learned:
            continue
        shares = [f"{one.name} {one.mean / baseline.mean:.0%}" for one in learned]
        yield f"Share of the fitness of {baseline.name}, {_with_interval(baseline)}: {', '.join(shares)}."
        key = baseline.curve.experiment
        known = {
            one.name: pair
            for one in learned
            for pair in pairs
            if {pair.first, pair.second} == {key, one.curve.experiment} and pair.trusted.p_holm is not None
        }
        if same := [name for name, pair in known.items() if is_equivalent(pair)]:
            yield f"No difference from {baseline.name} {_within(pairs)}: {listed(same)}."
        if open_ := [name for name, pair in known.items() if not differs(pair) and not is_equivalent(pair)]:
            yield f"Not shown to differ from {baseline.name}: {listed(open_)}."


def spread(learned: Sequence[Judged]) -> Iterator[str]:
    """Yield how far repetitions vary, for the strategy with the largest standard deviation."""
    spreads = [(one.name, one.point.sd, one.mean) for one in learned if one.point and one.point.sd is not None]
    if spreads:
        name, sd, mean = max(spreads, key=lambda each: each[1])
        share = f", {sd / abs(mean):.0%} of its mean" if mean else ""
        unit = learned[0].curve.unit
        yield f"Repetitions vary most with {name}: their standard deviation is {sd:.3f} {unit}{share}."


def end_of_curve(one: Judged, end: CurveEnd) -> str:
    """Return what the end of a curve says, with its numbers."""
    if end.trend is Trend.TOO_FEW or end.gain is None:
        counts = f"{number_of('repetition', end.n)} at {evaluations(end.last, one.curve.known)}"
        return f"{one.name}: {counts} are too few to say whether it still rises."
    gain = f"{end.gain:+.3f} {one.curve.unit}, 95 % interval {end.lower:+.3f} to {end.upper:+.3f}"
    words = {
        Trend.RISING: "still rises; continuing is worthwhile",
        Trend.FALLING: "falls: later controllers are worse in reality",
        Trend.FLAT: f"is flat since iteration {end.since}; not worth continuing",
        Trend.UNCLEAR: "may still rise or not; more repetitions would tell",
    }[end.trend]
    return f"{one.name} {words} (gain from {end.since} to {end.last} evaluations: {gain})."


def continuing(trends: Sequence[TrendRead]) -> Iterator[str]:
    """Yield what the curves say of continuing."""
    of = {kind: [trend for trend in trends if trend.trend is kind] for kind in Trend}
    if trends and len(of[Trend.TOO_FEW]) == len(trends):
        yield "Too few repetitions or evaluations to say whether continuing is worthwhile."
        return
    if of[Trend.RISING]:
        yield f"Still rising: {_named(of[Trend.RISING])}."
    if flat := of[Trend.FLAT]:
        since = max(trend.since or 0 for trend in flat)
        subject = "Flat" if len(trends) == 1 else "All flat" if len(flat) == len(trends) else f"Flat: {_named(flat)},"
        yield f"{subject} since iteration {since}; not worth continuing."
    if of[Trend.UNCLEAR] and not of[Trend.RISING]:
        subject = "It" if len(trends) == 1 else _named(of[Trend.UNCLEAR])
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
    interval = f"95 % interval {lower:.3f} to {upper:.3f}, " if lower is not None else ""
    return f"{one.mean:.3f} {one.curve.unit} ({interval}n = {one.point.n})"


def _named(trends: Sequence[TrendRead]) -> str:
    return listed([trend.name for trend in trends])


def listed(names: Sequence[str]) -> str:
    """Return names, at least one, as a sentence has them: `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
