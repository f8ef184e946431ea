"""The tables that `benchmarks.findings` prints, from archives of experiments whose simulators a test made."""

from collections.abc import Iterator
from math import inf, nan
from pathlib import Path
from shutil import copyfileobj

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.archives import export
from gaplab.services.core.arrays import frozen
from gaplab.services.core.types import Cost, Measured, Probed, Sample, Selected, Simulator, Step, Transferred, Tuned
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.commands import module
from tests.experiments import run, submit_one, toy

GENOME = frozen([0.5])
WORSE = Simulator(frozen([1.9, 1.9]), 9.0)
BEST = Simulator(frozen([0.2, 0.6]), 0.02), Simulator(frozen([0.4, 1.0]), 0.18)


def log(best: Simulator, first: float = 0.1) -> Iterator[Step]:
    """Two samples, the first with this fitness, and this best simulator after each."""
    for iteration in range(3):
        if iteration:
            yield Selected(iteration, GENOME, Cost(30))
            yield Measured(iteration, Sample(GENOME, first if iteration == 1 else 0.1))
        yield Tuned(iteration, (best, WORSE), Cost(60) if iteration else Cost())
        yield Transferred(iteration, GENOME, 0.5, Cost(60))
        yield Probed(iteration, 0.5, 0.5)


def archive(store: Store, spec: ExperimentSpec, best: tuple[Simulator, ...], folder: Path, first: float = 0.1) -> Path:
    """An experiment whose repetitions have these best simulators, as `made.zip`."""
    made = submit_one(store, spec.model_copy(update={"repetitions": len(best)})).id
    for claim in execution.claim(store, "test", limit=len(best)):
        run(store, claim, log(best[claim.number], first))
    path = folder / "made.zip"
    with export(store, made).file as source, path.open("wb") as target:
        copyfileobj(source, target)
    return path


def tables(path: Path) -> dict[str, list[list[str]]]:
    """The cells of each printed table, by the first words of its title."""
    text = module("benchmarks.findings", path)
    found: dict[str, list[list[str]]] = {}
    title = ""
    for line in text.splitlines():
        if line.startswith("│"):
            found[title].append([cell.strip() for cell in line.split("│")[1:-1]])
        elif line.strip() and line.strip()[0].isalpha():
            title = " ".join(line.split()[:2])
            found[title] = []
    return found


def test_tunables_have_a_mean_and_a_deviation_and_simulators_an_error_per_sample(
    sqlite_store: Store, tmp_path: Path
) -> None:
    found = tables(archive(sqlite_store, toy(), BEST, tmp_path))

    first, last = found["Tunables of"]
    assert first == ["made", "1", "2", "0.3000 ± 0.1414  0.8000 ± 0.2828", "0.2828 ± 0.2000"]
    assert last == ["made", "2", "2", "0.3000 ± 0.1414  0.8000 ± 0.2828", "0.2000 ± 0.1414"]
    assert len(found["Median distance"]) == 3


def test_they_are_told_of_a_reality_in_another_engine_which_has_no_distance(
    sqlite_store: Store, tmp_path: Path
) -> None:
    spec = toy(robot="quadruped", engine="mujoco", reality={"engine": "pybullet"})

    found = tables(archive(sqlite_store, spec, BEST, tmp_path))

    assert [row[-1] for row in found["Tunables of"]] == ["0.2828 ± 0.2000", "0.2000 ± 0.1414"]
    assert not found["Median distance"]


def test_a_simulator_whose_physics_failed_has_no_error(sqlite_store: Store, tmp_path: Path) -> None:
    failed = BEST[0], Simulator(BEST[1].parameters, inf)

    found = tables(archive(sqlite_store, toy(), failed, tmp_path))

    assert found["Tunables of"][-1][2:] == ["2", "0.3000 ± 0.1414  0.8000 ± 0.2828", "0.1000"]


def test_a_repetition_without_a_sample_has_no_error_yet(sqlite_store: Store, tmp_path: Path) -> None:
    found = tables(archive(sqlite_store, toy(), BEST, tmp_path, first=nan))

    assert [row[-1] for row in found["Tunables of"]] == ["-", "0.2828 ± 0.2000"]
