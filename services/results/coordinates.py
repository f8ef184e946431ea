"""Simulators and experiments as lines of parallel coordinates."""

from collections.abc import Sequence

from gaplab.schemas.differences import SettingRead
from gaplab.schemas.records import ExperimentRead
from gaplab.services.core.stored_specs import discrepancy_of, spec_of
from gaplab.services.core.tunables.labels import unit_of
from gaplab.services.experiments import reading
from gaplab.services.experiments.reading import read_differences
from gaplab.services.figures.kinds.coordinates import Coordinate, coordinates_figure
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.words import distinct_names, printable, spoken, with_unit
from gaplab.services.specs.assembly import parameters_of
from gaplab.services.specs.robots import unit
from gaplab.services.store.queries import experiments, tunings
from gaplab.services.store.session import Store

MOST_SETTINGS = 8
"""Settings with an axis; more would be too narrow to read."""


def simulator_coordinates(store: Store, experiment_id: str, *, title: str = "") -> FigureDefinition:
    """Return the best simulator of each iteration and repetition: iteration, tunables, error, fitness in reality.

    Raises:
        NotFound: the experiment does not exist.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        found = tunings.best_simulators(session, experiment_id)
        measured = tunings.measured(session, row)
    spec = spec_of(row.spec)
    space = parameters_of(spec.tunables)
    discrepancy = discrepancy_of(row.spec)
    errors = tuple(
        tunings.per_sample(
            each.simulator.squared_error, measured.tuned_until(each.repetition, each.iteration), discrepancy
        )
        for each in found
    )
    axes = [
        Coordinate("Iteration", tuple(float(each.iteration) for each in found)),
        *(
            Coordinate(
                with_unit(spoken(tunable.name), [unit_of(tunable.name)]),
                tuple(float(each.simulator.parameters[at]) for each in found),
                float(space.lower[at]),
                float(space.upper[at]),
            )
            for at, tunable in enumerate(spec.tunables)
        ),
        Coordinate(with_unit("Error per sample", [discrepancy.error_unit(unit(spec))]), errors, wide=True),
        Coordinate(with_unit("Real fitness", [unit(spec)]), tuple(each.real for each in found)),
    ]
    return coordinates_figure(
        axes,
        shades=[float(each.iteration) for each in found],
        shades_label="Iteration",
        hover=[f"repetition {each.repetition}, iteration {each.iteration}" for each in found],
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
        hover=distinct_names([(each.name, each.strategy, each.id) for each in kept]),
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
