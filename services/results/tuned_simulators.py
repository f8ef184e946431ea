"""The tuned simulators of an experiment, with reality once it may be shown; and lines of parallel coordinates."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gaplab.schemas.differences import SettingRead
from gaplab.schemas.records import ExperimentRead
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import known
from gaplab.services.experiments import reading, views
from gaplab.services.experiments.reading import read_differences
from gaplab.services.figures.kinds.coordinates import Coordinate, coordinates_figure
from gaplab.services.figures.kinds.simulators import Dimension, SimulatorPoint
from gaplab.services.figures.kinds.squared_error import ErrorKind
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.words import distinct_names, printable, spoken, with_unit
from gaplab.services.specs.assembly import parameters_of
from gaplab.services.specs.robots import unit
from gaplab.services.specs.stored_specs import discrepancy_of, spec_of
from gaplab.services.store.queries import experiments, tunings
from gaplab.services.store.session import Store
from gaplab.services.world.tunables.labels import unit_of


@dataclass(frozen=True)
class TunedSimulators:
    """The best simulators of an experiment: one for each iteration of each repetition.

    Attributes:
        unit: unit of fitness.
        error: kind of error that tuning minimised.
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
        hidden = row.id in views.hidden(session, [row])
    spec, discrepancy = spec_of(row.spec), discrepancy_of(row.spec)
    points = list[SimulatorPoint]()
    errors: dict[int, dict[int, float | None]] = defaultdict(dict)
    samples: dict[int, dict[int, int]] = defaultdict(dict)
    for best in simulators:
        repetition, at, total = best.repetition, best.iteration, best.simulator.squared_error
        count = measured.tuned_until(repetition, at)
        error = tunings.per_sample(total, count, discrepancy)
        points.append(SimulatorPoint(repetition, at, tuple(best.simulator.parameters.tolist()), error, best.real))
        if at or count:
            errors[at][repetition] = known(total)
            samples[at][repetition] = count
    real = spec.reality.engine
    elsewhere = real is None or real.name != spec.engine.name
    return TunedSimulators(
        unit=unit(spec),
        error=ErrorKind(
            discrepancy.error_unit(unit(spec)), discrepancy.error, discrepancy.squares, discrepancy.error_text
        ),
        dimensions=_dimensions(spec),
        simulators=tuple(points),
        errors=errors,
        samples=samples,
        truth={} if elsewhere else None if hidden else spec.reality.parameters,
        real_engine=None if real is None or not elsewhere else real.name,
    )


def _dimensions(spec: ResolvedSpec) -> tuple[Dimension, ...]:
    space = parameters_of(spec.tunables)
    names = [each.name for each in spec.tunables]
    return tuple(map(Dimension, names, map(unit_of, names), space.lower.tolist(), space.upper.tolist()))


MOST_SETTINGS = 8
"""Settings with an axis; more would be too narrow to read."""


def simulator_coordinates(tuned: TunedSimulators, *, title: str = "") -> FigureDefinition:
    """Return the best simulator of each iteration and repetition: iteration, tunables, error, fitness in reality."""
    found = tuned.simulators
    axes = [
        Coordinate("Iteration", tuple(float(each.iteration) for each in found)),
        *(
            Coordinate(
                with_unit(spoken(tunable.name), [tunable.unit]),
                tuple(each.parameters[at] for each in found),
                tunable.lower,
                tunable.upper,
            )
            for at, tunable in enumerate(tuned.dimensions)
        ),
        Coordinate(with_unit("Error per sample", [tuned.error.unit]), tuple(each.error for each in found), wide=True),
        Coordinate(with_unit("Real fitness", [tuned.unit]), tuple(each.real for each in found)),
    ]
    return coordinates_figure(
        axes,
        shades=[float(each.iteration) for each in found],
        shades_label="Iteration",
        hover=list(map(str, found)),
        what="simulator",
        title=title,
    )


def setting_coordinates(store: Store, ids: Sequence[str], *, title: str = "") -> FigureDefinition:
    """Return the experiments of studies as lines: the settings that differ between them, and their fitness.

    Raises:
        NotFound: there is nothing with one of the ids.
    """
    known = {each.id: each for id_ in ids for each in reading.read(store, id_).experiments}
    kept = [each for each in known.values() if each.fitness]
    differing = read_differences(store, [each.id for each in kept]).settings if len(kept) > 1 else ()
    axes = [*(_setting(setting) for setting in differing[:MOST_SETTINGS]), *_results(kept)]
    return coordinates_figure(
        axes,
        shades=[each.fitness.mean for each in kept if each.fitness],
        shades_label="Final fitness",
        hover=distinct_names([(each.name, each.strategy, "", each.id) for each in kept]),
        what="experiment",
        title=title,
    )


def _results(kept: Sequence[ExperimentRead]) -> tuple[Coordinate, ...]:
    units = {unit(spec_of(each.spec)) for each in kept}
    return (
        Coordinate("Rollouts", tuple(float(each.progress.rollouts_done) for each in kept), wide=True),
        Coordinate(with_unit("Final fitness", units), tuple(each.fitness.mean for each in kept if each.fitness)),
    )


def _setting(setting: SettingRead) -> Coordinate:
    values = [cell[0] if cell else None for cell in setting.values]
    label = spoken(setting.setting.split(" of the ")[0].replace(" ", "_"))
    if all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values):
        return Coordinate(label, tuple(None if value is None else float(value) for value in values), wide=True)
    return Coordinate(label, tuple(None if value is None else _word(value) for value in values))


def _word(value: object) -> str:
    if isinstance(value, list):
        return " + ".join(map(_word, value))
    return printable(str(value).replace("_", " "))
