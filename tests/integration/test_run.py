"""`gaplab.run`: a study without a service and without Ray, with the numbers of the service."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

import gaplab
from gaplab.api.library import running
from gaplab.schemas.lifecycle import State
from gaplab.schemas.spec import AnySpec
from gaplab.services.core.loop import repetition
from gaplab.services.core.strategies import strategies
from gaplab.services.experiments import reading
from gaplab.services.specs.assembly import setting
from gaplab.services.specs.resolution import resolve
from gaplab.services.store.models import RepetitionRow
from gaplab.services.store.queries.logs import logs
from gaplab.services.store.session import Store
from gaplab.services.store.sqlite_file import url_of
from tests.commands import Gaplab
from tests.fakes import flat
from tests.waiting import wait_until

SMALL: dict[str, Any] = {
    "robot": "toy_function",
    "iterations": 2,
    "repetitions": 2,
    "budget": {"controller_evaluations": 40, "selection_evaluations": 30, "simulator_evaluations": 30},
    "seed": 3,
}

LONG = SMALL | {
    "strategy": "random",
    "repetitions": 3,
    "iterations": 1,
    "budget": {"controller_evaluations": 4_000, "selection_evaluations": 300},
}

HARDWARE = """
from gaplab.services.engines.analytic import Analytic

class Rig(Analytic):
    name = "rig"
    repeatable = False
"""

ALONE = """
import signal, sys, gaplab
signal.signal(signal.SIGINT, signal.default_int_handler)  # what a shell starts in the background ignores it
result = gaplab.run({spec!r}, workers=1, path=sys.argv[1] if len(sys.argv) > 1 else None)
assert "ray" not in sys.modules
print(result.study.state)
"""


def computed(spec: Any) -> list[Any]:
    """The logs that follow from a spec, by experiment and repetition."""
    return [
        [[flat(step) for step in repetition(setting(each, number))] for number in range(each.repetitions)]
        for each in resolve(TypeAdapter(AnySpec).validate_python(spec))
    ]


def kept(path: Path, study: str) -> list[Any]:
    """The logs of a database, in the same order."""
    with Store(url_of(path)) as store, store.reading() as session:
        found = []
        for each in reading.read(store, study).experiments:
            rows = session.query(RepetitionRow).filter_by(experiment_id=each.id).order_by(RepetitionRow.number).all()
            by_id = logs(session, [row.id for row in rows])
            found.append([[flat(step) for step in by_id[row.id]] for row in rows])
        return found


def test_every_strategy_has_the_numbers_of_the_service() -> None:
    spec = SMALL | {"strategies": [name for name, each in strategies.items() if not each().senses]}  # a toy has none

    result = gaplab.run(spec, workers=2)

    assert result.study.state is State.COMPLETED
    assert kept(result.path, result.id) == computed(spec)


def test_a_result_has_the_tables_of_the_client_and_a_temporary_database_ends_with_it(tmp_path: Path) -> None:
    result = gaplab.run(SMALL | {"strategies": ["random", "informative"]}, workers=2)
    path, curve, samples = result.path, result.curve, result.samples

    assert list(curve["strategy"].unique()) == list(samples["strategy"].unique()) == ["random", "informative"]
    assert len(samples) == 2 * 2 * (2 + 3)
    assert set(result.simulators["iteration"]) == {0, 1, 2}
    assert result.verdict.sentences
    assert result.figure(of="curves").save(tmp_path / "curve.svg").read_bytes().startswith(b"<?xml")

    del result
    assert not path.exists()


def test_an_interrupted_run_goes_on_from_its_database_and_from_its_archive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = running._snapshots

    def interrupted(result: Any, supervisor: Any) -> Any:
        for snapshot in shown(result, supervisor):
            if snapshot.study.progress.iterations_done:
                raise KeyboardInterrupt
            yield snapshot

    monkeypatch.setattr(running, "_snapshots", interrupted)
    with pytest.raises(gaplab.Interrupted, match="goes on") as caught:
        gaplab.run(LONG, workers=1)
    monkeypatch.undo()
    stopped = caught.value.result
    archive = stopped.save(tmp_path / "stopped.zip")
    assert not stopped.study.state.ended

    first, second = gaplab.run(stopped.path, workers=2), gaplab.run(str(archive), workers=2)

    assert first.id == stopped.id
    assert kept(first.path, first.id) == kept(second.path, second.id) == computed(LONG)


def test_ctrl_c_and_a_killed_worker_lose_nothing(tmp_path: Path) -> None:
    """The program has no `if __name__ == "__main__"`, and does not start again in its workers."""
    program, path = tmp_path / "program.py", tmp_path / "study.db"
    program.write_text(ALONE.format(spec=LONG))
    shell = subprocess.Popen([sys.executable, program, path], stderr=subprocess.PIPE, text=True)
    worker = f"pgrep -P {shell.pid} -f process_tasks"

    def workers() -> list[str]:
        return subprocess.run(worker.split(), capture_output=True, text=True, check=False).stdout.split()

    def begun() -> bool:
        with Store(url_of(path)) as store, store.reading() as session:
            return any(row.iterations_done for row in session.query(RepetitionRow))

    wait_until(lambda: path.exists() and workers() and begun())
    os.kill(int(workers()[0]), signal.SIGKILL)
    wait_until(workers)
    shell.send_signal(signal.SIGINT)
    _, said = shell.communicate()

    assert f"what is complete is in {path}, and gaplab.run('{path}') goes on" in said
    assert workers() == []
    result = gaplab.run(path)
    assert kept(path, result.id) == computed(LONG)


def test_what_a_service_refuses_is_refused_in_its_words(tmp_path: Path) -> None:
    with pytest.raises(gaplab.ServiceError, match=r"unknown strategy 'informativ' \(did you mean 'informative'"):
        gaplab.run(SMALL | {"strategy": "informativ"})
    with pytest.raises(gaplab.ServiceError, match="/iterations: iterations must be at least 0, not -3") as several:
        gaplab.run(SMALL | {"iterations": -3, "sed": 1})
    assert len(several.value.problem.errors) == 2
    with pytest.raises(gaplab.InvalidSpec, match="/reality/kind: nobody is asked for measurements here"):
        gaplab.run(SMALL | {"strategy": "random", "reality": {"kind": "physical"}})
    with pytest.raises(ValueError, match="workers: at least 1, not 0"):
        gaplab.run(SMALL | {"strategy": "random"}, workers=0)
    with pytest.raises(IsADirectoryError, match="path: a database, not the folder"):
        gaplab.run(SMALL | {"strategy": "random"}, path=tmp_path)
    (tmp_path / "spec.json").write_text("{")
    with pytest.raises(ValueError, match=r"spec\.json is neither an archive, nor a database, nor JSON"):
        gaplab.run(tmp_path / "spec.json")


def test_hardware_moves_with_a_permit(tmp_path: Path, plug_ins: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rig.py").write_text(HARDWARE)
    monkeypatch.setenv("GAPLAB_PLUGINS", str(tmp_path))
    plug_ins(tmp_path)
    spec = SMALL | {"strategy": "random", "reality": {"engine": "rig", "parameters": {}}}

    result = gaplab.run(spec, workers=2)

    assert result.study.state is State.COMPLETED
    assert kept(result.path, result.id) == computed(spec)


def test_the_command_computes_a_study_and_writes_its_archive_and_figure(gaplab: Gaplab, tmp_path: Path) -> None:
    (tmp_path / "spec.json").write_text(json.dumps(SMALL | {"strategy": "random"}))
    archive, figure = tmp_path / "study.zip", tmp_path / "curve.pdf"

    said = gaplab("run", str(tmp_path / "spec.json"), "-o", str(archive), "-o", str(figure))

    assert said.code == 0
    assert "Random" in said.out
    assert "COMPLETED" in said.out
    assert figure.read_bytes().startswith(b"%PDF")
    assert "COMPLETED" in gaplab("run", str(archive)).out
