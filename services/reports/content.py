"""The facts of a report, collected from the store."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf

from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.curves import Curve, Fitness
from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.misfit import MisfitRead
from gaplab.schemas.provenance import ProvenanceRead
from gaplab.schemas.records import ExperimentRead, SampleRead, SimulatorRead, StudyRead, common_count
from gaplab.schemas.reports import VerdictRead
from gaplab.schemas.sensitivity import SensitivityRead
from gaplab.schemas.spec import SpecRead
from gaplab.services.core.errors import NotFound
from gaplab.services.experiments import checks
from gaplab.services.experiments.reading import read_spec
from gaplab.services.findings.judged import Judged, judged_curves
from gaplab.services.findings.sentences import judge
from gaplab.services.results import curves as results
from gaplab.services.results.comparisons import Margin, compare
from gaplab.services.results.misfit import misfit
from gaplab.services.results.tuned_simulators import TunedSimulators, tuned_simulators
from gaplab.services.running import provenance
from gaplab.services.specs.differences import SpecColumn, differences
from gaplab.services.store.queries import experiments as rows
from gaplab.services.store.queries import results as stored
from gaplab.services.store.queries import tunings
from gaplab.services.store.queries.costs import Work, work_of
from gaplab.services.store.session import Session, Store

MOST_ROWS = 1_000_000
"""Most measurements, and most simulators of one repetition."""


@dataclass(frozen=True)
class Outcome:
    """What an experiment has measured and tuned so far.

    Attributes:
        measured: its measurements that succeeded, by repetition in the order of the log.
        best: the fittest of them; None without any.
        simulators: simulators of the latest tuning in the repetition of the fittest measurement, the best first.
        samples: number of samples that they were tuned on.
    """

    measured: tuple[SampleRead, ...]
    best: SampleRead | None
    simulators: tuple[SimulatorRead, ...]
    samples: int


@dataclass(frozen=True)
class Facts:
    """Everything that a report shows, as of about one moment.

    Attributes:
        id: id of the study, or of the experiment that alone is meant; so are name and notes.
        experiments: its experiments; of hidden realities without parameters.
        curves: their curves.
        transferred: the same of transferred controllers alone.
        judged: the curves with their distinct names.
        at_last: comparisons of all pairs after the last common evaluation; empty for one experiment.
        beside: the same of transferred controllers alone, and of the best of these.
        over_all: the same over all counts up to it, one value for each repetition, with the paper's pooled tests; empty
            if there is a single count.
        differing: settings that differ between the experiments; None for one experiment.
        checks: sensitivity checks, each once.
        misfits: misfit by experiment, without levels; work and provenance are by experiment too.
        leading: simulators of the experiment with the highest mean; None if there are none.
        outcome: what its only experiment has measured and tuned; None if there are several.
        again: the spec to submit it again; if no single one gives it, also that of each experiment.
    """

    id: str
    name: str
    notes: str | None
    experiments: tuple[ExperimentRead, ...]
    curves: tuple[Curve, ...]
    transferred: tuple[Curve, ...]
    judged: tuple[Judged, ...]
    verdict: VerdictRead
    at_last: tuple[Comparison, ...]
    beside: tuple[tuple[Comparison, ...], ...]
    over_all: tuple[Comparison, ...]
    differing: SpecDiff | None
    checks: tuple[SensitivityRead, ...]
    misfits: Mapping[str, MisfitRead]
    work: Mapping[str, Work]
    provenance: Mapping[str, ProvenanceRead]
    leading: tuple[Judged, TunedSimulators] | None
    outcome: Outcome | None
    again: tuple[SpecRead, ...]

    @cached_property
    def names(self) -> dict[str, str]:
        """The distinct names of the experiments, by their ids."""
        return {one.curve.experiment: one.name for one in self.judged}

    @property
    def unit(self) -> str:
        """The unit of fitness; "" if its robot is not installed here."""
        return next((one.curve.unit for one in self.judged), "")


def verdict_on(store: Store, subject: StudyRead, margin: Margin | None = None) -> VerdictRead:
    """Return the verdict on a study."""
    experiments = subject.experiments
    curves = results.curves(store, [experiment.id for experiment in experiments])
    return _verdict(store, curves, experiments, _misfits(store, experiments), margin)[0]


def facts_of(store: Store, subject: StudyRead, margin: Margin | None = None) -> Facts:
    """Return the facts of a study."""
    experiments = subject.experiments
    ids = [experiment.id for experiment in experiments]
    curves = results.curves(store, ids)
    misfits = _misfits(store, experiments)
    verdict, at_last = _verdict(store, curves, experiments, misfits, margin)
    judged = judged_curves(curves, experiments, verdict.evaluations)
    others = [each for each in Fitness if at_last and each is not Fitness.RECORDED]
    columns = [SpecColumn(each.id, each.name, (each.spec,)) for each in experiments]
    with store.reading() as session:
        work = work_of(session, ids)
        outcome = _outcome(session, ids[0]) if len(ids) == 1 else None
    return Facts(
        id=subject.id,
        name=subject.name,
        notes=subject.notes,
        experiments=experiments,
        curves=curves,
        transferred=results.curves(store, ids, Fitness.TRANSFERRED),
        judged=judged,
        verdict=verdict,
        at_last=at_last,
        beside=tuple(compare(store, ids, to_evaluations=verdict.evaluations, fitness=each) for each in others),
        over_all=_over_all(store, ids, verdict.evaluations),
        differing=differences(columns) if len(ids) > 1 else None,
        checks=_checks(store, experiments),
        misfits=misfits,
        work=work,
        provenance={id_: provenance.read(store, id_) for id_ in ids},
        leading=_leading(store, judged),
        outcome=outcome,
        again=_again(store, subject.id, ids),
    )


def _again(store: Store, id_: str, experiments: Sequence[str]) -> tuple[SpecRead, ...]:
    whole = read_spec(store, id_)
    return (whole, *(read_spec(store, each) for each in experiments if whole.spec is None))


def _outcome(session: Session, experiment_id: str) -> Outcome:
    row = rows.get_experiment(session, experiment_id)
    seen = stored.page_of_samples(session, row.id, limit=MOST_ROWS)
    measured = tuple(sample for sample in seen.items if sample.fitness is not None)
    best = max(measured, key=lambda sample: -inf if sample.fitness is None else sample.fitness, default=None)
    repetition = best.repetition if best else 0
    tuned: tuple[SimulatorRead, ...] = ()
    if row.tunes:
        tuned = stored.page_of_simulators(session, row.id, repetition=repetition, limit=MOST_ROWS).items
    last = max((simulator.iteration for simulator in tuned), default=0)
    samples = tunings.measured(session, row).tuned_until(repetition, last) if tuned else 0
    return Outcome(measured, best, tuple(each for each in tuned if each.iteration == last), samples)


def _misfits(store: Store, experiments: Sequence[ExperimentRead]) -> dict[str, MisfitRead]:
    return {each.id: misfit(store, each.id) for each in experiments if not each.level}


def _verdict(
    store: Store,
    curves: Sequence[Curve],
    experiments: Sequence[ExperimentRead],
    misfits: Mapping[str, MisfitRead],
    margin: Margin | None,
) -> tuple[VerdictRead, tuple[Comparison, ...]]:
    """Return the verdict, and the comparisons after the last common evaluation that it uses."""
    count, ids = common_count(experiments), [curve.experiment for curve in curves]
    pairs: tuple[Comparison, ...] = ()
    if count is not None and len(ids) > 1:
        pairs = compare(store, ids, from_evaluations=count, to_evaluations=count, margin=margin)
    unreproduced = {id_: found.unreproduced for id_, found in misfits.items() if found.unreproduced}
    return judge(curves, experiments, pairs, unreproduced), pairs


def _over_all(store: Store, ids: Sequence[str], count: int | None) -> tuple[Comparison, ...]:
    if count is None or count < 2 or len(ids) < 2:
        return ()
    return compare(store, ids, from_evaluations=1, to_evaluations=count)


def _checks(store: Store, experiments: Sequence[ExperimentRead]) -> tuple[SensitivityRead, ...]:
    found = []
    for id_ in dict.fromkeys(experiment.sensitivity for experiment in experiments if experiment.sensitivity):
        try:
            found.append(checks.read(store, id_))
        except NotFound:  # an imported experiment names a check that its archive does not contain
            continue
    return tuple(check for check in found if check.tunables)


def _leading(store: Store, judged: Sequence[Judged]) -> tuple[Judged, TunedSimulators] | None:
    learned = [one for one in judged if not one.curve.level and one.point]
    if not learned:
        return None
    best = max(learned, key=lambda one: one.mean)
    tuned = tuned_simulators(store, best.curve.experiment)
    return (best, tuned) if tuned.simulators else None
