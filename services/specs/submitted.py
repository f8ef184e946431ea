"""Specs to submit again: as they were submitted, with the names and sizes that studies have now."""

from collections.abc import Mapping, Sequence
from typing import Any

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, Schedule, SpecRead, StudySpec
from gaplab.services.core.errors import GaplabError
from gaplab.services.specs.resolution import is_direct, resolve, takes_samples
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.world.robot_library import IMPORTED

Spec = dict[str, Any]

COMPLETE = "what was submitted is not known, or gives something else here; this spec names every field"
EXTENDED = "experiments were extended since; the spec has the iterations and repetitions that all have"
APART = "the experiments differ in more than their strategies, or a plug-in is missing; submit them one by one"
UNUSABLE = "it cannot be submitted here: a plug-in is missing"

_UNKEPT = {"name", *Schedule.model_fields}
"""What may change after submission, and changes no number."""


def kept(spec: ExperimentSpec | StudySpec, resolved: ResolvedSpec) -> Spec:
    """Return a spec as it is kept: what was sent, and by name what another machine or day would choose otherwise.

    That is the engine, the strategies, and the file that the name of a robot means. `resolved` is the spec of the first
    experiment.
    """
    sent = spec.model_dump(mode="json", exclude_unset=True, exclude=_UNKEPT)
    if isinstance(spec, StudySpec):
        sent["strategies"] = [each.model_dump(mode="json", exclude_unset=True) for each in spec.strategies]
    if resolved.robot.name == IMPORTED:
        sent["robot"] = resolved.robot.model_dump(mode="json")
    if resolved.reality.pool is not None:
        sent["reality"] = sent["reality"] | {"pool": resolved.reality.pool.model_dump(mode="json")}
    short: Spec = _bare(sent | {"engine": sent.get("engine") or resolved.engine.name})
    return short


def without_parameters(given: Spec) -> Spec:
    """Return a kept spec without reality's parameters."""
    reality = {name: value for name, value in given.get("reality", {}).items() if name != "parameters"}
    others = {name: value for name, value in given.items() if name != "reality"}
    return others | ({"reality": reality} if reality else {})


def part_of(given: Spec, positions: Sequence[int], *, alone: bool) -> Spec:
    """Return what a kept spec says about the experiments at some positions; about one `alone`, as an experiment's."""
    if "strategy" in given:
        return given
    chosen = [each for place, each in enumerate(given["strategies"]) if place in positions]
    shared = {name: value for name, value in given.items() if name != "strategies"}
    if not (alone and chosen):
        return {"strategies": chosen, **shared}
    return {"strategy": chosen[0], **{name: value for name, value in shared.items() if name != "direct_repetitions"}}


def to_submit_again(name: str, given: Spec | None, stored: Sequence[Mapping[str, Any]]) -> SpecRead:
    """Return the spec that gives experiments again: the kept one if it does, else a complete one.

    Null parameters of reality are left out. Experiments that were extended count with the size that all have.

    Args:
        name: present name of the study, or of the only experiment.
        given: kept spec of these experiments; None if it is not known.
        stored: resolved specs of these experiments, in the order of their strategies.
    """
    specs, remarks, complete = [spec_of(each) for each in stored], _hidden(stored), _complete(stored)
    for spec, why in ((given, ()), (complete, (COMPLETE,))):
        if spec is not None and (found := _sized(spec, specs, hidden=bool(remarks))):
            again, gives = found
            grown = (EXTENDED,) if list(map(_size_of, gives)) != list(map(_size_of, specs)) else ()
            usual = gives[0].name if len(gives) == 1 else "study"
            named = ({"name": name} if name != usual else {}) | again
            return SpecRead(spec=named, resolved=tuple(map(dict, stored)), remarks=(*remarks, *why, *grown))
    only = {"name": name, **complete} if len(specs) == 1 else None
    return SpecRead(spec=only, resolved=tuple(map(dict, stored)), remarks=(*remarks, UNUSABLE if only else APART))


def _bare(value: Any) -> Any:  # noqa: ANN401 - JSON
    """Return a spec in which a bare name stands for an object that has nothing else."""
    if isinstance(value, list):
        return [_bare(each) for each in value]
    if not isinstance(value, dict):
        return value
    if set(value) in ({"name"}, {"preset"}):
        return next(iter(value.values()))
    return {name: each if name in {"options", "parameters"} else _bare(each) for name, each in value.items()}


def _complete(stored: Sequence[Mapping[str, Any]]) -> Spec:
    """Return a spec with every field, of which the first experiment has those that all share."""
    first, *others = (spec_of(each).model_dump(mode="json", exclude=_UNKEPT) for each in stored)
    strategies = [each.pop("strategy") for each in (first, *others)]
    return first | ({"strategies": strategies} if others else {"strategy": strategies[0]})


def _sized(spec: Spec, specs: Sequence[ResolvedSpec], *, hidden: bool) -> tuple[Spec, tuple[ResolvedSpec, ...]] | None:
    """Return the spec with the size that all experiments have, and what it gives; None if it gives other numbers."""
    apart: dict[str, Any] = dict.fromkeys({*_UNKEPT, "iterations", "repetitions"}, True)
    apart |= {"reality": {"parameters"}} if hidden else {}
    try:
        found = resolve(_validated(spec))
        for name, count in _common_size(specs).items():
            if _common_size(found)[name] != count:
                spec = spec | {name: count}
                found = resolve(_validated(spec))
    except (GaplabError, ValueError):
        return None
    gives = [each.model_dump(exclude=apart) for each in found]
    return (spec, found) if gives == [each.model_dump(exclude=apart) for each in specs] else None


def _validated(spec: Spec) -> ExperimentSpec | StudySpec:
    return (ExperimentSpec if "strategy" in spec else StudySpec).model_validate(spec)


def _common_size(specs: Sequence[ResolvedSpec]) -> dict[str, int]:
    sampling, others = list(filter(takes_samples, specs)), [spec for spec in specs if not is_direct(spec)]
    repetitions = min(spec.repetitions for spec in others or specs)
    return {
        "iterations": min(spec.iterations for spec in sampling or specs),
        "repetitions": repetitions,
        "direct_repetitions": min((spec.repetitions for spec in specs if is_direct(spec)), default=repetitions),
    }


def _size_of(spec: ResolvedSpec) -> tuple[int, int]:
    return spec.iterations if takes_samples(spec) else 0, spec.repetitions


def _hidden(stored: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """Return a remark about parameters of reality that may not be shown yet."""
    names = sorted({name for spec in stored for name, value in spec["reality"]["parameters"].items() if value is None})
    if not names:
        return ()
    return (f"reality's {', '.join(names)} are hidden until the experiments have ended; the spec leaves them out",)
