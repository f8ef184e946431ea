"""Rows of steps. A few statements write the rows of many repetitions."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, cast

from sqlalchemy import Connection, Table, Update, bindparam, insert, select, tuple_, update
from sqlalchemy.orm import Session

from gaplab.schemas.records import MeasurementKind
from gaplab.services.core.arrays import FloatArray, known
from gaplab.services.core.types import Cost, Fit, Measured, Probed, Selected, Step, Transferred, Tuned
from gaplab.services.store.clock import now
from gaplab.services.store.lease import TimedStep
from gaplab.services.store.models import IterationRow, MeasurementRow, SimulatorRow

_ITERATION, _MEASUREMENT, _SIMULATOR = (
    cast("Table", each.__table__) for each in (IterationRow, MeasurementRow, SimulatorRow)
)

_ORDER: tuple[type[Step], ...] = (Selected, Measured, Tuned, Transferred, Probed)

Row = dict[str, Any]
Key = tuple[int, int]
"""Repetition's id, and number of an iteration."""


class StepRows:
    """Collects the rows of steps, until `write` stores them.

    The caller has checked that each step is new and the next one.
    """

    def __init__(self) -> None:
        self._columns: dict[Key, Row] = defaultdict(lambda: {"seconds": 0.0})
        self._opened: set[Key] = set()
        self._ended: set[Key] = set()
        self._simulators: list[Row] = []
        self._measurements: dict[tuple[Key, MeasurementKind], Row] = {}

    def add(self, repetition: int, timed: TimedStep, measured_by: str) -> None:
        """Add a step of a repetition; `measured_by` is the engine or operator of its measurement, if it is one."""
        step, key = timed.step, (repetition, timed.step.iteration)
        columns = self._columns[key]
        columns.update(iteration_columns(step))
        columns["seconds"] += timed.seconds
        if isinstance(step, Selected) or position(step) == 0:
            self._opened.add(key)
        if isinstance(step, Probed):
            self._ended.add(key)
        if isinstance(step, Tuned):
            self._simulators += [_named(key) | each for each in simulator_columns(step)]
        if isinstance(step, Measured | Probed):
            self._measurements[key, _kind(step)] = measurement_columns(step, measured_by)

    def write(self, session: Session) -> None:
        """Store all rows in the session's transaction."""
        connection = session.connection()
        self._write_iterations(connection)
        if self._simulators:
            connection.execute(insert(_SIMULATOR), self._simulators)
        if self._measurements:
            connection.execute(insert(_MEASUREMENT), self._measured(connection))

    def _write_iterations(self, connection: Connection) -> None:
        """Write iterations by one statement for each set of filled columns; there are rarely more than three."""
        by_columns: dict[tuple[bool, bool, tuple[str, ...]], list[Key]] = defaultdict(list)
        for key, columns in self._columns.items():
            by_columns[key in self._opened, key in self._ended, tuple(columns)].append(key)
        for (opened, ended, names), keys in by_columns.items():
            if opened:
                rows = [self._row(key) for key in keys]
                connection.execute(insert(_ITERATION).values({"ended_at": now()} if ended else {}), rows)
            else:
                rows = [{f"of_{name}": value for name, value in self._row(key).items()} for key in keys]
                connection.execute(_fill(names, ended=ended), rows)

    def _row(self, key: Key) -> Row:
        return _named(key, "number") | self._columns[key]

    def _measured(self, connection: Connection) -> list[Row]:
        """Return the measurements with their genomes; a probe's genome may be stored with an earlier transfer."""
        probed = [key for key, kind in self._measurements if kind is MeasurementKind.PROBE]
        known = {key: self._columns[key].get("transferred_genome") for key in probed}
        known |= _transferred(connection, [key for key in probed if known[key] is None])
        return [
            _named(key) | {"kind": kind, "genome": known.get(key)} | columns
            for (key, kind), columns in self._measurements.items()
        ]


def position(step: Step) -> int:
    """Return the step's place in the log of its repetition, from 0. Iteration 0 has no Selected and no Measured."""
    return len(_ORDER) * step.iteration + _ORDER.index(type(step)) - _ORDER.index(Tuned)


def tallied(steps: Sequence[Step]) -> dict[str, int]:
    """Return what steps add to the tallies of their repetition, by column."""
    costs = [getattr(step, "cost", Cost()) for step in steps]
    return {
        "iterations_done": sum(isinstance(step, Probed) for step in steps),
        "rollouts_done": sum(int(cost.rollouts) for cost in costs),
        "rollouts_failed": sum(int(cost.failures) for cost in costs),
        "rollouts_saved": sum(int(cost.saved) for cost in costs),
    }


def vector(values: FloatArray) -> list[float]:
    """Return a JSON array, whose numbers read back exactly."""
    return [float(each) for each in values]


def iteration_columns(step: Step) -> dict[str, Any]:
    """Return the columns of its iteration that the step fills."""
    match step:
        case Selected():
            return {"selected_genome": vector(step.genome), **_phase("selection", step.cost)}
        case Tuned():
            return _phase("tuning", step.cost)
        case Transferred():
            found = {"transferred_genome": vector(step.genome), "simulated_fitness": known(step.fitness)}
            return found | _phase("transfer", step.cost)
        case Probed():
            return {"recorded_fitness": known(step.recorded)}
        case Measured():
            return {}


def simulator_columns(step: Tuned) -> list[dict[str, Any]]:
    """Return a row for each simulator of the step."""
    return [
        {
            "rank": rank,
            "parameters": vector(each.parameters),
            "squared_error": known(each.squared_error),
            "lower": None if each.interval is None else vector(each.interval[:, 0]),
            "upper": None if each.interval is None else vector(each.interval[:, 1]),
            "weight": each.weight,
            "held_out_error": each.held_out_error,
            "fit": each.fit and _fit(each.fit),
        }
        for rank, each in enumerate(step.simulators)
    ]


def _fit(fit: Fit) -> list[float | None]:
    return [*map(known, (fit.expected_error, fit.surprise, fit.interval_scale, *fit.reading_errors.tolist()))]


def measurement_columns(step: Measured | Probed, measured_by: str) -> dict[str, Any]:
    """Return the row of a measurement; a probe's step does not repeat the transferred genome."""
    seen = step if isinstance(step, Probed) else step.sample
    columns = {
        "fitness": known(seen.fitness),
        "readings": _readings(seen.readings),
        "repeats": vector(seen.repeats) if len(seen.repeats) else None,
        "left_out": isinstance(step, Probed) and step.left_out,
        "measured_by": measured_by,
    }
    return columns if isinstance(step, Probed) else {"genome": vector(step.sample.genome)} | columns


def _readings(values: FloatArray) -> list[float | None] | None:
    """Return a JSON array with None for each nan; None if there are no readings."""
    return [known(each) for each in values.tolist()] if len(values) else None


def _phase(name: str, cost: Cost) -> dict[str, int]:
    return {f"{name}_{count}": int(getattr(cost, count)) for count in ("rollouts", "failures", "saved")}


def _named(key: Key, number: str = "iteration") -> Row:
    return {"repetition_id": key[0], number: key[1]}


def _kind(step: Step) -> MeasurementKind:
    return MeasurementKind.SAMPLE if isinstance(step, Measured) else MeasurementKind.PROBE


@cache
def _fill(names: tuple[str, ...], *, ended: bool) -> Update:
    """Return the UPDATE that fills columns of a stored iteration; its seconds add up."""
    columns = _ITERATION.c
    values: Mapping[str, Any] = {name: bindparam(f"of_{name}") for name in names} | {
        "seconds": columns.seconds + bindparam("of_seconds"),
        **({"ended_at": now()} if ended else {}),
    }
    of_key = (columns.repetition_id == bindparam("of_repetition_id"), columns.number == bindparam("of_number"))
    return update(_ITERATION).where(*of_key).values(values)


def _transferred(connection: Connection, keys: Iterable[Key]) -> dict[Key, list[float]]:
    wanted, columns = list(keys), _ITERATION.c
    if not wanted:
        return {}
    found = connection.execute(
        select(columns.repetition_id, columns.number, columns.transferred_genome).where(
            tuple_(columns.repetition_id, columns.number).in_(wanted)
        )
    )
    return {(repetition, number): genome or [] for repetition, number, genome in found}
