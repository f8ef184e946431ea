"""What the computation of studies took, as Markdown."""

from collections.abc import Iterator, Mapping

from benchmarks.reproduction.studies import Study
from benchmarks.reproduction.tables import table
from gaplab.services.figures.words import spoken
from gaplab.services.reports.numbers import MISSING

HEAD = (
    "study",
    "experiment",
    "repetitions",
    "rollouts",
    "saved",
    "core-hours of stored steps",
    "attempts",
    "core-hours of attempts",
)


def costs(studies: Mapping[str, Study]) -> str:
    """Return the table of what each experiment took, and of all together."""
    arms = [arm for study in studies.values() for arm in study.arms]
    total = (
        "all",
        "",
        "",
        f"{sum(arm.read.progress.rollouts_done for arm in arms):,}",
        f"{sum(arm.read.progress.rollouts_saved for arm in arms):,}",
        f"{sum(arm.core_hours for arm in arms):.2f}",
        f"{sum(arm.attempts for arm in arms):,}",
        f"{sum(arm.held_core_hours for arm in arms):.2f}",
    )
    return table(HEAD, [*(row for label, study in studies.items() for row in _rows(label, study)), total])


def _rows(label: str, study: Study) -> Iterator[tuple[str, ...]]:
    for arm in study.arms:
        progress = arm.read.progress
        yield (
            label,
            spoken(arm.read.name),
            str(arm.repetitions),
            f"{progress.rollouts_done:,}",
            f"{progress.rollouts_saved:,}",
            f"{arm.core_hours:.2f}",
            f"{arm.attempts:,}" if arm.attempts else MISSING,
            f"{arm.held_core_hours:.2f}" if arm.attempts else MISSING,
        )
