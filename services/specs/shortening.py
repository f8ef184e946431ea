"""Shortening: from stored, resolved specs back to a spec that a person would submit.

A short spec lacks every field whose default gives the same resolved spec, so that it gives the same numbers when it is
submitted again. It names the engine, since the default may depend on the machine.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, SpecRead, StudySpec
from gaplab.services.core.errors import GaplabError
from gaplab.services.specs.resolution import is_direct, resolve, resolve_experiment, takes_samples
from gaplab.services.specs.stored_specs import spec_of

Spec = dict[str, Any]
Stored = Mapping[str, Any]

KEPT = {"engine", "strategy"}
SCHEDULE = {"priority", "max_parallel"}
SAMPLES = ("reality", "samples")
ALONE = ("name", "preset")
"""Fields that may stand for an object that has nothing else."""


def shortest(name: str, stored: Sequence[Stored]) -> SpecRead:
    """Return the spec of a study from its name and the stored specs of its experiments.

    That of a single experiment names one strategy. Null parameters of reality are left out. Experiments that were
    extended count with the size that all have. The spec is None if the experiments differ in more than their
    strategies, or cannot be resolved here.
    """
    if len(stored) == 1:
        spec = _shortest(spec_of(stored[0]).model_copy(update={"name": name}))
        return SpecRead(spec=spec, resolved=(dict(stored[0]),), remarks=_hidden(stored))
    specs = [spec_of(each) for each in stored]
    size, wanted = _common_size(specs)
    base = max(wanted, key=lambda spec: (takes_samples(spec), not is_direct(spec)))
    strategies = [_shortest(spec, within="strategy")["strategy"] for spec in wanted]
    shared = {field: value for field, value in _shortest(base).items() if field not in {"name", "strategy"}}
    spec = ({"name": name} if name != "study" else {}) | {"strategies": strategies} | shared | size
    remarks, is_given = _hidden(stored), _gives(spec, wanted, hidden=bool(_hidden(stored)))
    if not is_given:
        remarks += (
            "the experiments differ in more than their strategies, or a plug-in is missing; submit them one by one",
        )
    elif specs != wanted:
        remarks += ("experiments were extended since; the spec has the iterations and repetitions that all have",)
    return SpecRead(spec=spec if is_given else None, resolved=tuple(map(dict, stored)), remarks=remarks)


def _common_size(specs: Sequence[ResolvedSpec]) -> tuple[Spec, list[ResolvedSpec]]:
    """Return the field for repetitions of the baseline, and the specs with the size that all have."""
    iterations = min(spec.iterations for spec in [spec for spec in specs if takes_samples(spec)] or specs)
    repetitions = min(spec.repetitions for spec in [spec for spec in specs if not is_direct(spec)] or specs)
    direct = min((spec.repetitions for spec in specs if is_direct(spec)), default=repetitions)
    counts = [direct if is_direct(spec) else repetitions for spec in specs]
    wanted = [
        spec.model_copy(update={"iterations": iterations, "repetitions": count})
        for spec, count in zip(specs, counts, strict=True)
    ]
    return ({"direct_repetitions": direct} if direct != repetitions else {}), wanted


def _gives(spec: Spec, wanted: Sequence[ResolvedSpec], *, hidden: bool) -> bool:
    """Return whether the spec of a study resolves to these experiments, apart from names and hidden parameters."""
    try:
        found = resolve(StudySpec.model_validate(spec))
    except (GaplabError, ValueError):
        return False
    left_out: dict[str, Any] = dict.fromkeys({"name", *SCHEDULE}, True)
    if hidden:
        left_out["reality"] = {"parameters"}
    return [each.model_dump(exclude=left_out) for each in found] == [
        each.model_dump(exclude=left_out) for each in wanted
    ]


def _shortest(spec: ResolvedSpec, within: str | None = None) -> Spec:
    """Return the spec without the fields whose absence changes nothing; complete if it cannot be resolved here.

    With `within`, that field alone is shortened.
    """
    complete = spec.model_dump(mode="json", exclude=SCHEDULE)
    target = _resolved(complete)
    if target is None:
        return complete

    def same(spec: Spec) -> bool:
        return _resolved(spec) == target

    short = _bare(_without_defaults(complete, same, within))
    return short if same(short) else complete


def _resolved(spec: Spec) -> ResolvedSpec | None:
    try:
        return resolve_experiment(ExperimentSpec.model_validate(spec))
    except (GaplabError, ValueError):
        return None


def _without_defaults(spec: Spec, same: Callable[[Spec], bool], within: str | None) -> Spec:
    """Return the spec without each field, outer ones first, whose absence gives the same.

    Of samples, which may be thousands, the fields that are null are left out together.
    """
    bare = _without_nulls(spec)
    spec = bare if same(bare) else spec
    for path in list(_paths(spec)):
        if within not in {None, path[0]} or (len(path) == 1 and path[0] in KEPT):
            continue
        smaller = _without(spec, path)
        spec = smaller if smaller is not None and same(smaller) else spec
    return spec


def _paths(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:  # noqa: ANN401 - JSON
    if path == SAMPLES:
        return
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        if isinstance(value, dict):
            yield (*path, key)
        yield from _paths(item, (*path, key))


def _without_nulls(spec: Spec) -> Spec:
    reality = spec["reality"]
    samples = [{name: item for name, item in each.items() if item is not None} for each in reality["samples"]]
    return {**spec, "reality": {**reality, "samples": samples}}


def _without(value: Any, path: Sequence[str | int]) -> Any:  # noqa: ANN401 - JSON
    (key, *rest), has = path, isinstance(value, list) or (isinstance(value, dict) and path[0] in value)
    if not has:
        return None
    if not rest:
        return {name: item for name, item in value.items() if name != key}
    inner = _without(value[key], rest)
    if inner is None:
        return None
    if isinstance(value, list):
        return [inner if index == key else item for index, item in enumerate(value)]
    return {**value, key: inner}


def _bare(value: Any) -> Any:  # noqa: ANN401 - JSON
    if isinstance(value, list):
        return [_bare(item) for item in value]
    if not isinstance(value, dict):
        return value
    short = {name: _bare(item) for name, item in value.items() if item != {}}
    return next((short[name] for name in ALONE if set(short) == {name} and set(value) <= {name, "options"}), short)


def _hidden(stored: Sequence[Stored]) -> tuple[str, ...]:
    """Return a remark about parameters of reality that may not be shown yet."""
    names = sorted({name for spec in stored for name, value in spec["reality"]["parameters"].items() if value is None})
    if not names:
        return ()
    return (f"reality's {', '.join(names)} are hidden until the experiments have ended; the spec leaves them out",)
