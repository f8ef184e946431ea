"""What a person takes home from an experiment: the best controller, the tuned simulator, and what both rest on."""

from dataclasses import dataclass
from math import inf

from gaplab.schemas.misfit import MisfitRead, TunableVerdict
from gaplab.schemas.records import ExperimentRead, SampleRead, SimulatorRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.errors import Conflict
from gaplab.services.core.robots.base import Robot
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.experiments.reading import read
from gaplab.services.reports.content import Facts, facts_of
from gaplab.services.specs.robots import robot_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments, results, tunings
from gaplab.services.store.session import Session, Store

MOST_ROWS = 1_000_000
"""Most measurements, and most simulators of one repetition."""


@dataclass(frozen=True)
class ExperimentOutcome:
    """The outcome of an experiment so far.

    Attributes:
        facts: facts of its report.
        spec: its resolved spec.
        robot: its robot.
        measured: its measurements that succeeded, by repetition in the order of the log.
        best: the fittest of them; None without any.
        simulators: simulators of the latest tuning in the repetition of the fittest measurement, the best first.
        samples: number of samples that they were tuned on.
    """

    facts: Facts
    spec: ResolvedSpec
    robot: Robot
    measured: tuple[SampleRead, ...]
    best: SampleRead | None
    simulators: tuple[SimulatorRead, ...]
    samples: int

    @property
    def experiment(self) -> ExperimentRead:
        """The experiment."""
        return self.facts.experiments[0]

    @property
    def misfit(self) -> MisfitRead | None:
        """The misfit of its simulators; None if it tunes nothing."""
        return self.facts.misfits.get(self.experiment.id)

    @property
    def identified(self) -> dict[str, TunableVerdict]:
        """The verdict on each tunable."""
        return {verdict.name: verdict for verdict in self.misfit.verdicts} if self.misfit else {}


def outcome_of(store: Store, experiment_id: str) -> ExperimentOutcome:
    """Return the outcome of an experiment so far.

    Raises:
        NotFound: no such experiment.
        Conflict: nothing has been measured or tuned yet.
        InvalidSpec: its robot is not installed here.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        seen = results.page_of_samples(session, experiment_id, repetition=None, kind=None, limit=MOST_ROWS, cursor=None)
        measured = tuple(sample for sample in seen if sample.fitness is not None)
        best = max(measured, key=lambda sample: -inf if sample.fitness is None else sample.fitness, default=None)
        simulators = _latest(session, row, best.repetition if best else 0)
        tuned = tunings.measured(session, row)
    if best is None and not simulators:
        later = f", and is {row.state}" if row.state.ended else " yet; try again later"
        raise Conflict(f"experiment {experiment_id!r} has measured and tuned nothing{later}")
    spec = spec_of(row.spec)
    return ExperimentOutcome(
        facts=facts_of(store, read(store, experiment_id)),
        spec=spec,
        robot=robot_of(spec),
        measured=measured,
        best=best,
        simulators=simulators,
        samples=tuned.tuned_until(simulators[0].repetition, simulators[0].iteration) if simulators else 0,
    )


def _latest(session: Session, row: ExperimentRow, repetition: int) -> tuple[SimulatorRead, ...]:
    """Return the simulators of the latest tuning of a repetition; none of an experiment that tunes nothing."""
    if not row.tunes:
        return ()
    found = results.page_of_simulators(
        session, row, repetition=repetition, iteration=None, limit=MOST_ROWS, cursor=None
    )
    last = max((simulator.iteration for simulator in found), default=0)
    return tuple(simulator for simulator in found if simulator.iteration == last)
