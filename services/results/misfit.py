"""The misfit of an experiment, from its stored simulators and measurements."""

from collections import defaultdict
from math import inf, nan

from gaplab.schemas.misfit import MisfitRead
from gaplab.services.core.arrays import frozen
from gaplab.services.core.misfit import Tuning, misfit_point, remarks
from gaplab.services.specs.assembly import parameters_of
from gaplab.services.specs.resolution import spec_of, takes_samples, unit
from gaplab.services.store.queries import experiments, results
from gaplab.services.store.queries.results import BestSimulator
from gaplab.services.store.session import Store


def misfit(store: Store, experiment_id: str) -> MisfitRead:
    """Return the misfit of each iteration so far.

    Raises:
        NotFound: the experiment does not exist.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        simulators = results.best_simulators(session, experiment_id)
        measured = results.measured_iterations(session, experiment_id)
    spec = spec_of(row.spec)
    tunings: dict[int, list[Tuning]] = defaultdict(list)
    for best in simulators:
        samples = results.samples_until(measured, best.repetition, best.iteration)
        tunings[best.iteration].append(_tuning(best, samples))
    names = [each.name for each in spec.tunables]
    points = tuple(
        misfit_point(iteration, tunings[iteration], names, parameters_of(spec.tunables))
        for iteration in range(row.iterations if takes_samples(spec) else 0)
        if tunings[iteration]
    )
    return MisfitRead(experiment=row.id, unit=unit(spec), points=points, remarks=remarks(points, unit(spec)))


def _tuning(best: BestSimulator, samples: int) -> Tuning:
    return Tuning(
        parameters=frozen(best.parameters),
        squared_error=inf if best.squared_error is None else best.squared_error,
        samples=samples,
        simulated=nan if best.simulated is None else best.simulated,
        real=nan if best.real is None else best.real,
    )
