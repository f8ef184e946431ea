"""Recomputation of an archive without a service: each repetition from its beginning, compared with its stored steps."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import groupby
from math import inf
from multiprocessing import get_context
from time import time
from typing import IO, Any

import numpy as np

from gaplab.arithmetic import code_for_avx512, has
from gaplab.schemas.archives import Outcome, RepetitionRerun, RerunRead
from gaplab.schemas.provenance import Provenance
from gaplab.services.archives.reading import CheckedArchive, checked_archive
from gaplab.services.core.errors import Conflict, NotFound
from gaplab.services.core.loop import Setting, repetition
from gaplab.services.core.ports import Reality
from gaplab.services.core.types import Measured, Probed, Selected, Step, Transferred
from gaplab.services.engines import engines
from gaplab.services.experiments.reading import read_spec
from gaplab.services.plugins import folders
from gaplab.services.plugins.external import named_files
from gaplab.services.running import provenance
from gaplab.services.running.versions import provenance as provenance_here
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import experiments, logs
from gaplab.services.store.session import Session
from gaplab.services.world import robot_library


@dataclass(frozen=True)
class Recorded:
    """A repetition as an archive has it, with id, name and stored spec of its experiment.

    Attributes:
        files: texts of the robot file and the pool that the spec needs, for a process that does not know them.
        until: time in seconds since 1970 after which no further step is computed.
    """

    experiment: str
    name: str
    number: int
    spec: Mapping[str, Any]
    log: tuple[Step, ...]
    files: tuple[str, ...] = ()
    until: float = inf


def rerun(recorded: Recorded) -> RepetitionRerun:
    """Recompute a repetition, and compare it step by step until one differs.

    Any error is the reason why the repetition is not computed, and ends no other one.
    """
    same = 0
    try:
        if (obstacle := _obstacle(recorded)) is not None:
            return result_of(recorded, "not computed", same, obstacle)
        computes = _computed(recorded)
        computed = repetition(computes)
        for number, stored in enumerate(recorded.log):
            if time() > recorded.until:
                return result_of(recorded, "same" if same else "not computed", same, "the time was over")
            if isinstance(stored, Selected) and stored.told:
                computed = repetition(computes, recorded.log[: number + 1])
            elif (found := _difference(stored, next(computed, None), same)) is not None:
                return result_of(recorded, "different", same, found)
            same += 1
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        return result_of(recorded, "not computed", same, f"{type(error).__name__}: {error}")
    return result_of(recorded, "same" if same else "not computed", same, None)


def result_of(recorded: Recorded, outcome: Outcome, steps: int, reason: str | None) -> RepetitionRerun:
    """Return how the recomputation of a repetition ended."""
    return RepetitionRerun(
        experiment=recorded.experiment,
        name=recorded.name,
        repetition=recorded.number,
        outcome=outcome,
        steps=steps,
        stored_steps=len(recorded.log),
        reason=reason,
    )


def _computed(recorded: Recorded) -> Setting:
    robot_library.learn(recorded.files)
    found = setting(spec_of(recorded.spec), recorded.number)
    if recorded.spec["reality"]["kind"] == "physical":
        found = replace(found, reality=_stored_answers(recorded.log))
    return found


def _stored_answers(log: Sequence[Step]) -> Reality:
    """Return a reality that answers about each genome of a log as the robot on the bench did."""
    answers, transferred = {}, None
    for step in log:
        match step:
            case Transferred(genome=genome):
                transferred = genome
            case Measured(sample=sample):
                answers[sample.genome.tobytes()] = sample.fitness, sample.readings, sample.repeats
            case Probed(left_out=False) if transferred is not None:
                answers[transferred.tobytes()] = step.fitness, step.readings, step.repeats
    return lambda genome: answers[genome.tobytes()]  # type: ignore[return-value] # with the repeats, as from a bench


def _obstacle(recorded: Recorded) -> str | None:
    """Return why a repetition cannot be computed here; None if it can."""
    reality = recorded.spec["reality"]
    if any(value is None for value in reality["parameters"].values()):
        return "the archive hides parameters of reality"
    for name in {each["name"] for each in (recorded.spec["engine"], reality["engine"]) if each}:
        if name not in engines:
            return f"the engine {name!r} is not installed here"
        if not engines[name].available():
            return f"the engine {name!r} is not installed here: {engines[name].install}"
        if not engines[name].repeatable:
            return f"the engine {name!r} measures a robot, and a measurement cannot be repeated"
    return None


def _difference(stored: Step, computed: Step | None, same: int) -> str | None:
    """Return how a step after so many equal ones differs from the stored one; None if it is equal."""
    if computed is None:
        return f"it ends here after {same} steps"
    found = difference(stored, computed)
    place = f"step {same + 1} ({type(stored).__name__.lower()}, iteration {stored.iteration})"
    return None if found is None else f"{place}: {found}"


def difference(stored: Step, computed: Step) -> str | None:
    """Return the first number that differs, with both values; None if all numbers have the same bits.

    The fit of simulators is compared if the archive has it: those of earlier versions do not.
    """
    if type(stored) is not type(computed):
        return f"it is {type(computed).__name__} here, and {type(stored).__name__} in the archive"
    before = dict(_numbers(stored))
    now = {place: number for place, number in _numbers(computed) if place in before or ".fit." not in place}
    for place in before | now:
        here, there = (repr(numbers[place]) if place in numbers else "absent" for numbers in (now, before))
        if here != there:  # the shortest text of a number tells all of its bits
            return f"{place} is {here} here, and {there} in the archive"
    return None


def _numbers(value: object, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield every number in a step with its place, like `simulators[0].squared_error`."""
    if is_dataclass(value):
        for field in fields(value):
            yield from _numbers(getattr(value, field.name), f"{place}.{field.name}" if place else field.name)
    elif isinstance(value, tuple | np.ndarray):
        for index, item in enumerate(value):
            yield from _numbers(item, f"{place}[{index}]")
    elif value is not None:
        yield place, float(value)  # type: ignore[arg-type] # steps have numbers only


SOFTWARE = ("gaplab", "code", "python", "architecture", "processor", "system", "spec_version")
NOT_RECORDED = "the archive does not say which software and machine computed it"


@dataclass(frozen=True)
class Part:
    """A part of an archive that is recomputed.

    Attributes:
        most: repetitions of each experiment, from number 0; None: all.
        experiment: name or id of the only experiment; None: all.
        repetition: number of the only repetition; None: all.
        minutes: time after which no further step is computed; None: until all are.
    """

    most: int | None = None
    experiment: str | None = None
    repetition: int | None = None
    minutes: float | None = None

    def repetitions(self, row: ExperimentRow, every: Sequence[RepetitionRow]) -> Sequence[RepetitionRow]:
        """Return the repetitions of an experiment that belong to the part."""
        if self.experiment not in {None, row.id, row.name}:
            return ()
        return [each for each in every[: self.most] if self.repetition in {None, each.number}]


def submitted_spec(file: IO[bytes]) -> dict[str, Any]:
    """Return the spec in an archive, to submit it again.

    Raises:
        InvalidArchive: the file is damaged, or not an archive.
        Conflict: no single spec gives all experiments, or parameters of reality are hidden.
    """
    with checked_archive(file) as checked:
        found = read_spec(checked.store, checked.study, reveal=True)
    if found.spec is None:
        raise Conflict(f"no single spec gives the experiments of the archive: {'; '.join(found.remarks)}")
    if any(value is None for spec in found.resolved for value in spec["reality"]["parameters"].values()):
        raise Conflict("the archive hides parameters of reality, so its spec cannot be submitted again")
    return found.spec


def verify(
    file: IO[bytes],
    part: Part = Part(),
    *,
    cores: int | None = None,
    computed: Callable[[RepetitionRerun], None] = lambda _: None,
) -> RerunRead:
    """Recompute the repetitions of an archive, and compare every number with the stored one, to the last bit.

    Where the processor has AVX-512, those that differ are tried again with its code.

    Args:
        file: the archive, seekable, at its beginning.
        part: what to recompute; left out: all.
        cores: processes that compute; left out: one for each core.
        computed: is called with each result, in the order of the archive; then with those of a second try.

    Raises:
        InvalidArchive: the file is damaged, or not an archive.
        NotFound: it has no such experiment or repetition.
    """
    with checked_archive(file) as checked, checked.store.reading() as session:
        recorded = list(_recorded(session, checked, part))
        versions = _other_versions(session, checked)
    results: list[RepetitionRerun] = []
    for result in rerun_all(recorded, cores or os.cpu_count()):
        results.append(result)
        computed(result)
    differing = [place for place, result in enumerate(results) if result.outcome == "different"]
    if differing and has("avx512f"):
        with code_for_avx512():
            again = rerun_all([recorded[place] for place in differing], cores or os.cpu_count())
            for place, result in zip(differing, again, strict=True):
                if result.outcome == "same":
                    results[place] = result.model_copy(update={"code": "AVX-512"})
                    computed(results[place])
    counts = {outcome: sum(result.outcome == outcome for result in results) for outcome in ("same", "different")}
    return RerunRead(
        **counts,
        not_computed=len(results) - sum(counts.values()),
        other_versions=versions,
        repetitions=tuple(results),
    )


def rerun_all(recorded: Sequence[Recorded], cores: int | None) -> Iterator[RepetitionRerun]:
    """Recompute repetitions in processes, and yield the results in their order.

    A process that dies is the reason why its repetition is not computed, and ends no other one. A pool breaks with any
    of its processes, so the first repetition without a result is tried alone, and those after it in another pool.
    Repetitions with other external plug-ins have other processes.
    """
    for plugins, some in groupby(recorded, lambda each: named_files(each.spec)):
        left = deque(some)
        while left:
            with _pool(cores, plugins) as processes, suppress(BrokenProcessPool):
                for result in processes.map(rerun, tuple(left)):
                    left.popleft()
                    yield result
            if left:
                yield _rerun_alone(left.popleft(), plugins)


def _rerun_alone(recorded: Recorded, plugins: Mapping[str, str]) -> RepetitionRerun:
    try:
        with _pool(1, plugins) as process:
            return process.submit(rerun, recorded).result()
    except BrokenProcessPool:
        return result_of(recorded, "not computed", 0, "its process died: it was killed, or ran out of memory")


def _pool(cores: int | None, plugins: Mapping[str, str]) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(cores, get_context("spawn"), folders.use, (plugins,))


def _recorded(session: Session, checked: CheckedArchive, part: Part) -> Iterator[Recorded]:
    until = inf if part.minutes is None else time() + 60.0 * part.minutes
    rows = experiments.meant(session, list(checked.experiments))
    chosen = [(row, part.repetitions(row, experiments.repetitions_of(session, row.id))) for row in rows]
    if not any(repetitions for _, repetitions in chosen):
        names = ", ".join(row.name for row in rows)
        raise NotFound(f"the archive has no repetition {part.repetition} of {part.experiment or 'any'}; it has {names}")
    for row, repetitions in chosen:
        found = logs.logs(session, [each.id for each in repetitions])
        files = robot_library.needed_by(row.spec)
        for each in repetitions:
            yield Recorded(row.id, row.name, each.number, row.spec, found[each.id], files, until)


def _other_versions(session: Session, checked: CheckedArchive) -> tuple[str, ...]:
    """Return the software and machines of the archive that differ from those here, each with both."""
    here = provenance_here()
    uses = [use for id in checked.experiments for use in provenance.uses(session, id)]
    if not uses:
        return (NOT_RECORDED,)
    return tuple(dict.fromkeys(text for use in uses for text in _differing(use.provenance, here)))


def _differing(stored: Provenance, here: Provenance) -> Iterator[str]:
    before = {name: getattr(stored, name) for name in SOFTWARE} | stored.libraries | stored.engines | stored.outside
    now = {name: getattr(here, name) for name in SOFTWARE} | here.libraries | here.engines | here.outside
    for name in before | here.libraries:
        if (there := before.get(name, "none")) != (found := now.get(name, "none")):
            yield f"{name}: {there} in the archive, {found} here"
