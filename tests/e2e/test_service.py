"""From POST to curve through the real service: HTTP, database, Ray, physics."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gaplab.schemas.spec import StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Probed
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve_study
from tests.e2e.service import Service, wait_until

TOY = {
    "name": "toy",
    "robot": "toy_function",
    "strategies": ["simulated_fit_and_informative", "known_fit", "direct"],
    "iterations": 3,
    "repetitions": 4,
    "budget": {"controller_evaluations": 60, "selection_evaluations": 40, "simulator_evaluations": 40},
    "seed": 5,
}
SLOW_TOY = TOY | {"budget": {"controller_evaluations": 1_500, "selection_evaluations": 300}, "iterations": 2}
OWN = '''
"""A strategy."""

from gaplab.plugins import Strategy


class Own(Strategy):
    """The fittest."""

    name = "own"

    def select(self, belief, search, rng):
        return search(lambda genomes, fitnesses: fitnesses[:, 0])
'''
QUADRUPED = {
    "strategies": [
        "simulated_fit",
        {"name": "simulated_fit_and_informative", "options": {"simulators": 4}},
        "direct",
    ],
    "budget": {"controller_evaluations": 25, "selection_evaluations": 20, "simulator_evaluations": 20},
    "iterations": 1,
    "repetitions": 2,
}


@pytest.fixture
def service_in() -> Iterator[Any]:
    """Makes services, which are closed at the end."""
    made = []

    def make(folder: Path, **how: Any) -> Any:
        made.append(Service(folder, **how))
        return made[-1]

    yield make
    for each in made:
        each.close()


@pytest.fixture
def service(tmp_path: Path, service_in: Any) -> Any:
    return service_in(tmp_path)


def computed_here(spec: Any) -> Any:
    """Samples and recorded fitness of every experiment, computed in this process without any service."""
    experiments = []
    for resolved in resolve_study(StudySpec.model_validate(spec)):
        logs = [list(repetition(setting(resolved, number))) for number in range(resolved.repetitions)]
        experiments.append(
            {
                "recorded": [[step.recorded for step in log if isinstance(step, Probed)] for log in logs],
                "samples": [[step.sample.fitness for step in log if isinstance(step, Measured)] for log in logs],
            }
        )
    return experiments


def told_by(service: Any, study: Any) -> Any:
    """The same, as the service tells it."""
    experiments = []
    for curve in service.get(f"/studies/{study}/curves"):
        values = [point["values"] for point in curve["points"]]
        samples = service.get(f"/experiments/{curve['experiment']}/samples", kind="sample", limit=1000)["items"]
        by_repetition = [[] for _ in values[0]]  # type: ignore[var-annotated]
        for each in sorted(samples, key=lambda sample: (sample["repetition"], sample["iteration"])):
            by_repetition[each["repetition"]].append(each["fitness"])
        recorded = [list(row) for row in zip(*values, strict=True)]
        experiments.append({"recorded": recorded, "samples": by_repetition})
    return experiments


def test_a_toy_study_goes_from_post_to_curve_with_the_numbers_of_one_process(service: Any) -> None:
    service.start()

    study = service.post("/studies", TOY)["id"]

    ended = service.finish(f"/studies/{study}", within_s=200)
    assert ended["state"] == "COMPLETED"
    progress = ended["progress"]
    assert progress["rollouts_done"] + progress["rollouts_saved"] == progress["rollouts"]
    assert told_by(service, study) == computed_here(TOY)
    ids = [each["id"] for each in ended["experiments"]]
    assert len(service.get("/comparisons", experiment=ids)) == 3
    assert "<svg" in service.http.get("/figures/curves", params={"study": study, "format": "svg"}).text


def test_a_quadruped_study_on_pybullet_goes_from_post_to_curve(service: Any) -> None:
    service.start()

    study = service.post("/studies", QUADRUPED)["id"]

    ended = service.finish(f"/studies/{study}", within_s=300)
    assert ended["state"] == "COMPLETED"
    assert ended["progress"]["rollouts_failed"] == 0
    assert told_by(service, study) == computed_here(QUADRUPED)


def test_killed_in_the_middle_it_goes_on_where_it_was_with_the_same_numbers(service: Any) -> None:
    service.start()
    study = service.post("/studies", SLOW_TOY)["id"]
    wait_until(lambda: service.get(f"/studies/{study}")["progress"]["iterations_done"] >= 5, 60)

    service.kill()
    wait_until(lambda: not service.processes(), 30, service.processes)
    service.start()

    before = service.get(f"/studies/{study}")
    assert before["state"] == "RUNNING"
    assert before["progress"]["iterations_done"] >= 5
    assert service.finish(f"/studies/{study}", within_s=400)["state"] == "COMPLETED"
    assert told_by(service, study) == computed_here(SLOW_TOY)


@pytest.mark.parametrize("edited", [OWN.replace("fittest", "very fittest"), "class Own("])
def test_no_half_of_an_experiment_is_computed_with_a_strategy_that_was_edited_meanwhile(
    tmp_path: Path, service_in: Any, edited: Any
) -> None:
    own = tmp_path / "own.py"
    own.write_text(OWN)
    service = service_in(tmp_path, plugins=tmp_path)
    service.start()
    spec = {each: SLOW_TOY[each] for each in ("robot", "budget", "seed")} | {"repetitions": 3, "iterations": 5}
    path = f"/experiments/{service.post('/experiments', spec | {'strategy': 'own'})['id']}"
    wait_until(lambda: service.get(path)["progress"]["iterations_done"] >= 1, 60)

    own.write_text(edited)
    service.kill_repetitions()
    wait_until(lambda: service.log().count("another starts in") >= 1, 60, service.log)
    own.write_text(OWN.replace("fittest", "very fittest"))

    def refused() -> Any:
        return [each for each in service.get(path)["warnings"] if "strategy own (own.py" in each]

    wait_until(refused, 60, service.log)
    before = service.get(path)
    assert before["state"] == "RUNNING"
    assert before["progress"]["iterations_done"] < 3 * 6
    assert service.http.post(f"{path}/accept-versions").status_code == 200
    assert service.finish(path, within_s=200)["state"] == "COMPLETED"
    assert refused() == []
    first, second = service.get(f"{path}/provenance")["uses"]
    assert first["provenance"]["outside"] != second["provenance"]["outside"]


def test_stopped_in_order_it_leaves_no_process_behind(service: Any) -> None:
    service.start()
    service.post("/studies", SLOW_TOY)
    wait_until(lambda: service.get("/studies")["items"][0]["state"] == "RUNNING", 60)

    service.stop()

    wait_until(lambda: not service.processes(), 20, service.processes)
