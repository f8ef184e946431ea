"""Results of experiments: curves, comparisons, misfit and replays, and as pandas frames.

Frames have a row for each observation, and are complete however many pages the service sends.
"""

import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING, TypeAlias

from pydantic import BaseModel

from gaplab.api.clients.connection import Connected, Of, Parameter, Rows, id_of, segment
from gaplab.api.clients.errors import library
from gaplab.schemas.base import html_of
from gaplab.schemas.comparisons import COLUMNS, TEXTS, Comparison, row
from gaplab.schemas.curves import Curve, CurvePoint
from gaplab.schemas.differences import SpecDiff
from gaplab.schemas.misfit import MisfitRead
from gaplab.schemas.records import ExperimentRead, Page, SampleRead, SensorsRead, SimulatorRead
from gaplab.schemas.replays import Prediction, Predictions, Replay
from gaplab.services.csv_tables import csv_text
from gaplab.services.findings.tables import comparison, latex

if TYPE_CHECKING:
    import pandas

Several: TypeAlias = Of | Sequence[Of]

PAGE = 5_000
"""Samples or simulators of one request: the most that the service permits."""

MOST_CURVES = 100
"""Ids of one request: the most that the service permits."""

NAMED = ("experiment", "name", "strategy")
STATISTICS = ("evaluations", "n", "mean", "sd", "lower", "upper")

WHOLE = {"repetition", "iteration", "rank", "evaluations", "n", "repeats"}
WHOLE |= {"from_evaluations", "to_evaluations", "n_first", "n_second", "n_paired"}
"""Columns of whole numbers, in whatever table; they are never null."""


class Comparisons(Rows[Comparison]):
    """The pairs of a comparison, as a tuple that also has tables."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        grids = comparison(self) if self else ()
        return "".join(f"<p>{escape(grid.caption)}</p>{html_of((grid.head, *grid.rows))}" for grid in grids)

    def frame(self) -> "pandas.DataFrame":
        """Return a row for each pair, with a column for each number, named as in CSV; an undefined number is nan.

        Raises:
            ExtraMissing: pandas is not installed.
        """
        return frame(map(row, self), COLUMNS, TEXTS | {"shared_streams"})

    def csv(self) -> str:
        """Return the same rows as CSV."""
        return csv_text(COLUMNS, map(row, self))

    def latex(self) -> str:
        """Return tables for a paper, with p before and after Holm's correction; LaTeX needs the package booktabs."""
        return latex(comparison(self))


class Results(Connected):
    """Results of experiments. Methods that return frames raise ExtraMissing without pandas."""

    def best_simulator(self, of: Of) -> SimulatorRead | None:
        """Return the tuned simulator of the latest iteration with the smallest error; None if there is none yet."""
        best = [each for each in self._simulators(of) if each.rank == 0 and each.error is not None]
        latest = max((each.iteration for each in best), default=0)
        return min(
            (each for each in best if each.iteration == latest),
            key=lambda each: (each.error, each.repetition),
            default=None,
        )

    def curves(self, of: Several, fitness: str = "recorded") -> tuple[Curve, ...]:
        """Return the curves of all experiments of studies, and of single experiments, in this order.

        Args:
            of: studies and experiments; or a single one.
            fitness: recorded as in the paper, `transferred` controllers alone, or the best of these so far,
                `equal_chances`.
        """
        found = (self._connection.get(tuple[Curve, ...], "/curves", study=ids, fitness=fitness) for ids in _parts(of))
        return Rows(curve for part in found for curve in part)

    def curves_csv(self, of: Several) -> str:
        """Return the curves of studies and experiments as CSV."""
        requests = ({"study": part, "format": "csv"} for part in _parts(of))
        first, *others = (self._connection.get_bytes("/curves", **request).decode() for request in requests)
        return first + "".join(other.partition("\n")[2] for other in others)  # the header stands once

    def compare(  # noqa: PLR0913 - each is a parameter of the operation
        self,
        of: Several,
        first: int | None = None,
        last: int | None = None,
        *,
        margin: float | None = None,
        margin_of_direct: float | None = None,
        intervals: bool | None = None,
        fitness: str = "recorded",
        **costs: str | float | None,
    ) -> Comparisons:
        """Compare every pair of experiments, one value for each repetition: over a range, its mean.

        Each p is given before and after Holm's correction over all pairs. `trusted` of a pair is the test by which to
        judge it: paired if both experiments draw the same random numbers. Over a range, `pooled` has the paper's tests,
        whose p are too small.

        Args:
            of: studies, for all of their experiments, and single experiments; or a single study.
            first: first number of real-world evaluations; left out: `last`.
            last: last number; left out: the last that all experiments have.
            margin: difference in the unit of fitness; `equivalence` of a pair says whether it differs by less.
            margin_of_direct: the same margin as a share of the direct baseline's mean fitness, like 0.03.
            intervals: with intervals; left out: for up to 20 experiments.
            fitness: whose fitness counts, as in `curves`.
            costs: in place of `first` and `last`: x="rollouts", "time" or "cost", the model of it as in a figure of
                curves, like cost_s=90 and rollout_s=0.01, and perhaps at, an amount of it. Each experiment is compared
                after the last evaluation that it could pay for.
        """
        query: dict[str, Parameter] = {"study": _ids(of), "from": first, "to": last}
        query |= {"margin": margin, "margin_of_direct": margin_of_direct, "intervals": intervals, "fitness": fitness}
        query |= costs
        return Comparisons(self._connection.get(tuple[Comparison, ...], "/comparisons", **query))

    def diff(self, *of: Of) -> SpecDiff:
        """Return the settings in which studies and experiments differ; of a single study, its experiments."""
        return self._connection.get(SpecDiff, "/differences", study=_ids(of))

    def misfit(self, of: Of) -> MisfitRead:
        """Return how far the tuned simulators of an experiment are from reality and from each other."""
        return self._connection.get(MisfitRead, f"/experiments/{segment(of)}/misfit")

    def replay(self, of: Of, /, **choice: int | str | None) -> Replay:
        """Return the motion of a controller of an experiment in its simulator and in reality.

        Its choice, as in the API: repetition, iteration (left out: the last that was measured), kind ("transfer" or
        "sample") and simulator.
        """
        return self._connection.get(Replay, f"/experiments/{segment(of)}/replay", **choice)

    def curve(self, *of: Of, each: bool = False) -> "pandas.DataFrame":
        """Return curves: fitness in reality against the number of real-world evaluations.

        Args:
            of: studies, for all of their experiments, and single experiments.
            each: one row per repetition, instead of one with their mean, SD, n and 95 % interval.
        """
        numbers = ("repetition", "evaluations", "fitness") if each else STATISTICS
        rows = [
            (curve.experiment, curve.name, curve.strategy, *row)
            for curve in self.curves(of)
            for point in curve.points
            for row in _rows(point, each=each)
        ]
        return frame(rows, (*NAMED, *numbers), NAMED)

    def samples(self, of: Of, *, repetition: int | None = None, kind: str | None = None) -> "pandas.DataFrame":
        """Return the real-world evaluations of an experiment, with a column for each gene.

        `repeats` is the number of values whose mean is the fitness, 0 if the measurement failed. `standard_error` is
        nan without repeats. Without evaluations there are no columns of genes. With a `repetition` or a `kind`,
        "sample" (learned from) or "probe" (only recorded), the table has only those.
        """
        samples = self._samples(of, repetition, kind)
        columns = ("repetition", "iteration", "kind", "fitness", "measured_by", "measured_at", "standard_error")
        rows = [[*(getattr(sample, name) for name in columns), _repeats(sample)] for sample in samples]
        others = {"kind": str, "measured_by": str, "measured_at": "datetime64[us, UTC]"}
        table = frame(rows, (*columns, "repeats"), others).astype(others)
        genes = library("pandas", "notebook").DataFrame([sample.genome for sample in samples], index=table.index)
        return table.join(genes.rename(columns=lambda gene: f"gene_{gene}"))

    def readings(self, of: Of, *, repetition: int | None = None, kind: str | None = None) -> "pandas.DataFrame":
        """Return what the sensors said in the real-world evaluations of an experiment, with a column for each sensor.

        A row is one time of one evaluation; choose them as for `samples`. Values are in the sensors' units, nan where a
        sensor failed. The table is empty if the robot has no sensors.

        Raises:
            LookupError: the robot or its task is not installed in the service, so the sensors are unknown.
        """
        sensors = self._connection.get(ExperimentRead, f"/experiments/{segment(of)}").sensors
        if sensors is None:
            raise LookupError(
                f"the sensors of {id_of(of)} are unknown: its robot or task is not installed in the service"
            )
        names = [f"{name}_{unit}" for name, unit in zip(sensors.names, sensors.units, strict=True)]
        rows = [
            (sample.repetition, sample.iteration, str(sample.kind), time_s, *values)
            for sample in self._samples(of, repetition, kind)
            if sample.readings is not None
            for time_s, *values in _values(sample.readings, sensors)
        ]
        columns = ("repetition", "iteration", "kind", "time_s", *names)
        return frame(rows, columns, {"kind"}).astype({"kind": str})

    def simulators(self, of: Of, *, repetition: int | None = None, iteration: int | None = None) -> "pandas.DataFrame":
        """Return the tuned simulators of an experiment, with a column for each tunable; rank 0 is an iteration's best.

        `squared_error` is a sum over samples and grows with them; `error` is per sample, in the unit of the
        discrepancy; by default the root mean square. A tuner that gives 95 % intervals has the columns `NAME_lower` and
        `NAME_upper` of each tunable, and one that gives shares of the posterior probability the column `weight`. With
        held-out samples, `held_out_error` is the sum over these, of rank 0.
        Without simulators there are no columns of tunables. With a `repetition` or an `iteration`, 0 for the untuned
        start, the table has only those.
        """
        simulators = self._simulators(of, repetition=repetition, iteration=iteration)
        columns = ("repetition", "iteration", "rank", "squared_error", "error")
        table = frame([[getattr(row, name) for name in columns] for row in simulators], columns)
        return table.join(
            library("pandas", "notebook").DataFrame([_tuned(row) for row in simulators], index=table.index)
        )

    def predictions(self, of: Of, *, every_s: float = 0.5, timeout_s: float = 600.0) -> "pandas.DataFrame":
        """Return the fitness of each sample in reality, and in simulation before and after it was measured.

        The service computes predictions at the first request, and this method waits for it. If there are very many
        samples, the table has those of the first repetitions. It asks every `every_s` seconds.

        Raises:
            TimeoutError: it takes longer than `timeout_s`; computed predictions are kept, so ask again.
        """
        library("pandas", "notebook")
        deadline, path = time.monotonic() + timeout_s, f"/experiments/{segment(of)}/predictions"
        while (predictions := self._connection.get(Predictions, path)).pending:
            if time.monotonic() > deadline:
                msg = f"{predictions.pending} predictions of {id_of(of)} are not computed after {timeout_s:g} s"
                raise TimeoutError(f"{msg}; ask again")
            time.sleep(every_s)
        columns = tuple(Prediction.model_fields)
        return frame([[getattr(item, name) for name in columns] for item in predictions.items], columns)

    def _simulators(self, of: Of, **filters: int | None) -> list[SimulatorRead]:
        path = f"/experiments/{segment(of)}/simulators"
        return list(self._connection.items(Page[SimulatorRead], path, limit=PAGE, **filters))

    def _samples(self, of: Of, repetition: int | None, kind: str | None) -> list[SampleRead]:
        path = f"/experiments/{segment(of)}/samples"
        return list(self._connection.items(Page[SampleRead], path, limit=PAGE, repetition=repetition, kind=kind))


def frame(rows: Iterable[Sequence[object]], columns: Sequence[str], others: Collection[str] = ()) -> "pandas.DataFrame":
    """Return a frame whose columns have the same types with and without rows.

    Args:
        rows: values by column.
        columns: names of the columns: of numbers, with nan for null.
        others: those of them that are not numbers.

    Raises:
        ExtraMissing: pandas is not installed.
    """
    made = library("pandas", "notebook").DataFrame(list(rows), columns=list(columns))
    return made.astype({name: "int64" if name in WHOLE else "float64" for name in columns if name not in others})


def _ids(of: Several) -> list[str]:
    """Return the ids of studies and experiments; a single one, which may be a sequence of letters, is one of them."""
    return [id_of(of)] if isinstance(of, str | BaseModel) else list(map(id_of, of))


def _parts(of: Several) -> Iterator[list[str]]:
    """Split the ids into requests; no ids at all are one request, for the service to refuse."""
    ids = _ids(of)
    for start in range(0, len(ids) or 1, MOST_CURVES):
        yield ids[start : start + MOST_CURVES]


def _repeats(sample: SampleRead) -> int:
    """Return the number of values whose mean is the fitness; a measurement without repeats has one."""
    return 0 if sample.fitness is None else len(sample.repeats or (sample.fitness,))


def _tuned(simulator: SimulatorRead) -> dict[str, float]:
    found = dict(simulator.parameters)
    for name, (lower, upper) in (simulator.intervals or {}).items():
        found |= {f"{name}_lower": lower, f"{name}_upper": upper}
    others = {"weight": simulator.weight, "held_out_error": simulator.held_out_error}
    return found | {name: value for name, value in others.items() if value is not None}


def _values(readings: Sequence[float | None], sensors: SensorsRead) -> Iterator[tuple[float | None, ...]]:
    """Yield each time of one evaluation with the values of all sensors, in their units."""
    size = len(sensors.noises)
    for start, time_s in zip(range(0, len(readings), size or 1), sensors.times_s, strict=True):
        of_time = zip(readings[start : start + size], sensors.noises, strict=True)
        yield time_s, *(None if reading is None else reading * noise for reading, noise in of_time)


def _rows(point: CurvePoint, *, each: bool) -> list[tuple[float | None, ...]]:
    if each:
        return [(repetition, point.evaluations, fitness) for repetition, fitness in enumerate(point.values)]
    return [tuple(getattr(point, name) for name in STATISTICS)]
