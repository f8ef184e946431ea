"""The size of the demo's study with physics: what this machine computes while a person waits."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from gaplab.schemas.estimates import EstimateRead

SECONDS = 100.0
"""Time for the study."""

CHECK_ROLLOUTS = 800
"""Rollouts of the sensitivity check, which an estimate does not count."""

SIZES = (
    (3, 3, 1.0),
    (3, 3, 0.8),
    (3, 3, 0.6),
    (2, 3, 0.8),
    (2, 3, 0.6),
    (2, 3, 0.4),
    (2, 2, 0.6),
    (2, 2, 0.4),
    (2, 2, 0.2),
)
"""Repetitions, iterations and the fraction of each search's evaluations, from large to small."""

POPULATION = 20
"""Evaluations of the population that a search starts with."""

SEARCHES = ("controller_evaluations", "selection_evaluations", "simulator_evaluations")

Spec = Mapping[str, Any]


def trial(spec: Spec) -> dict[str, Any]:
    """Return the spec of a small experiment, from which the service learns the duration of a rollout."""
    same = {name: spec[name] for name in ("robot", "engine", "reality", "seed") if name in spec}
    size = {"strategy": "direct", "repetitions": 2, "budget": {"preset": "smoke", "controller_evaluations": 100}}
    return same | size | {"name": "how long a rollout takes here"}


def sized(spec: Spec, estimate: Callable[[Spec], EstimateRead]) -> tuple[dict[str, Any], str]:
    """Return the largest version of the study that is estimated to fit into the time, or the smallest version.

    It has every number, so it gives the same curves on any machine. The text has the machine's pace, and the duration.
    """
    for smaller in _versions(spec):
        found = estimate(smaller)
        rollout_s = max(cost.seconds_per_rollout for cost in found.engines)
        expected_s = found.seconds + CHECK_ROLLOUTS * rollout_s / found.cores
        if expected_s <= SECONDS:
            break
    pace = f"{rollout_s * 1000:.0f} ms a rollout"
    named = smaller | {"name": f"{spec['name']}, sized for {pace}"}
    return named, f"{pace} on {found.cores} cores: about {expected_s:.0f} s"


def _versions(spec: Spec) -> Iterator[dict[str, Any]]:
    for repetitions, iterations, part in SIZES:
        budget = {name: _part(number, part) if name in SEARCHES else number for name, number in spec["budget"].items()}
        counts = {"repetitions": repetitions, "direct_repetitions": 2 * repetitions, "iterations": iterations}
        yield dict(spec) | counts | {"budget": budget}


def _part(evaluations: int, part: float) -> int:
    return max(POPULATION, round(part * evaluations))
