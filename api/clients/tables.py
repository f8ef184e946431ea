"""Results as tables: pandas frames with one row per observation, complete however many pages the service sends."""

import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from gaplab.api.clients.connection import Connection, Of, id_of, segment
from gaplab.api.clients.errors import library
from gaplab.api.clients.frames import frame
from gaplab.api.clients.results import PAGE, Results
from gaplab.schemas.records import ExperimentRead, Page, SampleRead, SensorsRead, SimulatorRead
from gaplab.schemas.replays import Prediction, Predictions
from gaplab.schemas.results import CurvePoint

if TYPE_CHECKING:
    import pandas

NAMED = ("experiment", "name", "strategy")
STATISTICS = ("evaluations", "n", "mean", "sd", "lower", "upper")


class Tables:
    """Results as pandas frames. Each method raises ExtraMissing without pandas."""

    def __init__(self, connection: Connection, results: Results) -> None:
        self._connection = connection
        self._results = results

    def curve(self, *of: Of, each: bool = False) -> "pandas.DataFrame":
        """Return curves: fitness in reality against the number of real-world evaluations.

        Args:
            of: studies, for all of their experiments, and single experiments.
            each: one row per repetition, instead of one with their mean, SD, n and 95 % interval.
        """
        numbers = ("repetition", "evaluations", "fitness") if each else STATISTICS
        rows = [
            (curve.experiment, curve.name, curve.strategy, *row)
            for curve in self._results.curves(of)
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
        `NAME_upper` of each tunable, and one that gives shares of the posterior probability the column `weight`.
        Without simulators there are no columns of tunables. With a `repetition` or an `iteration`, 0 for the untuned
        start, the table has only those.
        """
        path = f"/experiments/{segment(of)}/simulators"
        filters = {"limit": PAGE, "repetition": repetition, "iteration": iteration}
        simulators = list(self._connection.items(Page[SimulatorRead], path, **filters))
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

    def _samples(self, of: Of, repetition: int | None, kind: str | None) -> list[SampleRead]:
        path = f"/experiments/{segment(of)}/samples"
        return list(self._connection.items(Page[SampleRead], path, limit=PAGE, repetition=repetition, kind=kind))


def _repeats(sample: SampleRead) -> int:
    """Return the number of values whose mean is the fitness; a measurement without repeats has one."""
    return 0 if sample.fitness is None else len(sample.repeats or (sample.fitness,))


def _tuned(simulator: SimulatorRead) -> dict[str, float]:
    found = dict(simulator.parameters)
    for name, (lower, upper) in (simulator.intervals or {}).items():
        found |= {f"{name}_lower": lower, f"{name}_upper": upper}
    return found if simulator.weight is None else found | {"weight": simulator.weight}


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
