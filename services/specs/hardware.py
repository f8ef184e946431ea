"""Hardware: whether the reality of a spec may move something, and the name of what it moves."""

from hashlib import sha256

from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.engines import engines


def is_computed(spec: ResolvedSpec) -> bool:
    """Return whether reality is only computed, so that asking it moves nothing."""
    return spec.reality.engine is not None and hardware_of(spec) is None


def hardware_of(spec: ResolvedSpec) -> str | None:
    """Return the name of the hardware that is reality, or None if reality is only computed, or on a bench.

    Equal engines with equal options are the same hardware. An engine that also runs the simulators is computed.
    """
    ref = spec.reality.engine
    if ref is None or ref.name == spec.engine.name or ref.name not in engines or engines[ref.name].repeatable:
        return None
    return f"{ref.name[:20]}-{sha256(ref.model_dump_json().encode()).hexdigest()[:10]}"
