"""The tuned simulators of an experiment, and the parameters of reality once they may be shown."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import known
from gaplab.services.core.stored_specs import discrepancy_of, spec_of
from gaplab.services.core.tunables.labels import unit_of
from gaplab.services.experiments import hiding
from gaplab.services.figures.kinds.simulators import Dimension, SimulatorPoint
from gaplab.services.figures.kinds.squared_error import ErrorKind
from gaplab.services.specs.assembly import parameters_of
from gaplab.services.specs.robots import unit
from gaplab.services.store.queries import experiments, tunings
from gaplab.services.store.session import Store


@dataclass(frozen=True)
class TunedSimulators:
    """The best simulators of an experiment.

    Attributes:
        unit: unit of fitness.
        error: kind of error that tuning minimised.
        dimensions: the tunables.
        simulators: the best of each iteration of each repetition.
        errors: squared errors by iteration and repetition, of iteration 0 only if it was tuned; None if physics failed.
        samples: numbers of samples that the simulators were tuned on, by iteration and repetition.
        truth: the known parameters of reality; None as long as they are hidden, empty if reality has none.
        real_engine: the engine of reality, if it is not that of the simulators.
    """

    unit: str
    error: ErrorKind
    dimensions: tuple[Dimension, ...]
    simulators: tuple[SimulatorPoint, ...]
    errors: Mapping[int, Mapping[int, float | None]]
    samples: Mapping[int, Mapping[int, int]]
    truth: Mapping[str, float] | None
    real_engine: str | None


def tuned_simulators(store: Store, experiment_id: str) -> TunedSimulators:
    """Return the best simulators of an experiment so far; none of one without samples, which tunes nothing.

    Raises:
        NotFound: the experiment does not exist.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        simulators = tunings.best_simulators(session, experiment_id) if row.tunes else ()
        measured = tunings.measured(session, row)
        hidden = row.id in hiding.hidden(session, [row])
    spec, discrepancy = spec_of(row.spec), discrepancy_of(row.spec)
    errors: dict[int, dict[int, float | None]] = defaultdict(dict)
    samples: dict[int, dict[int, int]] = defaultdict(dict)
    for best in simulators:
        at = best.iteration
        count = measured.tuned_until(best.repetition, at)
        if at or count:
            errors[at][best.repetition] = known(best.simulator.squared_error)
            samples[at][best.repetition] = count
    real = spec.reality.engine
    elsewhere = real is None or real.name != spec.engine.name
    return TunedSimulators(
        unit=unit(spec),
        error=ErrorKind(
            discrepancy.error_unit(unit(spec)), discrepancy.error, discrepancy.squares, discrepancy.error_text
        ),
        dimensions=_dimensions(spec),
        simulators=tuple(
            SimulatorPoint(each.repetition, each.iteration, tuple(each.simulator.parameters.tolist()))
            for each in simulators
        ),
        errors=errors,
        samples=samples,
        truth={} if elsewhere else None if hidden else spec.reality.parameters,
        real_engine=None if real is None or not elsewhere else real.name,
    )


def _dimensions(spec: ResolvedSpec) -> tuple[Dimension, ...]:
    space = parameters_of(spec.tunables)
    names = [each.name for each in spec.tunables]
    return tuple(map(Dimension, names, map(unit_of, names), space.lower.tolist(), space.upper.tolist()))
