"""Controls: what a single change of a study's spec does to the recorded fitness of its strategies."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from benchmarks.reproduction.studies import Arm, Study
from gaplab.schemas.differences import Values
from gaplab.services.core.comparisons import Compared, compare_all
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING, probability
from gaplab.services.specs.differences import SpecColumn, differences

COUNTS = (1, 2, 3, 5, 10)

SIZES = {"/iterations", "/repetitions"}
"""Settings that say how much of a study is there."""

HEAD = ("control", "what differs", "strategy", "samples", "study", "control's", "difference", "test", "p")


def compared_with(control: Study, studies: Mapping[str, Study]) -> str:
    """Return the label of the first study of the same robot, engines, preset and seed.

    Raises:
        SystemExit: there is none.
    """
    for label, study in studies.items():
        if _world(study.arms[0]) == _world(control.arms[0]):
            return label
    raise SystemExit(f"{control.archives[0]}: no study has its robot, engines, preset and seed")


def rows(label: str, control: Study, studies: Mapping[str, Study]) -> Iterator[tuple[str, ...]]:
    """Yield the difference of a control from its study, for each strategy of both and each number of samples.

    Fitness is over the direct baseline of its own study; over that of the other one if the control has none. Its
    repetitions share the random numbers of the study's, so the trusted test is paired.

    Args:
        label: label of the control in the document.
        control: has strategies of a study with other settings.
        studies: the studies, by their labels.
    """
    beside = compared_with(control, studies)
    study = studies[beside]
    units = study.unit, control.unit if len(control.direct) else study.unit
    for arm in control.arms:
        own = study.arm(arm.strategy)
        if own is None:
            continue
        head = f"{label}, beside {beside}", what_differs(own, arm), spoken(arm.strategy)
        for count in [0] if arm.read.direct else COUNTS:
            if row := _row((own, arm), (1.0, 1.0) if arm.read.direct else units, count):
                yield *head, *row


def what_differs(own: Arm, other: Arm) -> str:
    """Return the settings in which two experiments differ, without their sizes."""
    columns = [SpecColumn(arm.read.id, arm.read.name, (arm.read.spec,)) for arm in (own, other)]
    told = [
        f"{each.setting}: {_told(each.values[1])}, not {_told(each.values[0])}"
        for each in differences(columns).settings
        if each.pointer not in SIZES
    ]
    return "; ".join(told) or "nothing"


def _told(values: Values) -> str:
    return ", ".join("none" if value is None else str(value) for value in values) or MISSING


def _world(arm: Arm) -> tuple[object, ...]:
    reality = arm.spec.reality.engine
    return arm.spec.robot, arm.spec.engine.name, reality and reality.name, arm.spec.budget.preset, arm.spec.seed


def _row(arms: Iterable[Arm], units: tuple[float, float], count: int) -> tuple[str, ...] | None:
    """Return number of samples, both means, their difference and its test; None without values."""
    own, other = (_scaled(arm, unit) for arm, unit in zip(arms, units, strict=True))
    (pair,) = compare_all([other, own], count, count, intervals=False)
    if pair.difference is None:
        return None
    means = (f"{each.mean.value:.2f} ({each.n})" for each in (pair.summary_second, pair.summary_first))
    span = "" if pair.lower is None or pair.upper is None else f" ({pair.lower:+.3f} to {pair.upper:+.3f})"
    difference = f"{pair.difference:+.3f}{span}".replace("-", "\N{MINUS SIGN}")
    return str(count), *means, difference, pair.trusted.test.replace("_", " "), probability(pair.trusted.p)


def _scaled(arm: Arm, unit: float) -> Compared:
    compared = arm.compared()
    return replace(compared, recorded=compared.recorded / unit)
