"""Estimates: the cost of a study or an experiment that is checked and resolved as if submitted, and not stored."""

from collections import defaultdict
from collections.abc import Mapping

from gaplab.schemas.estimates import EngineCost, EstimateRead, ExperimentCost
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.engines import engines
from gaplab.services.experiments.limits import check_extent
from gaplab.services.experiments.stored_robots import resolved_here
from gaplab.services.settings import Limits
from gaplab.services.specs.resolution import is_direct, resolve_experiment, resolve_study, takes_samples
from gaplab.services.specs.rollouts import expected_rollouts
from gaplab.services.store.queries import costs, supervisors
from gaplab.services.store.session import Store

LATEST = 100
"""Number of the newest experiments whose times estimate a rollout."""

SILENT_S = 60.0
"""Age of the last heartbeat after which a supervisor does not count as working."""

Key = tuple[str, str]
"""Robot and engine, with their options."""


def estimate(
    store: Store, spec: StudySpec | ExperimentSpec, *, limits: Limits | None = None, cores: int = 1
) -> EstimateRead:
    """Return the cost of the study or the experiment on a number of cores.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation, as on submission.
        StoreUnavailable: the database cannot be used now.
    """
    resolved = resolved_here(store, spec, _resolve)
    check_extent(resolved, limits)
    with store.reading() as session:
        measured = _measured(costs.latest(session, LATEST))
        working = sum(age < SILENT_S for age in supervisors.ages(session))
    found = tuple(_experiment(each, _cost(each, measured)) for each in resolved)
    total = sum(each.core_seconds for each in found)
    shared = min(cores, len(resolved) * (spec.max_parallel or cores))
    return EstimateRead(
        experiments=found,
        engines=tuple({cost.engine: cost for cost in (_cost(each, measured) for each in resolved)}.values()),
        rollouts=sum(each.rollouts for each in found),
        core_seconds=total,
        cores=shared,
        seconds=total / shared,
        supervisors=working,
        specs=tuple(each.model_dump(mode="json") for each in resolved),
    )


def _resolve(spec: StudySpec | ExperimentSpec) -> tuple[ResolvedSpec, ...]:
    return resolve_study(spec) if isinstance(spec, StudySpec) else (resolve_experiment(spec),)


def _measured(found: tuple[tuple[dict[str, object], float, int], ...]) -> dict[Key, float]:
    """Return the seconds of a rollout by robot and simulators' engine, which computes nearly all rollouts."""
    seconds: dict[Key, float] = defaultdict(float)
    rollouts: dict[Key, int] = defaultdict(int)
    for stored, took, count in found:
        key = _key(spec_of(stored))
        seconds[key] += took
        rollouts[key] += count
    return {key: seconds[key] / count for key, count in rollouts.items() if count and seconds[key]}


def _key(spec: ResolvedSpec) -> Key:
    return spec.model_dump_json(include={"robot", "controller", "task"}), _engine(spec).model_dump_json()


def _engine(spec: ResolvedSpec) -> PluginRef:
    """Return the engine that computes the experiment."""
    return (spec.reality.engine or spec.engine) if is_direct(spec) else spec.engine


def _cost(spec: ResolvedSpec, measured: Mapping[Key, float]) -> EngineCost:
    engine = _engine(spec)
    known = measured.get(_key(spec))
    usual = engines[engine.name].usual_rollout_s
    return EngineCost(engine=engine.name, seconds_per_rollout=known or usual, measured=known is not None)


def _experiment(spec: ResolvedSpec, cost: EngineCost) -> ExperimentCost:
    rollouts = expected_rollouts(spec) * spec.repetitions
    return ExperimentCost(
        name=spec.name,
        strategy=spec.strategy.name,
        engine=cost.engine,
        repetitions=spec.repetitions,
        iterations=spec.iterations if takes_samples(spec) else 0,
        rollouts=rollouts,
        core_seconds=rollouts * cost.seconds_per_rollout,
    )
