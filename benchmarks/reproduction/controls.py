"""Controls: what a single change of a study's spec does to the recorded fitness of its strategies."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.reproduction.claims import significant
from benchmarks.reproduction.statistics import Difference
from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.differences import Values
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import spoken
from gaplab.services.findings.statistics import both, holm
from gaplab.services.findings.wording import MISSING, listed, probability
from gaplab.services.specs.differences import SpecColumn, differences

COUNTS = (0, 1, 2, 3, 5, 10)
SIZES = {"/iterations", "/repetitions"}
HEAD = ("strategy", "samples", "study", "control", "repetitions", "difference", "p")


class Row(NamedTuple):
    """What a control changes in one strategy after some samples, in the repetitions `(r,)` that both studies have."""

    strategy: str
    samples: int
    values: tuple[FloatArray, FloatArray]
    difference: Difference

    def cells(self) -> tuple[str, ...]:
        """Return the row in words."""
        means = (f"{each.mean():.2f}" for each in self.values)
        told = self.difference.told(), probability(self.difference.p)
        return self.strategy, str(self.samples), *means, str(len(self.values[0])), *told


def compared_with(control: Study, studies: Mapping[str, Study]) -> str:
    """Return the label of the study of the same robot, engine of simulators and seed that differs least.

    A whole figure comes before other studies. Else these differ in the fewest settings of a strategy, and share the
    most strategies. A control without direct is compared with a study of its own reality, if there is one.

    Raises:
        SystemExit: there is none that shares a strategy.
    """
    changes = {
        label: (
            not len(control.direct) and study.spec.reality != control.spec.reality,
            not study.whole,
            sum(len(_settings(own, arm)) for own, arm in pairs) / len(pairs),
            -len(pairs),
        )
        for label, study in studies.items()
        if study.archives != control.archives
        and all(getattr(study.spec, name) == getattr(control.spec, name) for name in ("robot", "seed"))
        and study.spec.engine.name == control.spec.engine.name
        and (pairs := _shared(control, study))
    }
    if not changes:
        raise SystemExit(f"{control.archives[0]}: no study has its robot, engine and seed, and one of its strategies")
    return min(changes, key=changes.__getitem__)


def rows(control: Study, study: Study) -> Iterator[Row]:
    """Yield the difference of a control from a study, for each strategy of both and each number of samples.

    Fitness is divided by the direct baseline of its own study, or by the study's if the control has none; direct's own
    is not divided. Repetitions with the same number share their random numbers, so they are paired. Where the change
    makes no difference in any repetition, there is no row.

    Raises:
        SystemExit: the control has another reality, and no direct baseline.
    """
    alone = not len(control.direct)
    if alone and study.spec.reality != control.spec.reality:
        raise SystemExit(f"{control.archives[0]}: it has another reality, so it needs a direct baseline of its own")
    for own, arm in _shared(control, study):
        units = (1.0, 1.0) if arm.read.direct else (study.unit, study.unit if alone else control.unit)
        for count in [0] if arm.read.direct else COUNTS:
            old, new = both(_column(own, count), _column(arm, count))
            if arm.read.direct or alone:
                found = Difference.paired(new / units[1], old / units[0])
            else:
                found = Difference.of_ratios((new, old), (control.direct, study.direct))
            if found is not None and (found.value or found.error):
                yield Row(spoken(arm.strategy), count, (old / units[0], new / units[1]), found)


def shown(found: Sequence[Row]) -> str:
    """Return which differences of a table are shown after Holm's correction over its rows; empty if none is."""
    counts: dict[str, list[str]] = {}
    for row, p in zip(found, holm([row.difference.p for row in found]), strict=True):
        if significant(p):
            counts.setdefault(row.strategy.lower(), []).append(str(row.samples))
    direct = spoken("direct").lower()
    return "; ".join(each if each == direct else f"{each} at {listed(counts[each])}" for each in counts)


def change(control: Study, study: Study) -> str:
    """Return the settings in which the experiments of a control differ from those of a study."""
    return "; ".join(dict.fromkeys(each for own, arm in _shared(control, study) for each in _settings(own, arm)))


def _shared(control: Study, study: Study) -> list[tuple[Arm, Arm]]:
    """Return the experiments of each strategy that both have: the study's and the control's."""
    return [(own, arm) for arm in control.arms if (own := study.arm(arm.strategy)) is not None]


def _settings(own: Arm, other: Arm) -> list[str]:
    """Return the settings in which two experiments differ, without their sizes."""
    columns = [SpecColumn(arm.read.id, arm.read.name, (arm.read.spec,)) for arm in (own, other)]
    found = (each for each in differences(columns).settings if each.pointer not in SIZES)
    return [f"{each.setting}: {_told(each.values[1])}, not {_told(each.values[0])}" for each in found]


def _told(values: Values) -> str:
    return ", ".join("none" if value is None else str(value) for value in values) or MISSING


def _column(arm: Arm, count: int) -> FloatArray:
    """Return recorded fitness `(r,)` after a number of samples; nothing if the experiment never reaches it."""
    return arm.recorded[:, count] if count <= arm.last else np.empty(0)
