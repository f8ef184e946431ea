"""The first page: whether the paper's figure holds, in one table and five sentences; `page.toml` has their text."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.reproduction import paper, results
from benchmarks.reproduction.claims import CLAIMS, judge, significant
from benchmarks.reproduction.results import table
from benchmarks.reproduction.statistics import Difference
from benchmarks.reproduction.studies import Study
from gaplab.services.figures.words import number_of
from gaplab.services.findings.statistics import finite
from gaplab.services.findings.wording import MISSING, listed

BEST = paper.FIT[2]
ENGINES = {"mujoco": "MuJoCo", "physx": "PhysX", "pybullet": "PyBullet"}
ALL = "all engines"
CLAIM = {claim.key: claim for claim in CLAIMS}
FIGURE, REASON = ("C2a", "C3", "C5a", "C8a"), ("C2b", "C4c")
"""Claims on what the paper draws, and on why: better tuned simulators."""
DEGREES = ((1.0, "Yes"), (0.4, "Partly"), (0.01, "Mostly not"), (0.0, "No"))
"""The least share of verdicts for each answer."""


def title(studies: Sequence[Study]) -> str:
    """Return whether the paper's figure holds in whole studies, and whether its reason does."""
    figure, reason = (
        [judge(CLAIM[key], study).verdict.reproduced for key in keys for study in studies] for keys in (FIGURE, REASON)
    )
    leads = [results.lead(study, "chances", results.FIRST, study.last) for study in studies]
    reason += [found is not None and found.value > 0 and significant(found.p) for found in leads]
    return f"{_degree(figure)}; its reason, {_degree(reason).lower()}"


def _degree(found: Sequence[bool]) -> str:
    return next(word for least, word in DEGREES if np.mean(found) >= least)


def rows(studies: Sequence[Study]) -> str:
    """Return the five rows, each beside the paper's number and with the estimate of all studies together."""
    ends = f"{paper.AFTER_TEN:.2f}, others about {paper.AT_LAST:.2f}"
    kinds = {"best so far": ("recorded", ends), "transferred alone": ("transferred", MISSING)}
    kinds |= {"equal chances": ("chances", MISSING)}
    found = [
        ("start: before any sample", f"{paper.START:.2f}", *_estimates(studies, _start, ".2f")),
        *(
            (f"{name} after ten: lead", told, *_estimates(studies, partial(_lead, kind)))
            for name, (kind, told) in kinds.items()
        ),
        ("one sample of fit-and-informative", "nearly perfect", *_estimates(studies, _one_sample, ".2f")),
    ]
    return table(("fitness over direct", "the paper", *map(engine, studies), ALL), found)


def _estimates(studies: Sequence[Study], of: Callable[[Study], Difference | None], form: str = "+.3f") -> Iterator[str]:
    found = [of(study) for study in studies]
    yield from (each.told(form) if each else MISSING for each in found)
    yield Difference.pooled([each for each in found if each]).told(form) if all(found) else MISSING


def _start(study: Study) -> Difference | None:
    return Difference.ratio(np.concatenate([arm.values(0, 0) for arm in study.of()]), study.direct)


def _lead(kind: str, study: Study) -> Difference | None:
    return results.lead(study, kind, study.last, study.last)


def _one_sample(study: Study) -> Difference | None:
    return Difference.ratio(finite(study.of([BEST])[0].recorded[:, 1]), study.direct)


def engine(study: Study) -> str:
    """Return the engine of a study's reality, and of its simulators if it is another."""
    reality, simulators = (ENGINES.get(name, name) for name in (study.reality, study.spec.engine.name))
    return reality if reality == simulators else f"{reality}, simulators in {simulators}"


def numbers(studies: Sequence[Study], others: Sequence[Study]) -> dict[str, str]:
    """Return the numbers of the sentences: of whole studies in their order, and of others with one sample."""

    def each(of: Callable[[Study], str]) -> str:
        return "; ".join(f"{of(study)} in {ENGINES.get(study.reality, study.reality)}" for study in studies)

    spreads = {kind: [results.spread(study, kind).partition(" ")[0] for study in studies] for kind in results.KINDS}
    told = {f"spread_{kind}": listed(each) for kind, each in spreads.items()}
    told |= {f"means_{kind}": each(partial(_means, kind)) for kind in results.KINDS}
    samples = [
        f"{found.told('.2f')} in {study.archives[0].stem}, {number_of('repetition', study.of([BEST])[0].repetitions)}"
        for study in others
        if (found := _one_sample(study))
    ]
    return told | {
        "engines": listed([ENGINES.get(study.reality, study.reality) for study in studies]),
        "counts": each(_counts),
        "over": each(_over),
        "alone": each(_alone),
        "one_sample": "; ".join(samples),
        "origins": "; ".join(_origins(study) for study in (*studies, *others)),
    }


def _means(kind: str, study: Study) -> str:
    sides = results.both_sides(study, kind, study.last, study.last)
    return " and ".join(f"{np.mean([group.mean() for group in side]) / study.unit:.2f}" for side in sides)


def _over(study: Study) -> str:
    found = results.lead(study, "chances", results.FIRST, study.last)
    return found.told() if found else MISSING


def _alone(study: Study) -> str:
    means = [finite(arm.transferred[:, study.last]).mean() / study.unit for arm in study.of()]
    return f"{min(means):.2f} to {max(means):.2f}"


def _counts(study: Study) -> str:
    """Return after which numbers of samples a lead of transferred controllers alone is shown."""
    found = {count: results.lead(study, "transferred", count, count) for count in range(1, study.last + 1)}
    counts = [str(count) for count, each in found.items() if each and each.value > 0 and significant(each.p)]
    return f"after {listed(counts)}" if counts else "nowhere"


def _origins(study: Study) -> str:
    known, changed, before = (sum(each) for each in zip(*(arm.origins for arm in study.arms), strict=True))
    return f"{study.archives[0].stem} {before} and {changed} of {known}"
