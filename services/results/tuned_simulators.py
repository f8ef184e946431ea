"""Tuned simulators of an experiment as its figures want them, and reality's place among them once that may be known."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.core.tunables import tunables
from gaplab.services.experiments import hiding
from gaplab.services.figures.kinds.simulators import Dimension, Tuned
from gaplab.services.specs.assembly import parameters_of
from gaplab.services.specs.resolution import spec_of, unit
from gaplab.services.store.queries import experiments, results
from gaplab.services.store.session import Store


@dataclass(frozen=True)
class Tunings:
    """The best simulators of an experiment.

    Attributes:
        unit: of fitness.
        dimensions: its tunables.
        simulators: the best of each iteration of each repetition.
        errors: by iteration that tuned, their squared errors by repetition; None where the physics failed.
        truth: reality's parameters, as far as they are known; None as long as they are hidden.
    """

    unit: str
    dimensions: tuple[Dimension, ...]
    simulators: tuple[Tuned, ...]
    errors: Mapping[int, Mapping[int, float | None]]
    truth: Mapping[str, float] | None


def tunings(store: Store, experiment_id: str) -> Tunings:
    """The best simulators of an experiment, as far as it has got.

    Raises:
        NotFound: no such experiment.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        found = results.best_simulators(session, experiment_id)
        hidden = row.id in hiding.hidden(session, [row])
    spec = spec_of(row.spec)
    errors: dict[int, dict[int, float | None]] = defaultdict(dict)
    for each in found:
        if each.iteration:
            errors[each.iteration][each.repetition] = each.squared_error
    return Tunings(
        unit=unit(spec),
        dimensions=_dimensions(spec),
        simulators=tuple(Tuned(each.repetition, each.iteration, tuple(each.parameters)) for each in found),
        errors=errors,
        truth=None if hidden else spec.reality.parameters,
    )


def _dimensions(spec: ExperimentSpec) -> tuple[Dimension, ...]:
    space = parameters_of(spec.tunables)
    bounds = zip(spec.tunables, space.lower.tolist(), space.upper.tolist(), strict=True)
    return tuple(Dimension(ref.name, _unit(ref.name), lower, upper) for ref, lower, upper in bounds)


def _unit(name: str) -> str:
    """Of a tunable; of one that is not installed here it is not known."""
    return tunables[name].unit if name in tunables else ""
