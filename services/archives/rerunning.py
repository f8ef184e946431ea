"""Recomputation of an archive without a service: each repetition from its beginning, compared with its stored steps."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from multiprocessing import get_context
from typing import IO, Any

from gaplab.schemas.provenance import Provenance
from gaplab.schemas.reruns import Outcome, RepetitionRerun, RerunRead
from gaplab.services.archives.reading import CheckedArchive, checked_archive
from gaplab.services.archives.step_differences import difference
from gaplab.services.core import robot_library
from gaplab.services.core.errors import Conflict
from gaplab.services.core.loop import repetition
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.core.types import Step
from gaplab.services.engines import engines
from gaplab.services.plugins import folders
from gaplab.services.running import provenance
from gaplab.services.running.versions import provenance as provenance_here
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.shortening import experiment_spec, study_spec
from gaplab.services.store.queries import experiments, logs
from gaplab.services.store.session import Session

SOFTWARE = ("gaplab", "code", "python", "architecture", "processor", "system", "spec_version")
NOT_RECORDED = "the archive does not say which software and machine computed it"


@dataclass(frozen=True)
class Recorded:
    """A repetition as an archive has it.

    Attributes:
        experiment: id of its experiment.
        name: name of its experiment.
        number: number of the repetition, from 0.
        spec: stored spec of the experiment.
        log: steps of the repetition.
        robots: texts of the robot files that the spec needs, for a process that does not know them.
    """

    experiment: str
    name: str
    number: int
    spec: Mapping[str, Any]
    log: tuple[Step, ...]
    robots: tuple[str, ...] = ()


def submitted_spec(file: IO[bytes]) -> dict[str, Any]:
    """Return the spec in an archive, to submit it again.

    Raises:
        InvalidArchive: the file is damaged, or not an archive.
        Conflict: no single spec gives all experiments, or parameters of reality are hidden.
    """
    with checked_archive(file, datetime.now(UTC)) as checked, checked.store.reading() as session:
        specs = [row.spec for row in experiments.get_experiments(session, list(checked.experiments))]
        name = experiments.get_study(session, checked.study).name if checked.study else ""
    found = study_spec(name, specs) if checked.study else experiment_spec(specs[0])
    if found.spec is None:
        raise Conflict(f"no single spec gives the experiments of the archive: {'; '.join(found.remarks)}")
    if any(value is None for spec in specs for value in spec["reality"]["parameters"].values()):
        raise Conflict("the archive hides parameters of reality, so its spec cannot be submitted again")
    return found.spec


def verify(
    file: IO[bytes],
    *,
    most: int | None = None,
    cores: int | None = None,
    computed: Callable[[RepetitionRerun], None] = lambda _: None,
) -> RerunRead:
    """Recompute the repetitions of an archive, and compare every number with the stored one, to the last bit.

    Args:
        file: the archive, seekable, at its beginning.
        most: repetitions of each experiment to recompute, from number 0; left out: all.
        cores: processes that compute; left out: one for each core.
        computed: is called with each result, in the order of the archive.

    Raises:
        InvalidArchive: the file is damaged, or not an archive.
    """
    with checked_archive(file, datetime.now(UTC)) as checked, checked.store.reading() as session:
        recorded = list(_recorded(session, checked, most))
        versions = _other_versions(session, checked)
    results: list[RepetitionRerun] = []
    for result in rerun_all(recorded, cores or os.cpu_count()):
        results.append(result)
        computed(result)
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
    """
    left = deque(recorded)
    while left:
        with _pool(cores) as processes, suppress(BrokenProcessPool):
            for result in processes.map(rerun, tuple(left)):
                left.popleft()
                yield result
        if left:
            yield _rerun_alone(left.popleft())


def _rerun_alone(recorded: Recorded) -> RepetitionRerun:
    try:
        with _pool(1) as process:
            return process.submit(rerun, recorded).result()
    except BrokenProcessPool:
        return _result(recorded, "not computed", 0, "its process died: it was killed, or ran out of memory")


def _pool(cores: int | None) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(cores, get_context("spawn"), folders.load)


def rerun(recorded: Recorded) -> RepetitionRerun:
    """Recompute a repetition, and compare it step by step until one differs.

    Any error is the reason why the repetition is not computed, and ends no other one.
    """
    same, reason = 0, None
    outcome: Outcome = "same"
    try:
        if (reason := _obstacle(recorded)) is not None:
            outcome = "not computed"
        else:
            for stored, step in zip(recorded.log, _computed(recorded), strict=False):
                if (found := difference(stored, step)) is not None:
                    kind = type(stored).__name__.lower()
                    outcome, reason = "different", f"step {same + 1} ({kind}, iteration {stored.iteration}): {found}"
                    break
                same += 1
            else:
                if same < len(recorded.log):
                    outcome, reason = "different", f"it ends here after {same} steps"
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
        outcome, reason = "not computed", f"{type(error).__name__}: {error}"
    return _result(recorded, outcome, same, reason)


def _result(recorded: Recorded, outcome: Outcome, steps: int, reason: str | None) -> RepetitionRerun:
    return RepetitionRerun(
        experiment=recorded.experiment,
        name=recorded.name,
        repetition=recorded.number,
        outcome=outcome,
        steps=steps,
        stored_steps=len(recorded.log),
        reason=reason,
    )


def _computed(recorded: Recorded) -> Iterator[Step]:
    robot_library.learn(recorded.robots)
    return repetition(setting(spec_of(recorded.spec), recorded.number))


def _obstacle(recorded: Recorded) -> str | None:
    """Return why a repetition cannot be computed here; None if it can."""
    reality = recorded.spec["reality"]
    if reality["kind"] == "physical":
        return "reality is a robot on a bench, and a measurement cannot be repeated"
    if any(value is None for value in reality["parameters"].values()):
        return "the archive hides parameters of reality"
    for name in {recorded.spec["engine"]["name"], reality["engine"]["name"]}:
        if name not in engines:
            return f"the engine {name!r} is not installed here"
        if not engines[name].available():
            return f"the engine {name!r} is not installed here: {engines[name].install}"
        if not engines[name].repeatable:
            return f"the engine {name!r} measures a robot, and a measurement cannot be repeated"
    return None


def _recorded(session: Session, checked: CheckedArchive, most: int | None) -> Iterator[Recorded]:
    for row in experiments.get_experiments(session, list(checked.experiments)):
        repetitions = experiments.repetitions_of(session, row.id)[:most]
        found = logs.logs(session, [each.id for each in repetitions])
        files = robot_library.needed_by(spec_of(row.spec).robot)
        for each in repetitions:
            yield Recorded(row.id, row.name, each.number, row.spec, found[each.id], files)


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
