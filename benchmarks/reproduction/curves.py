"""The claims on the spread and the shape of curves: C3, C8a and C8b."""

from collections.abc import Iterable

import numpy as np

from benchmarks.reproduction import paper, statements
from benchmarks.reproduction.evidence import NO_TEST, Evidence, Examined
from benchmarks.reproduction.studies import Study
from gaplab.services.core.arrays import FloatArray
from gaplab.services.figures.words import number_of, spoken
from gaplab.services.reports.numbers import signed

NEARER_TO_A_THIRD = (1 / 3) ** 0.5
"""Ratio of standard deviations that is as far from a third as from 1, by factors."""

FEWEST_SAMPLES = 4
"""Samples below which a curve has no two halves to compare."""


def fit_strategies_vary_less(study: Study) -> Examined:
    """Return the evidence that strategies with simulated fit vary less than 0.58 times as much as the others (C3)."""
    sides = [_complete(study, names) if study.last >= 3 else {} for names in (paper.SIMULATED_FIT, paper.WEAK)]
    names = [name for side in sides for name in side]
    lacking = tuple(spoken(name).lower() for name in paper.STRATEGIES if name not in names)
    if not all(sides):
        short = (f"value after 3 samples: it ends after {study.last}",)
        return Examined("", "", (), lacking if study.last >= 3 else short)
    narrow, wide = (list(side.values()) for side in sides)
    tested = statements.narrower(narrow, wide, NEARER_TO_A_THIRD, 1 / paper.LEAST_TIMES)
    here = f"ratio of the deviations over 3 to {study.last} samples {tested.estimate}"
    evidence = Evidence(f"ratio of the deviations below {NEARER_TO_A_THIRD:.2f}", tested)
    return Examined(here, NO_TEST, (evidence,), lacking, study.unequal(names))


def _complete(study: Study, names: Iterable[str]) -> dict[str, FloatArray]:
    """Return the complete repetitions `(r, k)` from three samples on, of strategies with two or more."""
    found = {name: study.complete(name, 3, study.last) for name in names if study.arm(name)}
    return {name: values for name, values in found.items() if len(values) > 1}


def curves_rise(study: Study) -> Examined:
    """Return the evidence that all curves rise (C8a)."""
    return _shaped(study, "rises", paper.LEAST_RISE)


def curves_flatten(study: Study) -> Examined:
    """Return the evidence that all curves flatten (C8b)."""
    return _shaped(study, "flattens", 0.0)


def _shaped(study: Study, verb: str, least: float) -> Examined:
    """Return the evidence that every curve rises or flattens; refuted if what it gains is shown to be below `least`."""
    present = study.present
    lacking = [spoken(name).lower() for name in paper.STRATEGIES if name not in present]
    if not present or study.last < FEWEST_SAMPLES:
        short = f"value after {number_of('sample', FEWEST_SAMPLES)}: it ends after {study.last}"
        return Examined("", "", (), (*lacking, *([short] if present else [])))
    middle, evidence, told = study.last // 2, [], []
    for name in present:
        recorded = study.complete(name, 0, study.last)
        early, late = recorded[:, middle] - recorded[:, 0], recorded[:, -1] - recorded[:, middle]
        gains = early + late if verb == "rises" else early / middle - late / (study.last - middle)
        evidence.append(Evidence(f"{spoken(name)} {verb}", statements.rises(gains, least, study.unit)))
        if len(recorded):
            told.append(f"{spoken(name)} {_gain(study, early)} and {_gain(study, late)}")
    unit = "" if np.isnan(study.unit) else " of direct"
    here = f"gain{unit} to {middle} samples, and from there to {study.last}: {'; '.join(told)}"
    return Examined(here, NO_TEST, tuple(evidence), tuple(lacking))


def _gain(study: Study, gains: FloatArray) -> str:
    unit = 1.0 if np.isnan(study.unit) else study.unit
    return signed(float(gains.mean() / unit))
