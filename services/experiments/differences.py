"""The settings in which studies and experiments differ."""

from collections.abc import Sequence

from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.records import ExperimentRead
from gaplab.services.experiments import reading
from gaplab.services.specs.differences import SpecColumn, differences
from gaplab.services.store.session import Store


def read_differences(store: Store, studies: Sequence[str], experiments: Sequence[str]) -> SpecDiff:
    """Return the settings that differ between studies and experiments, or within a single study.

    Raises:
        NotFound: one of them does not exist.
        InvalidSpec: there is only one experiment to compare.
    """
    loaded = [reading.read_study(store, id) for id in studies]
    columns = [
        SpecColumn(study.id, study.name, tuple(experiment.spec for experiment in study.experiments)) for study in loaded
    ]
    if len(loaded) == 1 and not experiments:
        columns = [_column(experiment) for experiment in loaded[0].experiments]
    return differences([*columns, *(_column(reading.read_experiment(store, id)) for id in experiments)])


def _column(experiment: ExperimentRead) -> SpecColumn:
    return SpecColumn(experiment.id, experiment.name, (experiment.spec,))
