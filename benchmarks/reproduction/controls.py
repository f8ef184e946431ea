"""Controls: what a single change of a study's spec does to the recorded fitness of its strategies."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from benchmarks.lean_ratios import ratio_difference
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.differences import Values
from gaplab.services.core.comparisons import compare_all
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING, probability
from gaplab.services.specs.differences import SpecColumn, differences

COUNTS = (1, 2, 3, 5, 10)

SIZES = {"/iterations", "/repetitions"}
"""Settings that say how much of a study is there."""

HEAD = ("strategy", "samples", "study", "control's", "difference", "test", "p")


def compared_with(control: Study, studies: Mapping[str, Study]) -> str:
    """Return the label of the first study of the same robot, engines and seed.

    Raises:
        SystemExit: there is none.
    """
    for label, study in studies.items():
        if _world(study.arms[0]) == _world(control.arms[0]):
            return label
    raise SystemExit(f"{control.archives[0]}: no study has its robot, engines and seed")


def rows(control: Study, study: Study) -> Iterator[tuple[str, ...]]:
    """Yield the difference of a control from a study, for each strategy of both and each number of samples.

    Fitness is over the direct baseline of its own study; over that of the other one if the control has none. Its
    repetitions share the random numbers of the study's, so they are paired. Where there are two baselines, the
    difference has the errors of both.

    Args:
        control: has strategies of the study with other settings.
        study: the study.
    """
    for own, arm in _both(control, study):
        for count in [0] if arm.read.direct else COUNTS:
            row = _by_pairs if arm.read.direct or not len(control.direct) else _by_ratios
            if told := row((study, own), (control, arm), count):
                yield spoken(arm.strategy), str(count), *told


def change(control: Study, study: Study) -> str:
    """Return the settings in which the experiments of a control differ from those of a study."""
    return "; ".join(dict.fromkeys(each for own, arm in _both(control, study) for each in what_differs(own, arm)))


def _both(control: Study, study: Study) -> Iterator[tuple[Arm, Arm]]:
    """Yield the experiments of each strategy that both have: the study's and the control's."""
    for arm in control.arms:
        if (own := study.arm(arm.strategy)) is not None:
            yield own, arm


def what_differs(own: Arm, other: Arm) -> list[str]:
    """Return the settings in which two experiments differ, without their sizes."""
    columns = [SpecColumn(arm.read.id, arm.read.name, (arm.read.spec,)) for arm in (own, other)]
    return [
        f"{each.setting}: {_told(each.values[1])}, not {_told(each.values[0])}"
        for each in differences(columns).settings
        if each.pointer not in SIZES
    ]


def _told(values: Values) -> str:
    return ", ".join("none" if value is None else str(value) for value in values) or MISSING


def _world(arm: Arm) -> tuple[object, ...]:
    reality = arm.spec.reality.engine
    return arm.spec.robot, arm.spec.engine.name, reality and reality.name, arm.spec.seed


Side: TypeAlias = tuple[Study, Arm]
"""An experiment in its study."""


def _by_pairs(side: Side, other: Side, count: int) -> tuple[str, ...] | None:
    """Return both means, their difference and the trusted test; None without values.

    Fitness is over the direct baseline of the first study; that of direct itself is as it is.
    """
    unit = 1.0 if side[1].read.direct else side[0].unit
    compared = [replace(own := arm.compared(), recorded=own.recorded / unit) for _, arm in (other, side)]
    (pair,) = compare_all(compared, count, count, intervals=False)
    if pair.difference is None:
        return None
    means = (f"{each.mean.value:.2f} ({each.n})" for each in (pair.summary_second, pair.summary_first))
    told = _interval(pair.difference, pair.lower, pair.upper)
    return *means, told, pair.trusted.test.replace("_", " "), probability(pair.trusted.p)


def _by_ratios(side: Side, other: Side, count: int) -> tuple[str, ...] | None:
    """Return both means over their own baselines, their difference with the errors of both, and its test."""
    if any(count >= arm.recorded.shape[1] for _, arm in (side, other)):
        return None
    first, second = (arm.recorded[:, count] / study.unit for study, arm in (other, side))
    found = ratio_difference(first, second, [study.direct for study, _ in (other, side)])
    if found is None:
        return None
    means = (f"{np.nanmean(each):.2f} ({np.isfinite(each).sum()})" for each in (second, first))
    told = _interval(found.value, found.value - found.half, found.value + found.half)
    return *means, told, "z", probability(found.p_of_none)


def _interval(difference: float, lower: float | None, upper: float | None) -> str:
    span = "" if lower is None or upper is None else f" ({lower:+.3f} to {upper:+.3f})"
    return f"{difference:+.3f}{span}".replace("-", "\N{MINUS SIGN}")
