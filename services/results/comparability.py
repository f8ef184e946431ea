"""Comparability: what differs between experiments besides the strategy, so that their fitness says little of it."""

from collections.abc import Iterator, Set

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.robot_library import label_of
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.store.models import ExperimentRow


def warnings(first: ExperimentRow, second: ExperimentRow, hidden: Set[str]) -> Iterator[str]:
    """Yield why two experiments should not be compared: other robots, other tasks, or other realities.

    Args:
        first: an experiment.
        second: another one.
        hidden: ids of the experiments whose parameters of reality may not be shown yet.
    """
    one, other = spec_of(first.spec), spec_of(second.spec)
    if one.robot != other.robot:
        robots = _both(label_of(one.robot), label_of(other.robot))
        yield f"different robots{robots}: their fitness does not mean the same"
    elif one.task != other.task:
        tasks = _both(one.task.name if one.task else "its own", other.task.name if other.task else "its own")
        yield f"different tasks{tasks}: their fitness does not mean the same"
    if first.study_id is not None and first.study_id == second.study_id:
        return
    if _setup(one) == _setup(other) and not hidden.isdisjoint((first.id, second.id)):
        yield "realities are hidden until the experiments have ended, so they may be different"
    elif _reality(one) != _reality(other):
        yield "different realities: a difference may come from the reality, not from the strategy"


def _both(first: str, second: str) -> str:
    return f" ({first}; {second})" if first != second else ""


def _setup(spec: ResolvedSpec) -> tuple[object, ...]:
    return spec.reality.kind, spec.reality.engine, spec.reality.bench, sorted(spec.reality.parameters)


def _reality(spec: ResolvedSpec) -> tuple[object, ...]:
    return *_setup(spec), sorted(spec.reality.parameters.items())
