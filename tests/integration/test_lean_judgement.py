"""The judgement of `lean` beside `paper`, from archives of studies that were made for it."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from gaplab import migrations
from gaplab.services.store.session import Store
from tests.made_studies import Made, Study, archive, values

ROOT = Path(__file__).parents[2]

PAPER = {
    "direct": Made([1.0], 0.01),
    "simulated_fit": Made([0.7, 0.8, 0.9, 0.95, 0.97, 1.0]),
    "random": Made([0.7, 0.72, 0.74, 0.75, 0.76, 0.77]),
}
LEAN = {name: made._replace(deviation=0.015) for name, made in PAPER.items()}
REPETITIONS = 12
Judged = Callable[..., str]


def command(*arguments: str) -> str:
    """What the command prints.

    Raises:
        SystemExit: it refuses.
    """
    named = [sys.executable, "-m", "benchmarks.lean", *arguments]
    ended = subprocess.run(named, cwd=ROOT, capture_output=True, text=True, env=os.environ | {"COLUMNS": "160"})
    if ended.returncode:
        raise SystemExit(ended.stderr)
    return ended.stdout


def moved(name: str, by: float) -> dict[str, Made]:
    """The curves of `lean`, one of them moved."""
    made = LEAN[name]
    return LEAN | {name: made._replace(means=[mean + by for mean in made.means])}


@pytest.fixture
def judged(tmp_path: Path) -> Judged:
    """What the command says of curves of `lean` and of `paper`."""

    def found(
        lean: dict[str, Made],
        paper: dict[str, Made] = PAPER,
        direct: float | None = None,
        repetitions: tuple[int, int] = (REPETITIONS, REPETITIONS),
    ) -> str:
        url = f"sqlite:///{tmp_path / 'made.db'}"
        migrations.upgrade(url)
        store = Store(url)
        archives = [
            archive(store, preset, Study(curves, count, samples=5, changes={"budget": preset}), tmp_path)
            for preset, curves, count in zip(("lean", "paper"), (lean, paper), repetitions, strict=True)
        ]
        store.dispose()
        given = [] if direct is None else ["--direct", str(direct)]
        return command("judge", *map(str, archives), *given)

    return found


def verdicts(text: str, strategy: str) -> list[str]:
    rows = [line.split("│") for line in text.splitlines() if line.startswith("│ ")]
    return [row[-2].strip() for row in rows if row[1].strip() == strategy]


def test_curves_that_are_the_same_are_equivalent_and_ranked_alike(judged: Judged) -> None:
    text = judged(LEAN)

    assert verdicts(text, "simulated_fit") == ["equivalent"] * 6
    assert verdicts(text, "random") == ["equivalent"] * 6
    assert "simulated_fit > random" in text
    assert "1, 1; 1 in both, 0 opposite" in text


def test_the_mean_of_all_strategies_is_judged_too(judged: Judged) -> None:
    assert verdicts(judged(LEAN), "mean of 2") == ["equivalent"] * 3
    assert verdicts(judged(moved("random", -0.2)), "mean of 2") == ["different"] * 3


def test_all_curves_above_the_papers_are_equivalent_over_their_own_direct(judged: Judged) -> None:
    higher = {name: made._replace(means=[1.2 * mean for mean in made.means]) for name, made in LEAN.items()}

    text = judged(higher)

    assert verdicts(text, "simulated_fit") == ["different"] * 3 + ["equivalent"] * 3
    assert "0.800 │ 0.800" in text


def test_a_direct_that_is_not_well_known_leaves_ratios_undecided(judged: Judged) -> None:
    text = judged(LEAN | {"direct": Made([1.0], 0.3)})

    assert verdicts(text, "random")[3:] == ["undecided"] * 3


def test_ratios_are_of_the_repetitions_that_both_have(judged: Judged) -> None:
    spread = LEAN | {"random": LEAN["random"]._replace(deviation=0.2)}
    both = values("random", spread["random"], REPETITIONS, 6)[: REPETITIONS // 2, 1].mean()

    text = judged(spread, repetitions=(REPETITIONS, REPETITIONS // 2))

    assert round(both, 3) != spread["random"].means[1]
    assert f"│ random        │ 1     │ {both:.3f} │ 0.720 │" in text


def test_a_curve_beyond_the_margin_is_different_and_the_others_stay_equivalent(judged: Judged) -> None:
    text = judged(moved("simulated_fit", -0.06))

    assert set(verdicts(text, "simulated_fit")) == {"different"}
    assert set(verdicts(text, "random")) == {"equivalent"}


def test_the_order_that_turns_around_is_told(judged: Judged) -> None:
    text = judged(moved("simulated_fit", -0.5))

    assert "random > simulated_fit" in text
    assert "1, 1; 0 in both, 1 opposite" in text


def test_the_margin_is_a_share_of_the_papers_direct_or_of_the_given_one(judged: Judged) -> None:
    lean = {name: made for name, made in moved("random", -0.06).items() if name != "direct"}
    without = {name: made for name, made in PAPER.items() if name != "direct"}

    assert set(verdicts(judged(lean, without, direct=4.0), "random")) == {"equivalent"}


def test_without_a_direct_the_command_asks_for_its_fitness(judged: Judged) -> None:
    without = {name: made for name, made in PAPER.items() if name != "direct"}

    with pytest.raises(SystemExit, match="give its mean fitness with --direct"):
        judged(without, without)


def test_strategies_that_only_one_side_has_are_left_out(judged: Judged) -> None:
    with pytest.raises(SystemExit, match="no strategy is there with both presets"):
        judged({"simulated_fit": PAPER["simulated_fit"]}, {"random": PAPER["random"]})


def test_lean_costs_at_most_a_tenth_of_the_rollouts_of_the_paper() -> None:
    shares = {row[1].strip(): float(row[3]) for row in re.findall(r"(│)([^│]+)│([^│]+)│([^│]+)│", command("count"))}

    assert shares["paper"] == 1.0
    assert shares["lean"] <= 0.1
