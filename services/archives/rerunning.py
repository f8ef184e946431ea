"""Recomputation of an archive without a service: each repetition from its beginning, compared with its stored steps."""

import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from math import inf
from multiprocessing import get_context
from time import time
from typing import IO, Any

from gaplab.arithmetic import code_for_avx512, has
from gaplab.schemas.archives import RepetitionRerun, RerunRead
from gaplab.schemas.provenance import Provenance
from gaplab.services.archives.reading import CheckedArchive, checked_archive
from gaplab.services.archives.recomputing import Recorded, rerun, result_of
from gaplab.services.core import robot_library
from gaplab.services.core.errors import Conflict, NotFound
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.plugins import folders
from gaplab.services.plugins.external import named_files
from gaplab.services.running import provenance
from gaplab.services.running.versions import provenance as provenance_here
from gaplab.services.specs.shortening import shortest
from gaplab.services.store.models import ExperimentRow, RepetitionRow
from gaplab.services.store.queries import experiments, logs
from gaplab.services.store.session import Session

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
    with checked_archive(file) as checked, checked.store.reading() as session:
        whole = experiments.members(session, checked.study)
        specs = [row.spec for row in whole.experiments]
        found = shortest(whole.study.name, specs)
    if found.spec is None:
        raise Conflict(f"no single spec gives the experiments of the archive: {'; '.join(found.remarks)}")
    if any(value is None for spec in specs for value in spec["reality"]["parameters"].values()):
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
    rows = experiments.get_experiments(session, list(checked.experiments))
    chosen = [(row, part.repetitions(row, experiments.repetitions_of(session, row.id))) for row in rows]
    if not any(repetitions for _, repetitions in chosen):
        names = ", ".join(row.name for row in rows)
        raise NotFound(f"the archive has no repetition {part.repetition} of {part.experiment or 'any'}; it has {names}")
    for row, repetitions in chosen:
        found = logs.logs(session, [each.id for each in repetitions])
        files = robot_library.needed_by(spec_of(row.spec).robot)
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
