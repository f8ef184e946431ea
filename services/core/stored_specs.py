"""Stored specs, which may be older than some options of their plug-ins."""

from collections.abc import Mapping
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.discrepancies import discrepancies
from gaplab.services.core.discrepancies.base import Discrepancy
from gaplab.services.core.discrepancies.squared_fitness import SquaredFitness
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.registry import Registry
from gaplab.services.core.strategies import strategies
from gaplab.services.core.tuners import tuners


def spec_of(stored: Mapping[str, Any]) -> ResolvedSpec:
    """Return a stored spec for reading, not for running: it may lack parameters of reality."""
    return _with_options_of_before(spec_as_stored(stored))


def spec_to_run(stored: Mapping[str, Any]) -> ResolvedSpec:
    """Return a stored spec for running.

    Raises:
        ValidationError: a parameter of reality is null.
    """
    return _with_options_of_before(ResolvedSpec.model_validate(stored))


def spec_as_stored(stored: Mapping[str, Any]) -> ResolvedSpec:
    """Return a stored spec without null parameters of reality, and without options that were added since."""
    reality = stored["reality"]
    known = {name: value for name, value in reality["parameters"].items() if value is not None}
    return ResolvedSpec.model_validate({**stored, "reality": {**reality, "parameters": known}})


def _with_options_of_before(spec: ResolvedSpec) -> ResolvedSpec:
    """Return the spec with the options that strategy and tuner got since it was stored: its numbers stay the same.

    A plug-in that is not installed, or refuses its options, stays as it is.
    """
    return spec.model_copy(
        update={"strategy": _as_before(strategies, spec.strategy), "tuner": _as_before(tuners, spec.tuner)}
    )


def _as_before(registry: Registry[Any], ref: PluginRef) -> PluginRef:
    before = registry[ref.name].before if ref.name in registry else {}
    try:
        _, complete = registry.check(PluginRef(name=ref.name, options={**before, **ref.options}))
    except InvalidSpec:
        return ref
    return PluginRef(name=ref.name, options=complete.model_dump(mode="json", by_alias=True))


def discrepancy_of(spec: Mapping[str, Any]) -> Discrepancy:
    """Return what the tuning of a stored spec minimises; of one that is not installed, the squared difference."""
    ref = PluginRef.model_validate(spec.get("discrepancy", SquaredFitness.name))
    try:
        return discrepancies.create(ref)
    except InvalidSpec:
        return SquaredFitness()
