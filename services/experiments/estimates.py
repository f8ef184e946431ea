"""Estimates: the cost of a spec that is checked and resolved as if submitted, and not stored."""

from collections import defaultdict
from collections.abc import Mapping, Sequence

from gaplab.schemas.estimates import EngineCost, EstimateRead, ExperimentCost
from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.core.errors import Violation
from gaplab.services.engines import engines
from gaplab.services.experiments.limits import Admission, CostUnconfirmed, check_extent
from gaplab.services.experiments.stored_files import resolved_here
from gaplab.services.settings import Limits, variable_of
from gaplab.services.specs.resolution import expected_rollouts, is_direct, resolve, takes_samples
from gaplab.services.specs.stored_specs import spec_of
from gaplab.services.store.queries import costs
from gaplab.services.store.session import Session, Store

LATEST = 100
"""Number of the newest experiments whose times estimate a rollout."""

SILENT_S = 60.0
"""Age of the last heartbeat after which a supervisor does not count as working."""

SLOWEST_ROLLOUT_S = 60.0
"""Upper bound of a usual rollout: a submission below the limit at this pace needs no look at earlier experiments."""

Key = tuple[str, str]
"""Robot and engine, with their options."""


def estimate(
    store: Store, spec: StudySpec | ExperimentSpec, *, limits: Limits | None = None, cores: int = 1
) -> EstimateRead:
    """Return the cost of a study, or of one experiment, on a number of cores.

    Raises:
        InvalidSpec: the spec is invalid; the error has every violation, as on submission.
    """
    resolved = resolved_here(store, spec, resolve)
    check_extent(resolved, limits)
    with store.reading() as session:
        measured = _measured(costs.latest(session, LATEST))
        working = sum(age < SILENT_S for age in costs.ages(session))
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


def check_cost(
    session: Session, specs: Sequence[ResolvedSpec], admitted: Admission, *, rollouts: int, done: int
) -> None:
    """Refuse a cost above the limit, unless the request confirms it; `done` of its rollouts are completed.

    Raises:
        CostUnconfirmed: the message has the cost and the limit.
    """
    if admitted.limits is None or admitted.cost_known:
        return
    limit = admitted.limits.unconfirmed_core_hours
    if (rollouts - done) * SLOWEST_ROLLOUT_S <= limit * 3_600:
        return
    measured = _measured(costs.latest(session, LATEST))
    seconds = sum(_experiment(each, _cost(each, measured)).core_seconds for each in specs)
    if (hours := seconds / 3_600 * (1 - done / rollouts)) > limit:
        above = f"more than {limit:,} ({variable_of('unconfirmed_core_hours')}) must be confirmed"
        message = f"this takes about {hours:,.0f} core-hours; {above}: confirm_cost=true, --yes, or yes=True in Python"
        raise CostUnconfirmed([Violation("confirm_cost", False, message, "true")])


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
    return (spec.reality.engine or spec.engine) if is_direct(spec) else spec.engine


def _cost(spec: ResolvedSpec, measured: Mapping[Key, float]) -> EngineCost:
    engine = _engine(spec)
    known = measured.get(_key(spec))
    usual = engines[engine.name].usual_rollout_s
    return EngineCost(engine=engine.name, seconds_per_rollout=known or usual, measured=known is not None)


def _runs(spec: ResolvedSpec) -> int:
    """Return the runs of the physical robot in one repetition; 0 if reality is simulated."""
    reality, samples = spec.reality, spec.iterations if takes_samples(spec) else 0
    probes = {"each": samples + 1, "last": 1, "never": 0}[reality.probes]
    return (samples + probes) * reality.repeats if reality.kind == "physical" else 0


def _experiment(spec: ResolvedSpec, cost: EngineCost) -> ExperimentCost:
    rollouts = expected_rollouts(spec) * spec.repetitions
    return ExperimentCost(
        name=spec.name,
        strategy=spec.strategy.name,
        engine=cost.engine,
        repetitions=spec.repetitions,
        iterations=spec.iterations if takes_samples(spec) else 0,
        rollouts=rollouts,
        runs=_runs(spec) * spec.repetitions,
        core_seconds=rollouts * cost.seconds_per_rollout,
    )
