"""Studies from archives, by strategy."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.findings import Found, found, import_file
from benchmarks.reproduction.paper import ITERATIONS, STRATEGIES
from gaplab.schemas.curves import Curve, Fitness
from gaplab.schemas.records import ExperimentRead, MeasurementKind
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments import reading
from gaplab.services.findings.statistics import finite
from gaplab.services.results.curves import curves, values_of
from gaplab.services.running import provenance
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries import experiments, results
from gaplab.services.store.queries.costs import work_of
from gaplab.services.store.session import Store

CODE = "OPENBLAS_CORETYPE"
"""Variable that gaplab sets since it chooses one code for all processors."""


@dataclass(frozen=True, eq=False)
class Arm:
    """One experiment of a study.

    Attributes:
        read: the experiment, as the API returns it.
        spec: its resolved spec.
        recorded: recorded fitness `(r, k)` by repetition and number of real-world evaluations; nan is missing.
        transferred: fitness `(r, k)` in reality of the transferred controllers alone; nan if it failed or is missing.
        chances: the best of these so far, so that each strategy has as many.
        samples: fitness `(r, k)` in reality of the samples.
        tuned: its best simulators, by number of samples.
        core_hours: hours of computation in its recorded steps, times cores.
        origins: repetitions of which the software is known, those from a changed clone, and those that were computed
            before gaplab chose one code for all processors.
    """

    read: ExperimentRead
    spec: ResolvedSpec
    recorded: FloatArray
    transferred: FloatArray
    chances: FloatArray
    samples: FloatArray
    tuned: dict[int, Found]
    core_hours: float
    origins: tuple[int, int, int]

    @property
    def strategy(self) -> str:
        """Return the name of its strategy."""
        return self.spec.strategy.name

    @property
    def repetitions(self) -> int:
        """Return the complete repetitions."""
        return int(np.isfinite(self.recorded[:, -1]).sum())

    @property
    def last(self) -> int:
        """Return the number of real-world evaluations of a complete repetition."""
        return int(self.recorded.shape[1]) - 1

    @property
    def selection(self) -> int | None:
        """Return the evaluations of the search for a sample; None without a search."""
        kind, budget = strategies[self.strategy], self.spec.budget
        reused = budget.reuse_transfer and kind.selects_transferred
        return (budget.controller_evaluations if reused else budget.selection_evaluations) if kind.searches else None

    def values(self, first: int, last: int) -> FloatArray:
        """Return the mean `(r,)` of each repetition over a range of evaluations, without incomplete repetitions."""
        return finite(self.recorded[:, first : last + 1].mean(axis=1)) if last <= self.last else np.empty(0)

    def complete(self, first: int, last: int) -> FloatArray:
        """Return the values `(r, k)` of the complete repetitions at each number of evaluations of a range."""
        values = self.recorded[:, first : last + 1]
        return values[np.isfinite(values).all(axis=1)]


class Study:
    """A stored study; its archives are several if its experiments were computed apart.

    Attributes:
        curves: of its experiments.
        beside: the same of transferred controllers alone.
        spec: that of its first experiment, which has the settings that all share.
        reality: the engine of its reality, in words.
        direct: fitness `(r,)` of the direct baseline; empty without it.
        unit: the mean of that; nan without it.
        present: the paper's strategies that it has, in the paper's order.
        last: the last planned number of evaluations that these share, up to the paper's ten.
        whole: whether it has all of the paper's strategies, samples and direct.
    """

    def __init__(
        self, archives: Sequence[Path], name: str, arms: Sequence[Arm], curves: Sequence[Curve], beside: Sequence[Curve]
    ) -> None:
        self.archives, self.name, self.arms, self.curves, self.beside = tuple(archives), name, arms, curves, beside
        self.spec = arms[0].spec
        self.toy = self.spec.robot.name == "toy_function"
        self.reality = self.spec.reality.engine.name if self.spec.reality.engine else "a robot on a bench"
        self.direct = next((finite(arm.recorded[:, 0]) for arm in arms if arm.read.direct), np.empty(0))
        self.unit = float(self.direct.mean()) if len(self.direct) else float("nan")
        self.present = tuple(arm.strategy for arm in self.of())
        self.last = min([ITERATIONS, *(arm.last for arm in self.of())])
        self.whole = self.present == STRATEGIES and self.last == ITERATIONS and bool(len(self.direct))

    def arm(self, strategy: str) -> Arm | None:
        """Return the experiment of a strategy, the first of several; None if the study has none."""
        return next((arm for arm in self.arms if arm.strategy == strategy), None)

    def of(self, names: Iterable[str] = STRATEGIES) -> list[Arm]:
        """Return its experiments of these strategies, in their order."""
        return [arm for name in names if (arm := self.arm(name))]

    def unequal(self, names: Iterable[str]) -> str | None:
        """Return how the searches for a sample of these strategies differ in size; None if they do not."""
        sizes = {arm.strategy: arm.selection for arm in self.of(names) if arm.selection is not None}
        if len(set(sizes.values())) < 2:
            return None
        told = ", ".join(f"{name} {size:,}" for name, size in sizes.items())
        return f"samples are selected from searches of unequal size ({told} evaluations)"


def read_study(store: Store, archives: Sequence[Path]) -> Study:
    """Import archives of studies or of single experiments, and return them as one study, named by the first.

    Raises:
        SystemExit: a file is not an archive, or the archives differ in robot, engines, reality, budget, tuner,
            optimizers or seed.
    """
    parts = [_part(store, archive) for archive in archives]
    reads = [read for _, experiments_of in parts for read in experiments_of]
    arms = _arms(store, reads)
    if len(parts) > 1 and len({_settings(arm.spec) for arm in arms}) > 1:
        raise SystemExit(
            f"{', '.join(map(str, archives))}: robot, engines, reality, budget, tuner, optimizers or seed differ"
        )
    times = Counter(arm.strategy for arm in arms)
    names = {arm.read.id: arm.strategy if times[arm.strategy] == 1 else arm.read.name for arm in arms}
    named = [replace(arm, read=arm.read.model_copy(update={"name": names[arm.read.id]})) for arm in arms]
    recorded, transferred = (curves(store, list(names), kind) for kind in (Fitness.RECORDED, Fitness.TRANSFERRED))
    drawn = [curve.model_copy(update={"name": names[curve.experiment]}) for curve in recorded]
    return Study(archives, parts[0][0], named, drawn, transferred)


def _part(store: Store, archive: Path) -> tuple[str, tuple[ExperimentRead, ...]]:
    """Import an archive, and return its name and its experiments."""
    study = reading.read(store, import_file(store, archive).study)
    return study.name, study.experiments


def _settings(spec: ResolvedSpec) -> str:
    """Return the settings that experiments of one study share."""
    world = {"robot", "controller", "task", "engine", "tunables", "reality", "seed"}
    return spec.model_dump_json(include=world | {"budget", "tuner", "discrepancy", "optimizer", "controller_optimizer"})


def _arms(store: Store, reads: Sequence[ExperimentRead]) -> list[Arm]:
    ids, arms = [read.id for read in reads], []
    tuned = {id_: found(store, id_) for id_ in ids}
    with store.reading() as session:
        rows = experiments.meant(session, ids)
        work, fitness = work_of(session, ids), {kind: values_of(session, rows, kind) for kind in Fitness}
        samples = {id_: np.full_like(each, np.nan) for id_, each in fitness[Fitness.RECORDED].items()}
        for id_, number, iteration, value in results.measured_fitness(session, ids, MeasurementKind.SAMPLE):
            samples[id_][number, iteration] = np.nan if value is None else value
        for read, row in zip(reads, rows, strict=True):
            spec = spec_of(row.spec)
            uses = [(use.repetitions, use.provenance) for use in provenance.uses(session, read.id)]
            engine = spec.reality.engine if read.direct else spec.engine
            cores = int(engine.options.get("threads", 1)) if engine else 1
            origins = (
                sum(count for count, _ in uses),
                sum(count for count, code in uses if code.dirty),
                sum(count for count, code in uses if CODE not in code.libraries),
            )
            recorded, transferred, chances = (fitness[kind][read.id] for kind in Fitness)
            seen = recorded, transferred, chances, samples[read.id]
            arms.append(Arm(read, spec, *seen, tuned[read.id], work[read.id].seconds * cores / 3600, origins))
    return arms
