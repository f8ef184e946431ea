"""The document of the paper's figures and claims: each verdict, from archives of studies that were made for it.

The studies run the toy function. Their recorded fitnesses are made, so that the verdict on each claim is known.
"""

import re
import subprocess
import sys
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from gaplab import migrations
from gaplab.services.store.session import Store
from tests.commands import module
from tests.made_studies import STEP_S, Made, Study, archive, values

pytestmark = pytest.mark.release

ROOT = Path(__file__).parents[2]
STORED = ROOT / "docs" / "studies"
CLAIMS = ["C1", "C2a", "C2b", "C3", "C4a", "C4b", "C4c", "C5a", "C5b", "C5c", "C6", "C7", "C8a", "C8b", "C8c"]


def rising(start: float, last: float, samples: int = 10) -> list[float]:
    """Means that rise, and flatten."""
    return [last - (last - start) * 0.5**sample for sample in range(samples + 1)]


DIRECT = {"direct": Made([1.0], 0.02)}
AGREES = DIRECT | {
    "simulated_fit": Made([0.68, 0.85, 1.06, *rising(1.11, 1.16, 7)]),
    "simulated_fit_and_unique": Made([0.68, 0.85, 1.08, *rising(1.15, 1.20, 7)]),
    "informative": Made(rising(0.68, 1.08), 0.04, 0.01),
    "simulated_fit_and_informative": Made([0.68, 0.98, *rising(1.06, 1.12, 8)]),
    "random": Made(rising(0.68, 0.98), 0.04, 0.01),
    "known_fit": Made(rising(0.68, 1.03), 0.04, 0.01),
}
"""Every claim holds."""

CONTRADICTS = DIRECT | {
    "simulated_fit": Made(rising(0.4, 0.8), 0.05),
    "simulated_fit_and_unique": Made(rising(0.4, 0.7), 0.05),
    "informative": Made(rising(0.4, 0.9)),
    "simulated_fit_and_informative": Made(rising(0.4, 0.6), 0.05),
    "random": Made([0.4] * 11),
    "known_fit": Made(rising(0.4, 0.3)),
}
"""No claim holds."""

VAGUE = {"direct": Made([1.0], 0.3)} | {
    name: Made(rising(0.80, 0.95), *(deviation, deviation))
    for name, deviation in [(name, 0.12 if name.startswith("simulated") else 0.21) for name in AGREES]
    if name != "direct"
}
"""Repetitions vary so much that nothing is decided."""

ORDERED = {
    "simulated_fit": Made([0.9] * 5),
    "simulated_fit_and_unique": Made([1.0] * 5),
    "simulated_fit_and_informative": Made([0.9] * 5),
} | DIRECT
"""The unique strategy is fitter than two that are equally fit."""

HALVED = {name: Made([1.0] * 11, 0.0, 0.048 if name.startswith("simulated") else 0.1) for name in AGREES} | DIRECT
"""Strategies with simulated fit vary half as much as the others."""


def only(curves: Mapping[str, Made], *names: str) -> dict[str, Made]:
    return {name: curves[name] for name in names}


STUDIES = {
    "agrees": Study(AGREES),
    "contradicts": Study(CONTRADICTS, 6),
    "vague": Study(VAGUE, 7),
    "unequal": Study(AGREES, 6, changes={"budget": {"preset": "smoke", "reuse_transfer": True}}),
    "short": Study(AGREES, 6, samples=3),
    "stopped": Study(AGREES, 4, more=2),
    "two": Study(only(CONTRADICTS, "informative", "simulated_fit"), 6),
    "small": Study(DIRECT | {"random": Made([0.50] * 7, 0.01), "known_fit": Made([0.52] * 7, 0.01)}, 12, 6),
    "halved": Study(HALVED, 10),
    "ordered": Study(ORDERED, 20, 3),
}

CONTROLS = {
    "bouncing": Study(
        {
            "direct": Made([2.0], 0.02),
            "simulated_fit": Made([2 * (mean - 0.1) for mean in AGREES["simulated_fit"].means], wiggle=0.02),
        },
        changes={"reality": {"parameters": {"restitution": 0.1}}},
    ),
    "divided": Study(
        {"simulated_fit": AGREES["simulated_fit"]._replace(wiggle=0.02)},
        samples=3,
        changes={"tuner": {"name": "search", "options": {"equal_rollouts": True}}},
    ),
}
"""Strategies of "agrees" with one change: one is a tenth of direct below it, the other is as fit."""


COMMAND = "benchmarks.reproduction"


class Document:
    """A document, and its tables by the title above them."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.text = file.read_text()
        self.sections = dict(re.findall(r"^#+ (.+?)\n(.*?)(?=^#+ |\Z)", self.text, re.MULTILINE | re.DOTALL))

    def rows(self, title: str, begin: str = "") -> list[dict[str, str]]:
        """The rows of the first table whose head begins so."""
        tables = re.findall(r"(?:^\|.*\n?)+", self.sections[title], re.MULTILINE)
        lines = next(each for each in tables if each.startswith(f"| {begin}")).splitlines()
        head, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
        return [dict(zip(head, row, strict=True)) for row in rows]

    def row(self, title: str, name: str) -> dict[str, str]:
        return next(row for row in self.rows(title) if next(iter(row.values())).startswith(name))

    def verdict(self, claim: str, study: str) -> str:
        return self.row(claim, study)["verdict"].strip("*")


@pytest.fixture(scope="module")
def document(tmp_path_factory: pytest.TempPathFactory) -> Document:
    """The document of all made studies."""
    folder = tmp_path_factory.mktemp("reproduction")
    url = f"sqlite:///{folder / 'made.db'}"
    migrations.upgrade(url)
    store = Store(url)
    archives = [archive(store, label, study, folder) for label, study in STUDIES.items()]
    apart = {"parted": only(AGREES, "simulated_fit_and_informative"), "parted-direct": DIRECT}
    parted = ",".join(str(archive(store, label, Study(curves), folder)) for label, curves in apart.items())
    controls = [f"--control={archive(store, label, study, folder)}" for label, study in CONTROLS.items()]
    store.dispose()

    assert module(COMMAND, *archives, parted, *controls, "-o", folder / "reproduction.md") == ""

    return Document(folder / "claims.md")


def test_a_claim_whose_every_statement_is_shown_is_reproduced(document: Document) -> None:
    assert {document.verdict(claim, "agrees") for claim in CLAIMS} == {"reproduced"}


REFUTED = {
    "C1": "all together near 0.68",
    "C2a": "Simulated fit above 0.94 after 3",
    "C2b": "Simulated fit transfers above 0.94 after 4",
    "C3": "ratio of the deviations below 0.58",
    "C4a": "Simulated fit and informative above simulated fit",
    "C4b": "Simulated fit and informative above 0.94 after 1",
    "C4c": "Simulated fit and informative transfers above 0.94 after 1",
    "C5a": "Simulated fit above informative",
    "C5b": "Simulated fit and unique above simulated fit",
    "C5c": "Known fit above random",
    "C6": "Known fit above random",
    "C7": "Simulated fit and unique above simulated fit",
    "C8a": "Known fit rises",
    "C8b": "Known fit flattens",
    "C8c": "Simulated fit above 0.94 after 10",
}


def test_a_claim_with_a_refuted_statement_is_not_reproduced(document: Document) -> None:
    assert {document.verdict(claim, "contradicts") for claim in CLAIMS} == {"not reproduced"}
    whys = {claim: document.row(claim, "contradicts")["why"] for claim in CLAIMS}
    assert all(why.startswith("Refuted: ") for why in whys.values())
    assert [claim for claim in CLAIMS if f"{REFUTED[claim]} (p " not in whys[claim]] == []


def test_a_refutation_says_if_the_opposite_is_shown(document: Document) -> None:
    assert "the opposite is shown, p " in document.row("C7", "contradicts")["why"]
    assert "the opposite" not in document.row("C5b", "ordered")["why"]


def test_a_difference_that_is_shown_to_be_smaller_than_the_papers_is_told(document: Document) -> None:
    assert document.verdict("C5c", "small") == "reproduced**, smaller"
    assert document.row("C5c", "small")["why"].endswith("smaller than in the paper: Known fit above random.")
    assert document.verdict("C3", "halved") == "reproduced**, smaller"
    assert document.row("C3", "halved")["why"].endswith("in the paper: ratio of the deviations below 0.58.")


def test_a_claim_that_varied_repetitions_neither_show_nor_refute_is_open(document: Document) -> None:
    assert {document.verdict(claim, "vague") for claim in CLAIMS} == {"open"}
    assert all(document.row(claim, "vague")["why"].startswith("Neither shown nor refuted: ") for claim in CLAIMS)


def test_fewer_than_five_repetitions_leave_every_claim_open(document: Document) -> None:
    assert {document.verdict(claim, "stopped") for claim in CLAIMS} == {"open"}
    told = "Too few values, or none that vary: "
    assert all(told in document.row(claim, "stopped")["why"] for claim in CLAIMS)


def test_unequal_searches_for_samples_leave_comparisons_of_the_strategies_that_have_them_open(
    document: Document,
) -> None:
    compared = {"C3", "C4a", "C5a", "C5b", "C7"}
    whys = [document.row(claim, "unequal")["why"] for claim in compared]

    assert {document.verdict(claim, "unequal") for claim in compared} == {"open"}
    assert {document.verdict(claim, "unequal") for claim in ("C1", "C2a", "C2b", "C4b", "C4c")} == {"reproduced"}
    assert all(why.startswith("Not a fair comparison: samples are selected from searches of") for why in whys)
    assert all("simulated_fit 60, simulated_fit_and_unique 30" in why for why in whys)


def test_a_claim_is_open_or_absent_in_a_study_that_lacks_some_or_all_of_its_strategies(document: Document) -> None:
    some, none = {"C2a", "C2b", "C8a", "C8b", "C8c"}, {"C3", "C4a", "C5a", "C5b", "C5c", "C6", "C7"}
    told = "Shown for what the study has. Missing: simulated fit, simulated fit and unique"

    assert {document.verdict(claim, "parted") for claim in some} == {"open"}
    assert all(document.row(claim, "parted")["why"].startswith(told) for claim in some - {"C8a", "C8b", "C8c"})
    assert {document.verdict(claim, "parted") for claim in none} == {"not in this study"}
    assert all(document.row(claim, "parted")["why"].startswith("Missing: ") for claim in none)


def test_a_claim_is_refuted_by_a_part_of_its_strategies(document: Document) -> None:
    assert document.verdict("C5a", "two") == "not reproduced"


def test_a_claim_on_direct_is_absent_from_a_study_without_it(document: Document) -> None:
    for claim in ("C1", "C2a", "C2b", "C8c"):
        assert document.verdict(claim, "two") == "not in this study"
        assert "Missing: direct baseline" in document.row(claim, "two")["why"]


def test_a_study_that_ends_early_says_which_samples_it_lacks(document: Document) -> None:
    assert document.verdict("C2a", "short") == "open"
    assert document.row("C2a", "short")["why"].endswith(
        "Missing: value after 10\N{NO-BREAK SPACE}samples: it ends after 3."
    )
    assert document.verdict("C6", "short") == "not in this study"
    assert {document.verdict(claim, "short") for claim in ("C2b", "C8a", "C8b", "C8c")} == {"not in this study"}


def test_a_rule_that_was_completed_after_results_has_a_dagger(document: Document) -> None:
    heads = [row["claim"].partition(":")[0] for row in document.rows("The verdicts")]

    assert {"C2b†", "C3†", "C1", "C7"} <= set(heads)


def test_the_papers_own_test_stands_beside_the_careful_one(document: Document) -> None:
    agrees = document.row("C5a", "agrees")

    assert agrees["the paper's test"].startswith("Student pooled over 3 to 10 samples: 9 of 9\N{NO-BREAK SPACE}pairs")
    assert agrees["our test"].startswith("9 of 9 shown")
    assert document.row("C4a", "agrees")["the paper's test"].startswith("Student at 1\N{NO-BREAK SPACE}sample: 5 of 5")
    assert document.row("C7", "contradicts")["the paper's test"] == "none in the paper"


def test_the_verdicts_at_the_top_are_those_of_the_claims(document: Document) -> None:
    for claim in CLAIMS:
        top = document.row("The verdicts", claim)
        assert {study: top[study].strip("*") for study in STUDIES} == {
            study: document.verdict(claim, study) for study in STUDIES
        }


def test_repetitions_are_told_beside_the_planned_ones(document: Document) -> None:
    told = {label: document.row("The studies", f"[{label}]")["repetitions"] for label in ("agrees", "stopped")}

    assert told["agrees"] == "12"
    assert told["stopped"].startswith("4 of 6")


def test_fitness_is_a_ratio_to_direct_beside_the_papers(document: Document) -> None:
    curve = AGREES["simulated_fit"]

    row = document.row("agrees", "Simulated fit (12)")
    paper = document.row("agrees", "the paper, with simulated fit")

    assert [float(row[str(count)].split(" ± ")[0]) for count in range(11)] == [
        pytest.approx(mean, abs=0.006) for mean in curve.means
    ]
    assert (paper["0"], paper["3"], paper["10"]) == ("0.68", "≥ 0.98", "1.05")
    assert "has no direct baseline" in document.sections["two"]


def test_a_toy_study_has_the_papers_figure_3(document: Document) -> None:
    fitness, distance = (document.row(f"{title}: agrees", "Simulated fit") for title in ("Fig. 3", "Distance"))

    assert (fitness["8"][:3], distance["8"]) == ("1.1", "0.00")
    assert list(fitness) == ["samples", "0", "2", "4", "6", "8"]


def is_fit(name: str) -> bool:
    return name.startswith("simulated")


def is_weak(name: str) -> bool:
    return name in {"informative", "random", "known_fit"}


def test_recorded_fitness_is_divided_into_samples_and_transfers(document: Document) -> None:
    row = next(row for row in document.rows("Origins: agrees", "strategy") if row["samples"] == "10")

    assert (row["last sample"], row["best sample"], row["from a sample"], row["distance"]) == (
        "0.10",
        "0.10",
        "0%",
        "0.00",
    )
    assert row["transferred"] == row["recorded"] == "1.16"


def test_the_lead_is_told_by_count_as_recorded_in_transferred_controllers_alone_and_with_equal_chances(
    document: Document,
) -> None:
    kinds = ("recorded", "transferred alone", "equal chances")
    recorded, transferred, chances = (document.row("Origins: agrees", kind) for kind in kinds)

    unit = made("agrees", "direct").mean()
    sides = [[made("agrees", name) for name in AGREES if pick(name)] for pick in (is_fit, is_weak)]
    best = [[np.maximum.accumulate(each, axis=1) for each in side] for side in sides]
    for row, groups in (
        (recorded, sides),
        (transferred, sides),
        (chances, best),
    ):  # each sample is worse than each probe
        gains = np.mean(groups[0], axis=(0, 1)) - np.mean(groups[1], axis=(0, 1))
        assert [numbers(row[str(count)])[0] for count in range(11)] == pytest.approx(list(gains / unit), abs=6e-4)
        assert numbers(row["3 to 10"])[0] == pytest.approx(gains[3:].mean() / unit, abs=6e-4)
        narrow, wide = (np.mean([each[:, 3:].var(axis=0, ddof=1) for each in side]) ** 0.5 for side in groups)
        assert numbers(row["ratio of deviations"])[0] == pytest.approx(narrow / wide, abs=6e-3)


def test_estimates_of_whole_figures_are_taken_together_by_the_inverse_of_their_variances(document: Document) -> None:
    estimates = []
    for study in ("agrees", "contradicts", "vague", "unequal", "halved"):  # "stopped" has too few repetitions
        groups = [made(study, name)[:, 3:].mean(axis=1) for name in ("known_fit", "random")]
        error = sum(each.var(ddof=1) / len(each) for each in groups) ** 0.5
        estimates.append(np.array([groups[0].mean() - groups[1].mean(), error]) / made(study, "direct").mean())
    values, errors = np.array(estimates).T

    row = next(row for row in document.rows("C5c, by statement") if row["study"] == "all engines")

    weights = errors**-2 / (errors**-2).sum()
    assert numbers(row["here"])[0] == pytest.approx(values @ weights, abs=6e-4)


def test_the_first_page_has_five_rows_of_the_whole_figures_beside_the_papers(document: Document) -> None:
    text = document.file.with_name("reproduction.md").read_text()

    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")][2:]
    assert text.startswith("# Does the paper's Fig. 4 hold? ")
    assert [row[0].partition(":")[0].partition(" after")[0] for row in rows] == [
        "start", "best so far", "transferred alone", "equal chances", "one sample of fit-and-informative",
    ]  # fmt: skip
    direct = made("agrees", "direct").mean()
    start = np.mean([made("agrees", name)[:, 0] for name in AGREES if name != "direct"]) / direct
    last = {name: made("agrees", name)[:, -1].mean() / direct for name in AGREES}
    lead = np.mean([last[name] for name in last if is_fit(name)]) - np.mean(
        [last[name] for name in last if is_weak(name)]
    )
    assert [numbers(row[2])[0] for row in rows[:2]] == pytest.approx([start, lead], abs=6e-3)
    assert not re.search(r"[{}]|\bnan\b", text)


def test_each_statement_has_its_estimate_and_both_p(document: Document) -> None:
    rows = [row for row in document.rows("C5c, by statement") if row["study"] == "agrees"]

    assert [row["statement"] for row in rows] == ["Known fit above random"]
    assert rows[0]["here"].startswith("+0.0")
    assert float(rows[0]["p that shows it"]) < 0.05
    assert rows[0]["p that refutes it"] == "the other way"


def made(study: str, strategy: str) -> np.ndarray:
    """The fitness `(repetitions, samples + 1)` that a study was made with."""
    found = STUDIES[study]
    return values(strategy, found.curves[strategy], found.repetitions, 1 if strategy == "direct" else found.samples + 1)


def numbers(told: str) -> list[float]:
    return [float(each) for each in re.findall(r"[+-]?\d+\.\d+", told.replace("\N{MINUS SIGN}", "-"))]


def test_a_difference_is_tested_by_welch_over_one_value_for_each_repetition(document: Document) -> None:
    first, second = (made("vague", name)[:, 3:].mean(axis=1) for name in ("simulated_fit_and_informative", "random"))
    welch = stats.ttest_ind(first, second, equal_var=False)
    direct = made("vague", "direct").mean()
    named = "Simulated fit and informative above random"

    rows = [row for row in document.rows("C5a, by statement") if row["study"] == "vague" and row["statement"] == named]

    ends = welch.confidence_interval(0.95)
    difference = first.mean() - second.mean()
    assert numbers(rows[0]["here"]) == pytest.approx([each / direct for each in (difference, *ends)], abs=6e-4)
    shown = rows[0]["p that shows it"]
    assert shown == "the other way" if difference < 0 else float(shown) == pytest.approx(welch.pvalue, abs=6e-4)


def test_a_ratio_to_direct_has_the_errors_of_both_means(document: Document) -> None:
    own, direct = made("vague", "simulated_fit")[:, 3], made("vague", "direct")[:, 0]
    rng = np.random.default_rng(1)
    drawn = [rng.choice(each, (20_000, len(each))).mean(axis=1) for each in (own, direct)]
    named = "Simulated fit above 0.94 after 3"

    rows = [row for row in document.rows("C2a, by statement") if row["study"] == "vague" and row["statement"] == named]

    value, low, high = numbers(rows[0]["here"])
    assert value == pytest.approx(own.mean() / direct.mean(), abs=6e-3)
    error = np.median(np.abs(drawn[0] / drawn[1] - value)) / 0.674 * (7 / 6) ** 0.5
    assert high - low == pytest.approx(2 * stats.t.ppf(0.975, 7) * error, rel=0.2)


def test_the_best_of_many_direct_searches_is_the_mean_over_all_choices_of_them(document: Document) -> None:
    direct = values("direct", DIRECT["direct"], STUDIES["ordered"].repetitions, 1)[:, 0]
    row = document.row("ordered", "direct, the best of samples + 1")

    for samples in range(4):
        chosen = [max(some) for some in combinations(direct, samples + 1)]
        assert float(row[str(samples)]) == pytest.approx(np.mean(chosen), abs=6e-3)


def test_too_few_direct_searches_have_no_best(document: Document) -> None:
    row = document.row("agrees", "direct, the best of samples + 1")

    assert {row[str(samples)] for samples in range(11)} == {"\N{EN DASH}"}


@pytest.mark.parametrize(
    ("claim", "p", "counts", "correlation", "deviation"), [("C5b", 0.001, 8, 0.5, 0.094), ("C6", 0.05, 5, 0.1, 0.282)]
)
def test_the_least_size_is_what_the_papers_test_of_correlated_values_finds_in_a_third_of_cases(
    document: Document, claim: str, p: float, counts: int, correlation: float, deviation: float
) -> None:
    size = re.search(r"Refuted if a lead is shown to be smaller than (0\.\d+) of direct", document.sections[claim])
    assert size
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(2000):
        own = rng.normal(size=(2, 40, 1)) * correlation**0.5
        drawn = deviation * (own + rng.normal(size=(2, 40, counts)) * (1 - correlation) ** 0.5)
        test = stats.ttest_ind(drawn[0].ravel() + float(size[1]), drawn[1].ravel())
        found += test.pvalue < p and test.statistic > 0

    assert found / 2000 == pytest.approx(1 / 3, abs=0.04)


def test_a_control_over_its_own_direct_has_the_errors_of_both_baselines(document: Document) -> None:
    row = next(row for row in document.rows("bouncing, beside agrees") if row["samples"] == "10")
    bouncing = CONTROLS["bouncing"].curves
    new, base = (values(name, bouncing[name], 12, size) for name, size in (("simulated_fit", 11), ("direct", 1)))
    old, other = made("agrees", "simulated_fit"), made("agrees", "direct")

    difference, low, high = numbers(row["difference"])

    pairs = new[:, 10] / base.mean() - old[:, 10] / other.mean()
    shares = [each[:, 10].mean() / of.mean() ** 2 * of.std(ddof=1) for each, of in ((new, base), (old, other))]
    error = (pairs.var(ddof=1) + sum(share**2 for share in shares)) ** 0.5 / 12**0.5
    assert difference == pytest.approx(pairs.mean(), abs=6e-4)
    assert stats.t.ppf(0.975, 33) * error < (high - low) / 2 < stats.t.ppf(0.975, 11) * error + 6e-4


def test_the_list_of_studies_says_what_they_took(document: Document) -> None:
    steps, repetitions = 6 * (3 + 10 * 5) + 3, STUDIES["agrees"].repetitions

    row = document.row("The studies", "[agrees]")

    assert float(row["core-hours"]) == pytest.approx(steps * repetitions * STEP_S / 3600, rel=0.005)
    assert document.row("The studies", "the paper")["repetitions"] == "40 (direct 100)"


def test_the_list_of_studies_says_what_each_is(document: Document) -> None:
    row = document.row("The studies", "[agrees](agrees.zip): made: agrees")

    assert (row["robot"], row["simulators"], row["seed"], row["iterations"]) == ("toy_function", "analytic", "7", "10")
    assert row["reality"] == "analytic (static friction 1.0, dynamic friction 0.8, restitution 0.0)"
    assert row["evaluations: controller / selection / tuning"].startswith("smoke, steady_state: 60 / 30 / 60")
    assert row["repetitions"] == "12"


def test_a_control_tells_what_its_change_does_to_fitness_over_its_own_direct(document: Document) -> None:
    rows = document.rows("bouncing, beside agrees")

    assert "What differs: restitution of reality: 0.1, not 0.0. Shown" in document.sections["bouncing, beside agrees"]
    assert [(row["strategy"], row["samples"]) for row in rows] == [
        ("Direct", "0"),
        *[("Simulated fit", str(count)) for count in (0, 1, 2, 3, 5, 10)],
    ]
    direct, _, first, *_ = rows
    assert list(first.values())[1:5] == ["1", "0.85", "0.75", "12"]
    assert first["p"] == "< 0.001"
    assert first["difference"].startswith("\N{MINUS SIGN}0.100 (\N{MINUS SIGN}0.1")
    assert (direct["study"], direct["control"]) == ("1.00", "2.00")
    assert "correction over the table: direct; simulated fit at 0, 1, 2, 3, 5 and 10." in document.text


def test_a_control_without_direct_is_judged_by_that_of_its_study_as_far_as_it_goes(document: Document) -> None:
    rows = document.rows("divided, beside agrees")

    assert [row["samples"] for row in rows] == ["0", "1", "2", "3"]
    assert all(row["study"] == row["control"] for row in rows)
    assert all(float(row["p"]) > 0.99 for row in rows)
    assert "correction over the table: no difference." in document.sections["divided, beside agrees"]
    assert (
        "a tuning's divided by its samples"
        in document.row("The controls", "[divided]")["evaluations: controller / selection / tuning"]
    )


def test_archives_that_were_computed_apart_are_one_study(document: Document) -> None:
    assert {document.verdict(claim, "parted") for claim in ("C4b", "C4c")} == {"reproduced"}
    assert document.row("The studies", "[parted](parted.zip), [parted-direct](parted-direct.zip): made: parted")
    assert re.search(r"/parted\.zip,\S+/parted-direct\.zip ", document.text)


def test_archives_that_do_not_belong_together_are_refused(document: Document, tmp_path: Path) -> None:
    direct, toy = document.file.with_name("parted-direct.zip"), document.file.with_name("bouncing.zip")
    other = document.file.with_name("divided.zip")

    for arguments, why in (
        ([f"{direct},{toy}"], "robot, engines, reality, budget, tuner, optimizers or seed differ"),
        ([direct, f"--control={other}"], "no study has its robot, engine and seed, and one of its strategies"),
    ):
        with pytest.raises(SystemExit, match=why):
            module(COMMAND, *arguments)


def test_a_control_of_another_reality_needs_its_own_direct(document: Document, tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'made.db'}"
    migrations.upgrade(url)
    store = Store(url)
    alone = Study(only(AGREES, "simulated_fit"), 4, 3, changes={"reality": {"parameters": {"restitution": 0.1}}})
    control = archive(store, "alone", alone, tmp_path)
    store.dispose()

    with pytest.raises(
        SystemExit, match=r"alone\.zip: it has another reality, so it needs a direct baseline of its own"
    ):
        module(COMMAND, document.file.with_name("divided.zip"), f"--control={control}")


def test_every_link_and_picture_leads_somewhere(document: Document) -> None:
    addresses = re.findall(r"\]\(([^)#]+)\)", document.text + document.file.with_name("reproduction.md").read_text())

    assert {f"figures/reproduction-agrees-{number}.svg" for number in (3, 4)} <= set(addresses)
    assert not [each for each in addresses if not (document.file.parent / each).exists()]


def test_the_command_prints_what_the_documents_say_of_a_published_archive() -> None:
    """As docs/lean.md says of the sample of C4b with another seed."""
    command = [sys.executable, "-m", COMMAND, str(STORED / "control-selection-2013.zip")]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)

    assert ended.returncode == 0, ended.stderr
    assert "1.05 (0.97 to 1.13) | 0.011 |" in ended.stdout
    assert "nan" not in re.findall(r"\w+", ended.stdout)


def test_what_is_no_archive_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "text.zip").write_text("no archive")

    for name, why in (("text.zip", "it is not a readable zip"), ("missing.zip", "No such file")):
        with pytest.raises(SystemExit, match=f"^{tmp_path / name}: .*{why}"):
            module(COMMAND, tmp_path / name)


def test_two_archives_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        module(COMMAND, *(tmp_path / folder / "one.zip" for folder in "ab"))

    assert "two archives have one name" in capsys.readouterr().err
