"""What stored studies found: tunables, distances from the truth, coverage of intervals, fitness, paired differences.

`python -m benchmarks.findings ARCHIVE.zip …` computes them from archives; experiments of all archives are compared.
"""

from argparse import ArgumentParser
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from gaplab import migrations
from gaplab.schemas.archives import ImportRead
from gaplab.services.archives import import_archive
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.matplotlib.files import Look, render_file
from gaplab.services.results.comparisons import compare
from gaplab.services.results.curves import curves
from gaplab.services.results.tuned_simulators import tuned_simulators
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries import experiments, tunings
from gaplab.services.store.queries.tunings import BestSimulator
from gaplab.services.store.session import Store


@contextmanager
def private_store() -> Iterator[Store]:
    """Yield an empty database at the latest revision, which is deleted afterwards."""
    with TemporaryDirectory(prefix="gaplab-archives-") as folder:
        url = f"sqlite:///{Path(folder) / 'gaplab.db'}"
        migrations.upgrade(url)
        store = Store(url)
        try:
            yield store
        finally:
            store.dispose()


def import_file(store: Store, path: Path) -> ImportRead:
    """Import an archive, and return the ids of its study and its experiments.

    Raises:
        SystemExit: the file cannot be read, or is not an archive.
    """
    try:
        with path.open("rb") as file:
            return import_archive(store, file)
    except (OSError, InvalidArchive) as error:
        raise SystemExit(f"{path}: {error}") from error


WIDTH_IN = 7.2


def imported(store: Store, archives: Sequence[Path]) -> dict[str, str]:
    """Import archives; return labels of their experiments by their ids: the study's file, and the strategy."""
    labels = dict[str, str]()
    for path in archives:
        ids = import_file(store, path).experiments
        with store.reading() as session:
            names = {id_: experiments.get_experiment(session, id_).name for id_ in ids}
        labels |= {id_: path.stem if len(ids) == 1 else f"{path.stem}: {name}" for id_, name in names.items()}
    return labels


@dataclass(frozen=True)
class Found:
    """The best simulators after one number of samples, each `(n, p)`.

    Attributes:
        away: distances from the truth, as shares of the bounds.
        width: widths of the stated 95 % intervals, as shares of the bounds; None if none are stated.
        inside: 1 where they contain the truth, else 0.
    """

    away: FloatArray
    width: FloatArray | None = None
    inside: FloatArray | None = None

    def row(self) -> tuple[str, ...]:
        """Return the number of repetitions, medians, and shares of intervals with the truth in them."""
        together = np.median(np.linalg.norm(self.away, axis=1))
        cells = str(len(self.away)), f"{together:.3f}", _each(np.median(self.away, axis=0))
        if self.inside is None or self.width is None:
            return cells
        shares = f"{self.inside.mean():.2f}", _each(self.inside.mean(axis=0))
        return *cells, *shares, _each(np.median(self.width, axis=0))


def found(store: Store, id_: str) -> dict[int, Found]:
    """Return what tuning found, by number of samples.

    Nothing if reality has no truth for every tunable: it has none in another engine, whose coefficients mean other
    contacts.
    """
    with store.reading() as session:
        spec = spec_of(experiments.get_experiment(session, id_).spec)
        simulators = tunings.best_simulators(session, id_)
    if spec.reality.engine is None or spec.reality.engine.name != spec.engine.name:
        return {}
    if not set(spec.reality.parameters) >= {tunable.name for tunable in spec.tunables}:
        return {}
    truth = np.array([spec.reality.parameters[tunable.name] for tunable in spec.tunables])
    extent = np.array([tunable.upper - tunable.lower for tunable in spec.tunables])
    by_samples = defaultdict(list)
    for simulator in simulators:
        by_samples[simulator.iteration].append(simulator)
    return {samples: _found(best, truth, extent) for samples, best in by_samples.items()}


def _found(best: Sequence[BestSimulator], truth: FloatArray, extent: FloatArray) -> Found:
    away = np.abs(np.array([each.simulator.parameters for each in best]) - truth) / extent
    intervals = [each.simulator.interval for each in best if each.simulator.interval is not None]
    if len(intervals) < len(best):
        return Found(away)
    lower, upper = np.moveaxis(np.array(intervals), -1, 0)
    return Found(away, (upper - lower) / extent, ((lower <= truth) & (truth <= upper)).astype(float))


def tuned_table(store: Store, labels: dict[str, str]) -> Table:
    """Return the tunables of the best simulators, and their error per sample: mean and SD over repetitions.

    Here reality may have other coefficients than the simulators, or none.
    """
    columns = "study", "after", "n", "each tunable", "error per sample"
    table = Table(*columns, title="Tunables of the best simulators, in the order of the spec")
    for id_, label in labels.items():
        tuned = tuned_simulators(store, id_)
        for samples in tuned.errors:
            best = [each for each in tuned.simulators if each.iteration == samples]
            errors = np.array([each.error for each in best if each.error is not None])
            tunables = "  ".join(map(_spread, np.array([each.parameters for each in best]).T))
            table.add_row(label, str(samples), str(len(best)), tunables, _spread(errors))
    return table


def distance_table(store: Store, labels: dict[str, str]) -> Table:
    """Return medians over repetitions of the distances, and the coverage of intervals."""
    columns = "study", "after", "n", "together", "each tunable", "truth in interval", "each", "median width"
    table = Table(*columns, title="Median distance from the truth, as a share of the bounds; 95 % intervals")
    for id_, label in labels.items():
        for samples, findings in found(store, id_).items():
            table.add_row(label, str(samples), *findings.row())
    return table


def fitness_table(store: Store, labels: dict[str, str]) -> Table:
    """Return recorded fitness in reality after each number of real-world evaluations."""
    table = Table("study", "after", "n", "mean", "SD", title="Recorded fitness in reality")
    for curve in curves(store, list(labels)):
        for point in curve.points:
            numbers = map(_number, (point.mean, point.sd))
            table.add_row(labels[curve.experiment], str(point.evaluations), str(point.n), *numbers)
    return table


def difference_table(store: Store, labels: dict[str, str], counts: Sequence[int]) -> Table:
    """Return the differences of all pairs after each number of evaluations, and of their means over all of them.

    Each p has Holm's correction over the pairs of a row's number or range.
    """
    title = "Differences of fitness with 90 % intervals; p of the trusted test after Holm"
    table = Table("after", "first", "second", "difference", "p", title=title)
    first, last = min(counts), max(counts)
    for begin, end in [*((count, count) for count in counts), *([(first, last)] if first < last else [])]:
        after = str(end) if begin == end else f"{begin} to {end}"
        for pair in compare(store, list(labels), from_evaluations=begin, to_evaluations=end, intervals=False):
            difference = f"{_number(pair.difference)} ({_number(pair.lower)} to {_number(pair.upper)})"
            p = "-" if pair.trusted.p_holm is None else f"{pair.trusted.p_holm:.2g}"
            table.add_row(after, labels[pair.first], labels[pair.second], difference, p)
    return table


def _each(values: FloatArray) -> str:
    return " ".join(f"{value:.3f}" for value in values)


def _spread(values: FloatArray) -> str:
    """Return mean and standard deviation in words, the latter of two values or more."""
    mean = f"{values.mean():.4f}" if len(values) else "-"
    return f"{mean} ± {values.std(ddof=1):.4f}" if len(values) > 1 else mean


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def main() -> None:
    """Import the archives into a temporary database, and print the tables."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("archives", nargs="+", type=Path)
    parser.add_argument("--after", type=int, nargs="+", default=[1, 3], help="numbers of evaluations to compare at")
    parser.add_argument("--svg", type=Path, help="file to draw the curves into")
    arguments = parser.parse_args()
    with private_store() as store:
        labels = imported(store, arguments.archives)
        tables = [make(store, labels) for make in (tuned_table, distance_table, fitness_table)]
        tables += [difference_table(store, labels, arguments.after)] if len(labels) > 1 else []
        for table in tables:
            Console(width=150).print(table)
        if arguments.svg:
            drawn = curves(store, list(labels))
            named = [curve.model_copy(update={"name": labels[curve.experiment]}) for curve in drawn]
            arguments.svg.write_bytes(render_file(curves_figure(named), "svg", Look(WIDTH_IN)))


if __name__ == "__main__":
    main()
