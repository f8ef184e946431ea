"""The claims that compare fitness with direct: C1, C2, C4b, C4c and C8c."""

from collections.abc import Mapping, Sequence

import numpy as np

from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.evidence import NO_TEST, Evidence, Examined
from benchmarks.reproduction.studies import Study
from gaplab.services.core.arrays import FloatArray
from gaplab.services.core.statistics import finite
from gaplab.services.figures.words import number_of, spoken

NO_DIRECT = "direct baseline"
NEARLY_TUNED = 4
"""Samples after which the paper's simulators are nearly perfect: "after about 3 or 4 iterations"."""

BEST = paper.SIMULATED_FIT[2]
"""The strategy that needs a single sample in the paper."""


def starts_at_two_thirds(study: Study) -> Examined:
    """Return the evidence that controllers of random simulators have `paper.START` of direct (C1)."""
    lacking = tuple(spoken(name).lower() for name in paper.STRATEGIES if not study.arm(name))
    starts = {name: own for name in study.present if len(own := study.values(name, 0, 0))}
    if not len(study.direct) or not starts:
        return Examined("", "", (), lacking if len(study.direct) else (NO_DIRECT,))
    together = np.concatenate(list(starts.values()))
    tested = statements.near(together, study.direct, paper.START, paper.START_MARGIN)
    ratios = [own.mean() / study.unit for own in starts.values()]
    here = f"{tested.estimate} of direct; strategies {min(ratios):.2f} to {max(ratios):.2f}"
    return Examined(here, NO_TEST, (Evidence(f"all together near {paper.START:.2f}", tested),))


def three_samples_reach_direct(study: Study) -> Examined:
    """Return the evidence that strategies with simulated fit reach direct after three samples, and pass it (C2a)."""
    levels = {3: paper.LEAST_AFTER_THREE, paper.ITERATIONS: paper.LEAST_AFTER_TEN}
    return _reached(study, paper.SIMULATED_FIT, levels)


def four_samples_tune_simulators(study: Study) -> Examined:
    """Return the evidence that their transferred controllers alone reach direct after four samples (C2b)."""
    return _reached(study, paper.SIMULATED_FIT, {NEARLY_TUNED: paper.LEAST_AFTER_THREE}, transferred_only=True)


def one_sample_is_enough(study: Study) -> Examined:
    """Return the evidence that one sample of simulated fit and informative almost reaches direct (C4b)."""
    return _reached(study, [BEST], {1: paper.LEAST_AFTER_THREE})


def one_sample_tunes_the_simulator(study: Study) -> Examined:
    """Return the evidence that the controller transferred after it almost reaches direct by itself (C4c)."""
    return _reached(study, [BEST], {1: paper.LEAST_AFTER_THREE}, transferred_only=True)


def all_end_near_direct(study: Study) -> Examined:
    """Return the evidence that all strategies end near direct (C8c)."""
    return _reached(study, paper.STRATEGIES, {paper.ITERATIONS: paper.LEAST_AFTER_THREE})


def _reached(
    study: Study, names: Sequence[str], levels: Mapping[int, float], *, transferred_only: bool = False
) -> Examined:
    """Return the evidence that strategies are above a share of direct after each number of samples.

    Args:
        study: the study.
        names: of the strategies.
        levels: the shares, by number of samples.
        transferred_only: whether the fitness is that of the transferred controller, in place of the recorded one.
    """
    present = [name for name in names if study.arm(name)]
    counts = [count for count in levels if count <= study.last]
    lacking = [NO_DIRECT] if not len(study.direct) else []
    lacking += [spoken(name).lower() for name in names if name not in present]
    if present:
        beyond = [number_of("sample", count) for count in levels if count not in counts]
        lacking += [f"value after {each}: it ends after {study.last}" for each in beyond]
    if not len(study.direct) or not present or not counts:
        return Examined("", "", (), tuple(lacking))
    verb = " transfers" if transferred_only else ""
    values = {
        (name, count): _values(study, name, count, transferred_only=transferred_only)
        for count in counts
        for name in present
    }
    evidence = (
        Evidence(
            f"{spoken(name)}{verb} above {levels[count]:.2f} after {count}",
            statements.reaches(each, study.direct, levels[count]),
        )
        for (name, count), each in values.items()
    )
    here = (
        f"{spoken(name)} {', '.join(_ratio(values[name, count], study.unit, count) for count in counts)}"
        for name in present
    )
    return Examined("; ".join(here), NO_TEST, tuple(evidence), tuple(lacking))


def _values(study: Study, name: str, count: int, *, transferred_only: bool) -> FloatArray:
    arm = study.arm(name)
    return finite(arm.transferred[:, count]) if transferred_only and arm else study.values(name, count, count)


def _ratio(values: FloatArray, unit: float, count: int) -> str:
    return f"{values.mean() / unit:.2f} after {count}" if len(values) else f"nothing after {count}"
