"""What each system computes beside its rollouts: `python -m benchmarks.systems.computation`.

Printed is the processor time of one repetition of three iterations outside of its rollouts, as a share of these; that
of `direct`, whose strategy computes nothing, is what the search for a controller takes.
"""

from collections.abc import Callable
from dataclasses import replace
from time import process_time
from typing import ParamSpec, TypeVar

from benchmarks.systems.judging import Spec
from benchmarks.systems.rows import ROWS, study
from gaplab.schemas.spec import StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve

Given = ParamSpec("Given")
Found = TypeVar("Found")


class _Timed:
    """The processor time of calls of functions."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def __call__(self, work: Callable[Given, Found]) -> Callable[Given, Found]:
        def timed(*given: Given.args, **named: Given.kwargs) -> Found:
            begun = process_time()
            try:
                return work(*given, **named)
            finally:
                self.seconds += process_time() - begun

        return timed


def share(spec: Spec, place: int) -> float:
    """Return processor time outside of rollouts over that of rollouts, of one experiment of a study."""
    experiment = resolve(StudySpec.model_validate({"name": "computation", "seed": 2026} | spec))[place]
    found, rollouts = setting(experiment, 0), _Timed()
    found.reality(found.known)  # what a process does once, like compiling a motor's law, is not counted
    sense = found.sense and rollouts(found.sense)
    timed = replace(found, simulate=rollouts(found.simulate), sense=sense, reality=rollouts(found.reality))
    begun = process_time()
    for _ in repetition(timed):
        pass
    return (process_time() - begun) / rollouts.seconds - 1


def main() -> None:
    """Print the share of each row of the comparison."""
    for row in ROWS:
        place = [each for each in ROWS if each.settings == row.settings].index(row)
        print(f"{row.name}: {share(study('inside', row.settings) | {'iterations': 3}, place):.2%}", flush=True)


if __name__ == "__main__":
    main()
