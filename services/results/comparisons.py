"""Comparisons of stored experiments, computed by the core."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.costs import OF_EVALUATIONS, CostModel
from gaplab.schemas.curves import Fitness
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.records import common_count
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.experiments.views import fitness_of, hidden, view_experiments
from gaplab.services.findings import sentences
from gaplab.services.findings.comparisons import Compared, compare_all
from gaplab.services.results.costs import equal_cost
from gaplab.services.results.curves import values_of
from gaplab.services.specs.resolution import is_direct, takes_samples
from gaplab.services.specs.robots import unit
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow
from gaplab.services.store.queries import experiments
from gaplab.services.store.queries.requests import bench_key
from gaplab.services.store.session import Session, Store
from gaplab.services.world.robot_library import label_of
from gaplab.services.world.tasks.base import ReadOptions

MOST_WITH_INTERVALS = 20
"""Most experiments whose comparison has intervals unless it is asked for without them."""


@dataclass(frozen=True)
class Margin:
    """A difference, above 0, within which two experiments are equivalent.

    It is in the unit of fitness, or a share of the direct baseline's mean fitness.
    """

    value: float
    of_direct: bool = False


def compare(  # noqa: PLR0913 - each is a parameter of the operation
    store: Store,
    ids: Sequence[str],
    *,
    from_evaluations: int | None = None,
    to_evaluations: int | None = None,
    margin: Margin | None = None,
    intervals: bool | None = None,
    fitness: Fitness = Fitness.RECORDED,
    model: CostModel = OF_EVALUATIONS,
    at: float | None = None,
) -> tuple[Comparison, ...]:
    """Compare every pair of experiments on their fitness in reality, one value for each repetition.

    The only value of an experiment without samples is compared with every number of real-world evaluations.

    Args:
        store: database with the experiments.
        ids: of studies and experiments, which mean two or more experiments.
        from_evaluations: the first number of evaluations; by default the last.
        to_evaluations: the last number; by default the last that the experiments share.
        margin: difference within which two experiments are equivalent; None: not tested.
        intervals: by default for up to `MOST_WITH_INTERVALS` experiments.
        fitness: whose fitness counts; by default the recorded one, as in the paper.
        model: what is equal, if not the number of evaluations: then each experiment has the last number that it could
            pay for. The direct baseline counts at any cost.
        at: the rollouts, seconds or cost that are equal; by default the least that an experiment with samples spent.

    Raises:
        NotFound: there is nothing with one of the ids.
        InvalidSpec: fewer than two experiments, a range that is empty, negative or beyond
            all experiments, a share of direct without one direct baseline, or a cost that none has spent.
    """
    _refuse_both(model, at, (from_evaluations, to_evaluations))
    with store.reading() as session:
        rows = _several(session, ids)
        values = values_of(session, rows, fitness)
        shared = common_count(view_experiments(session, rows)) or 0
        within = None if margin is None else _in_units(session, rows, margin)
        settings = _settings(session, rows)
        compared = [_compared(row, values[row.id]) for row in rows]
        equal = None if model.x == "evaluations" else equal_cost(session, _direct(rows, are=False), model, at)
    first, final = (0, 0) if equal else _range(rows, compared, shared, from_evaluations, to_evaluations)
    compared = equal.applied(compared) if equal else compared
    with_intervals = len(rows) <= MOST_WITH_INTERVALS if intervals is None else intervals
    pairs = compare_all(compared, first, final, margin=within, intervals=with_intervals)
    known = (row.known for row in rows if row.tunes or row.known)
    where = equal.where if equal else sentences.where(first, final, *known)
    told = {"fitness": fitness, "unit": unit(spec_of(rows[0].spec)), "where": where, "shared_evaluations": shared}
    told_pairs = (pair.model_copy(update=told) for pair in (equal.told(pairs) if equal else pairs))
    return tuple(pair.model_copy(update=_warned(settings, pair)) for pair in told_pairs)


def _several(session: Session, ids: Sequence[str]) -> Sequence[ExperimentRow]:
    if len(rows := experiments.meant(session, ids)) < 2:
        message = "a comparison needs two or more experiments, and this names one"
        raise InvalidSpec([Violation("study", list(ids), message)])
    return rows


def _refuse_both(model: CostModel, at: float | None, counts: tuple[int | None, int | None]) -> None:
    """Refuse numbers of evaluations at equal cost, and a cost at equal evaluations.

    Raises:
        InvalidSpec: there is one.
    """
    if model.x == "evaluations" and at is not None:
        message = "at is an amount of rollouts, time or cost, and x names which"
        raise InvalidSpec([Violation("at", at, message, "left out, or x=rollouts, time or cost")])
    if model.x != "evaluations" and counts != (None, None):
        message = "experiments are compared after equal numbers of real-world evaluations, or at equal cost"
        raise InvalidSpec([Violation("from", list(counts), message, "left out, or x=evaluations")])


def _range(
    rows: Sequence[ExperimentRow], compared: Sequence[Compared], shared: int, first: int | None, last: int | None
) -> tuple[int, int]:
    """Return the numbers of evaluations that are compared; by default the last that is shared.

    Raises:
        InvalidSpec: the range is empty, negative or beyond all experiments.
    """
    final = shared if last is None else last
    first = final if first is None else first
    if not 0 <= first <= final:
        message = f"the range of real-world evaluations must ascend from 0 or more, not from {first} to {final}"
        raise InvalidSpec([Violation("from", first, message, f"0 to {final}")])
    if last is not None:
        _check_the_end(rows, compared, last)
    return first, final


def _check_the_end(rows: Sequence[ExperimentRow], compared: Sequence[Compared], last: int) -> None:
    """Refuse a last number of evaluations that no experiment with samples has: nothing would be compared.

    Raises:
        InvalidSpec: it is beyond all of them.
    """
    counts = [row.iterations for row, each in zip(rows, compared, strict=True) if not each.level]
    most = max(1, *counts) - 1 if counts else last
    if last > most:
        message = f"no experiment has {last} real-world evaluations; permitted: 0 to {most}"
        raise InvalidSpec([Violation("to", last, message, f"0 to {most}")])


def _compared(row: ExperimentRow, recorded: FloatArray) -> Compared:
    spec = spec_of(row.spec)
    return Compared(row.id, row.name, recorded, not takes_samples(spec), spec.seed, spec.strategy.name)


def _in_units(session: Session, rows: Sequence[ExperimentRow], margin: Margin) -> float:
    """Return a margin in the unit of fitness.

    The direct baseline is that of the experiments, or else of their studies.
    """
    if not margin.of_direct:
        return margin.value
    studies = {row.study_id for row in rows}
    baselines = _direct(rows) or _direct(experiments.experiments_of(session, sorted(studies)))
    means = [point.mean for point in fitness_of(session, baselines).values()]
    if len(baselines) != 1 or len(means) != 1 or means[0] <= 0:
        message = (
            "a margin as a share of direct needs one direct baseline with a fitness above 0 among the experiments or "
            f"in their studies, and there are {len(baselines)}; give the margin in the unit of fitness"
        )
        raise InvalidSpec([Violation("margin_of_direct", margin.value, message)])
    return margin.value * means[0]


def _direct(rows: Sequence[ExperimentRow], *, are: bool = True) -> list[ExperimentRow]:
    """Return the experiments that are the direct baseline, or those that are not."""
    return [row for row in rows if is_direct(spec_of(row.spec)) is are]


def warnings_of(store: Store, ids: Sequence[str]) -> tuple[str, ...]:
    """Return why any two of the experiments that ids name should not be compared, each reason once.

    Raises:
        NotFound: there is nothing with one of the ids.
    """
    with store.reading() as session:
        settings = _settings(session, experiments.meant(session, ids))
    return tuple(dict.fromkeys(text for pair in combinations(settings.values(), 2) for text in _warnings(*pair)))


def _warned(settings: Mapping[str, "_Setting"], pair: Comparison) -> dict[str, tuple[str, ...]]:
    return {"warnings": tuple(_warnings(settings[pair.first], settings[pair.second]))}


@dataclass(frozen=True)
class _Setting:
    """What must be equal in two experiments for a comparison of their strategies."""

    id: str
    study: str
    spec: ResolvedSpec
    is_hidden: bool


def _settings(session: Session, rows: Sequence[ExperimentRow]) -> dict[str, _Setting]:
    concealed = hidden(session, rows)
    return {row.id: _Setting(row.id, row.study_id, spec_of(row.spec), row.id in concealed) for row in rows}


def _warnings(first: _Setting, second: _Setting) -> Iterator[str]:
    """Yield why two experiments should not be compared: other robots, other tasks, or other realities."""
    one, other = first.spec, second.spec
    if one.robot != other.robot:
        yield sentences.unlike("robots", label_of(one.robot), label_of(other.robot))
    elif _rates(one.task) != _rates(other.task):
        yield sentences.unlike("tasks", *(spec.task.name if spec.task else "its own" for spec in (one, other)))
    if first.study == second.study:
        return
    if _setup(one) == _setup(other) and (first.is_hidden or second.is_hidden):
        yield sentences.HIDDEN
    elif _reality(one) != _reality(other):
        yield sentences.OTHER_REALITY


def _rates(task: PluginRef | None) -> tuple[str, dict[str, Any]] | None:
    """Return the task without what it reads, on which fitness does not depend."""
    reads = {*ReadOptions.model_fields, "noise_tilt"}
    if task is None:
        return None
    return task.name, {name: value for name, value in task.options.items() if name not in reads}


def _setup(spec: ResolvedSpec) -> tuple[object, ...]:
    bench = bench_key(spec.reality.bench or "")
    noise = spec.reality.noise, spec.reality.noise_unit
    return spec.reality.kind, spec.reality.engine, noise, bench, sorted(spec.reality.parameters)


def _reality(spec: ResolvedSpec) -> tuple[object, ...]:
    return *_setup(spec), sorted(spec.reality.parameters.items())
