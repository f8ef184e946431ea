"""From POST to curve through the real service: HTTP, database, Ray, physics.

One test of it is for every change: killed outright and told to stop, with the numbers of one process.
"""

import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from gaplab.schemas.spec import StudySpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.types import Measured, Probed
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.session import Store
from tests.e2e.service import Service
from tests.waiting import wait_until

TOY = {
    "name": "toy",
    "robot": "toy_function",
    "strategies": ["simulated_fit_and_informative", "known_fit", "direct"],
    "iterations": 2,
    "repetitions": 2,
    "budget": {"controller_evaluations": 200, "selection_evaluations": 60, "simulator_evaluations": 200},
    "seed": 5,
}
LONG_STEPS = {
    "robot": "toy_function",
    "strategies": ["random"],
    "iterations": 1,
    "repetitions": 6,
    "budget": {"controller_evaluations": 2_000_000, "selection_evaluations": 20, "simulator_evaluations": 20},
}
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
    for resolved in resolve(StudySpec.model_validate(spec)):
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
    for curve in service.get("/curves", study=study):
        values = [point["values"] for point in curve["points"]]
        samples = service.get(f"/experiments/{curve['experiment']}/samples", kind="sample", limit=1000)["items"]
        by_repetition = [[] for _ in values[0]]  # type: ignore[var-annotated]
        for each in sorted(samples, key=lambda sample: (sample["repetition"], sample["iteration"])):
            by_repetition[each["repetition"]].append(each["fitness"])
        recorded = [list(row) for row in zip(*values, strict=True)]
        experiments.append({"recorded": recorded, "samples": by_repetition})
    return experiments


def test_killed_it_goes_on_to_the_numbers_of_one_process_and_told_to_stop_it_hands_back_what_is_under_way(
    service: Any, tmp_path: Path
) -> None:
    service.start()
    study = service.post("/studies", TOY)["id"]
    wait_until(lambda: service.get(f"/studies/{study}")["progress"]["iterations_done"] >= 3)

    service.kill()
    wait_until(lambda: not service.processes(), otherwise=service.processes)
    service.start()

    assert service.get(f"/studies/{study}")["progress"]["iterations_done"] >= 3
    ended = service.finish(f"/studies/{study}")
    progress = ended["progress"]
    assert ended["state"] == "COMPLETED"
    assert progress["rollouts_done"] + progress["rollouts_saved"] == progress["rollouts"]
    assert told_by(service, study) == computed_here(TOY)
    ids = [each["id"] for each in ended["experiments"]]
    assert len(service.get("/comparisons", study=ids)) == 3
    assert "<svg" in service.http.get("/figures/curves", params={"study": study, "format": "svg"}).text

    long = service.get(f"/studies/{service.post('/studies', LONG_STEPS)['id']}")["experiments"][0]["id"]
    wait_until(lambda: stored(tmp_path, "SELECT sum(steps) FROM repetition WHERE experiment_id = :id", long)[0][0])
    service.stop(signal.SIGTERM)

    wait_until(lambda: not service.processes(), otherwise=service.processes)
    rows = stored(tmp_path, "SELECT state, attempts, losses FROM repetition WHERE experiment_id = :id", long)
    assert rows == [("QUEUED", 0, 0)] * 6
    assert stored(tmp_path, "SELECT count(*) FROM checkpoint")[0][0] > 0


def stored(folder: Path, query: str, experiment: str = "") -> Any:
    """Rows of the service's database."""
    store = Store(f"sqlite:///{folder / 'gaplab.db'}")
    with store.reading() as session:
        found = session.execute(text(query), {"id": experiment} if experiment else {}).all()
    store.dispose()
    return found


@pytest.mark.release
def test_a_quadruped_study_on_pybullet_goes_from_post_to_curve(service: Any) -> None:
    service.start()

    study = service.post("/studies", QUADRUPED)["id"]

    ended = service.finish(f"/studies/{study}")
    assert ended["state"] == "COMPLETED"
    assert ended["progress"]["rollouts_failed"] == 0
    assert told_by(service, study) == computed_here(QUADRUPED)


EDITED = OWN.replace("fittest", "very fittest")
QUICK = {"robot": "toy_function", "strategy": "random", "budget": "smoke", "repetitions": 1, "iterations": 1}


def own_begun(service: Any) -> Any:
    """The path of an experiment with the strategy of one's own, some iterations after it began."""
    spec = {each: TOY[each] for each in ("robot", "budget", "seed")} | {"repetitions": 2, "iterations": 4}
    path = f"/experiments/{service.post('/experiments', spec | {'strategy': 'own'})['id']}"
    wait_until(lambda: service.get(path)["progress"]["iterations_done"] >= 1)
    return path


def supervisors_that_broke(service: Any) -> int:
    """The number of supervisors that ended by themselves, but for those whose Ray did not start within its 30 s."""
    log = service.log()
    return log.count("another starts in") - log.count("exit code 1: Ray did not start")


@pytest.mark.release
def test_after_an_edit_a_service_of_an_author_starts_again_and_a_person_may_accept_it(
    tmp_path: Path, service_in: Any
) -> None:
    own = tmp_path / "own.py"
    own.write_text(OWN)
    service = service_in(tmp_path, plugins=tmp_path, arguments=("--reload",))
    service.start()
    path = own_begun(service)

    own.write_text(EDITED)
    wait_until(lambda: service.log().count("ready for") == 2, otherwise=service.log)
    wait_until(lambda: [each for each in service.get(path)["warnings"] if "strategy own (own.py" in each])
    quick = service.post("/experiments", QUICK)["id"]
    assert service.finish(f"/experiments/{quick}")["state"] == "COMPLETED"
    waiting = service.get(path)
    assert waiting["state"] == "RUNNING"
    assert waiting["progress"]["iterations_done"] < 2 * 5
    study = path.replace("experiments", "studies")
    assert service.http.post(f"{study}/accept-versions").status_code == 200
    ended = service.finish(path)
    assert (ended["state"], ended["warnings"]) == ("COMPLETED", [])
    first, *_, last = (each["provenance"]["outside"] for each in service.get(f"{path}/provenance")["uses"])
    assert first["strategy own"] != last["strategy own"]
    assert supervisors_that_broke(service) == 0


@pytest.mark.release
def test_after_an_edit_a_new_worker_computes_nothing_until_the_service_starts_again(
    tmp_path: Path, service_in: Any
) -> None:
    own = tmp_path / "own.py"
    own.write_text(OWN)
    service = service_in(tmp_path, plugins=tmp_path)
    service.start()
    path = own_begun(service)

    own.write_text(EDITED)
    service.kill_repetitions()
    told = "start the service again if it was edited"
    wait_until(lambda: [each for each in service.get(path)["warnings"] if told in each], otherwise=service.log)
    own.write_text(OWN)
    service.stop()
    service.start()

    ended = service.finish(path)
    assert (ended["state"], ended["warnings"]) == ("COMPLETED", [])
    assert (
        len({each["provenance"]["outside"]["strategy own"] for each in service.get(f"{path}/provenance")["uses"]}) == 1
    )


@pytest.mark.release
def test_a_plug_in_that_is_broken_when_the_service_starts_holds_up_its_own_experiments_alone(
    tmp_path: Path, service_in: Any
) -> None:
    own = tmp_path / "own.py"
    own.write_text(OWN)
    service = service_in(tmp_path, plugins=tmp_path)
    service.start()
    path = own_begun(service)
    service.stop()

    own.write_text("class Own(\n")
    service.start()
    why = "own.py cannot be imported: SyntaxError: '(' was never closed (own.py, line 1)"
    (entry,) = [each for each in service.get("/catalogue")["strategies"] if each["name"] == "own"]
    assert (entry["available"], entry["note"]) == (False, f"{why}; repair the file, and start the service again")
    refused = service.http.post("/experiments", json=QUICK | {"strategy": "own"})
    assert refused.status_code == 422
    assert why in refused.text
    quick = service.post("/experiments", QUICK)["id"]
    assert service.finish(f"/experiments/{quick}")["state"] == "COMPLETED"
    wait_until(lambda: [each for each in service.get(path)["warnings"] if why in each], otherwise=service.log)
    service.stop()

    own.write_text(OWN)
    service.start()
    ended = service.finish(path)
    assert (ended["state"], ended["warnings"]) == ("COMPLETED", [])
    assert supervisors_that_broke(service) == 0
