"""External plug-ins that were edited or broken before a process started: experiments that name them wait."""

import pickle
import sys
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from gaplab.schemas.events import EventKind
from gaplab.schemas.lifecycle import State
from gaplab.schemas.sensitivity import SensitivitySpec
from gaplab.services import events
from gaplab.services.core.registry import EXTERNAL
from gaplab.services.core.strategies import strategies
from gaplab.services.events import WantedEvents
from gaplab.services.experiments import checks, reading
from gaplab.services.plugins.folders import VARIABLE, PluginDiffers
from gaplab.services.running import execution, provenance, sensitivity, versions
from gaplab.services.settings import Settings
from gaplab.services.specs.resolution import resolve_experiment
from gaplab.services.store.session import Store
from gaplab.services.world.robots import robots
from gaplab.workers import nodes
from gaplab.workers.cluster import cluster
from gaplab.workers.errors import ClusterUnusable
from gaplab.workers.expected import check_here
from gaplab.workers.plugins import FIRST_S, LONGEST_S, Plugins
from gaplab.workers.ray_tasks import RayTasks
from gaplab.workers.supervisor import Supervisor
from tests.experiments import some_log, submit_one, toy
from tests.fakes import CAREFUL
from tests.integration import test_workers

EDITED = CAREFUL.replace("the middle", "the very middle")
TYPO = CAREFUL.replace("rng):", "rng:")
WHY = "careful.py cannot be imported: SyntaxError: '(' was never closed (careful.py, line 15)"
CHANGING = """

import os

from gaplab.services.world.robots.toy_function import ToyFunction

if os.environ.get("CHANGES_GAPLAB"):
    true_fitness = ToyFunction.fitness
    ToyFunction.fitness = lambda self, seen: 2 * true_fitness(self, seen)
"""
GAIT = """
from gaplab.services.world.controllers.pulses import SquarePulses


class Gait(SquarePulses):
    name = "gait"
"""
WALKER = """
from gaplab.plugins import PluginRef
from gaplab.services.world.robots.quadruped import Quadruped


class Walker(Quadruped):
    name = "walker"
    usual_controller = PluginRef(name="gait")
"""
SLIPPERY = """
from gaplab.services.world.robots.toy_function import ToyFunction


class Slippery(ToyFunction):
    name = "slippery"
"""


def submit(store: Store, **changes: Any) -> str:
    return submit_one(store, toy(**{"repetitions": 2} | changes)).id


def claimed(store: Store, plugins: Plugins | None = None) -> list[str]:
    """The experiments that a supervisor claims, with as many claims as it likes; left out: one that starts now."""
    plugins = plugins or Plugins()
    return sorted({each.experiment_id for each in execution.claim(store, "me", 9, plugins.under, plugins.refused())})


def refusals(store: Store) -> list[Any]:
    return [*events.page(store, 0, WantedEvents(kinds=frozenset({EventKind.VERSIONS_REFUSED})), limit=9).items]


def begin(store: Store) -> str:
    """An experiment with a step, queued again."""
    id_ = submit(store, strategy="careful")
    (claim,) = execution.claim(store, "me", 1)
    execution.record(store, claim, next(some_log()))
    execution.hand_back(store, claim)
    return id_


def expected(strategy: str = "careful", **changes: Any) -> Any:
    """The versions that a process needs for a spec with this strategy, as this process has them now."""
    return Plugins(versions.versions()).expected(resolve_experiment(toy(strategy=strategy, **changes)))


@pytest.fixture
def process(put: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Lets this process be another, which has imported no plug-in yet, with a folder in its environment."""

    def begin(home: Path) -> None:
        monkeypatch.setenv(VARIABLE, str(home))
        for name in [name for name in sys.modules if name.partition(".")[0] == EXTERNAL]:
            del sys.modules[name]

    return begin


def test_a_process_is_refused_for_an_edit_of_a_plug_in_that_the_spec_names_and_does_not_import_it(
    put: Any, process: Any
) -> None:
    home = put(careful=CAREFUL, brave=CAREFUL.replace("careful", "brave"))
    wanted, others = expected(), expected("random")
    (home / "brave.py").write_text("class Brave(")
    process(home)
    check_here(wanted)

    (home / "careful.py").write_text(EDITED)
    check_here(wanted)  # this process has imported it
    process(home)
    with pytest.raises(PluginDiffers) as refused:
        check_here(wanted)

    assert "gaplab_plugins.careful" not in sys.modules
    assert set(refused.value.differences) == {"strategy careful"}
    assert wanted["plug-in strategy careful"] in str(refused.value)
    assert "start the service again if it was edited" in str(refused.value)
    assert str(pickle.loads(pickle.dumps(refused.value))) == str(refused.value)
    check_here(others)
    assert "careful" not in strategies


def test_a_process_that_cannot_import_a_named_plug_in_says_why(
    put: Any, process: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "of_the_head.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    home = put(careful=f"{CAREFUL}\nimport of_the_head\n")
    wanted = expected()
    (tmp_path / "of_the_head.py").unlink()
    del sys.modules["of_the_head"]
    process(home)

    with pytest.raises(PluginDiffers, match="No module named 'of_the_head'"):
        check_here(wanted)


def test_a_process_imports_what_the_spec_needs_alone(put: Any, process: Any, tmp_path: Path) -> None:
    noted = f"with open({str(tmp_path / 'imports')!r}, 'a') as file:\n    file.write('x')\n"
    brave = CAREFUL.replace("careful", "brave")
    home = put(careful=f"from gaplab_plugins import _shared\n{CAREFUL}", brave=brave, _shared=noted)
    wanted = expected()
    (tmp_path / "imports").unlink()
    process(home)

    check_here(wanted)
    check_here(wanted)

    assert ("careful" in strategies, "brave" in strategies) == (True, False)
    assert (tmp_path / "imports").read_text() == "x"
    assert "gaplab_plugins.brave" not in sys.modules


def test_an_edit_reaches_nothing_that_a_running_process_imports(put: Any) -> None:
    home = put(careful=CAREFUL, _later="X = 1")
    (home / "_later.py").write_text("X = 2")
    (home / "_new.py").write_text("X = 1")

    assert import_module("gaplab_plugins._later").X == 1
    with pytest.raises(ModuleNotFoundError, match="when the process started"):
        import_module("gaplab_plugins._new")
    assert "_later.py" in versions.provenance().plugins
    assert "_new.py" not in versions.provenance().plugins


def test_each_version_of_the_named_plug_ins_has_processes_of_its_own_and_without_any_all_share_theirs(put: Any) -> None:
    put(careful=CAREFUL)
    before = nodes.process_for(expected())
    put(other=CAREFUL.replace("careful", "brave"))
    beside = nodes.process_for(expected())
    put(careful=EDITED)

    assert before == beside != nodes.process_for(expected())
    assert nodes.process_for(expected("random")) == {}


def test_the_usual_controller_of_a_robot_is_needed_too_unless_the_spec_names_another(put: Any) -> None:
    put(walker=WALKER, gait=GAIT)

    usual, other = (
        {name for name in expected("random", robot="walker", controller=controller) if name.startswith("plug-in")}
        for controller in (None, "square_pulses")
    )

    assert usual == {"plug-in robot walker", "plug-in controller gait"}
    assert other == {"plug-in robot walker"}


@pytest.mark.release
def test_a_plug_in_that_changes_gaplab_changes_no_number_of_specs_that_do_not_name_it(
    put: Any, sqlite_store: Store, shared_ray: ExitStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared_ray.close()
    monkeypatch.setenv("GAPLAB_PLUGINS", str(put(careful=CAREFUL + CHANGING)))
    assert "careful" in strategies  # this process has imported it
    monkeypatch.setenv("CHANGES_GAPLAB", "in the processes of Ray")
    with cluster(Settings(workers=1)) as joined:
        monkeypatch.delenv("CHANGES_GAPLAB")
        supervisor = Supervisor(sqlite_store, lambda: 1, RayTasks(joined.versions))
        changed, plain = (toy(strategy=each, repetitions=1) for each in ("careful", "simulated_fit"))
        ids = [submit_one(sqlite_store, spec).id for spec in (changed, plain)]
        for each in ids:
            test_workers.run(supervisor, sqlite_store, each)

    ended = [test_workers.stored(sqlite_store, each) for each in ids]
    assert ended[0] != test_workers.expected(changed)
    assert ended[1] == test_workers.expected(plain)


def test_versions_of_gaplab_concern_all_work(put: Any) -> None:
    put(careful=CAREFUL)

    with pytest.raises(ClusterUnusable, match=r"the supervisor has gaplab 0\.0\.1"):
        check_here(expected() | {"gaplab": "0.0.1"})


def test_an_edit_holds_up_the_experiments_that_name_the_plug_in_and_no_other(store: Store, put: Any) -> None:
    put(careful=CAREFUL)
    named, other = begin(store), submit(store, strategy="random")

    put(careful=EDITED)

    assert claimed(store) == [other]
    (warning,) = reading.read_experiment(store, named).warnings
    assert "strategy careful (careful.py " in warning
    assert f"gaplab accept-versions {named}" in warning
    put(careful=CAREFUL)
    assert claimed(store) == [named]
    assert provenance.read(store, named).refused_by is None


def test_accepted_an_edited_plug_in_goes_on(store: Store, put: Any) -> None:
    put(careful=CAREFUL)
    named = begin(store)
    put(careful=EDITED)
    assert claimed(store) == []

    provenance.accept_versions(store, named)

    assert claimed(store) == [named]


def test_an_edit_of_what_a_plug_in_imports_counts_as_its_own(store: Store, put: Any) -> None:
    put(_middle="X = 1", careful=f"from ._middle import X\n{CAREFUL}")
    named = begin(store)

    put(_middle="X = 2")

    assert claimed(store) == []
    put(_middle="X = 1")
    assert claimed(store) == [named]


@pytest.mark.parametrize("begun", [True, False])
def test_an_experiment_whose_plug_in_is_broken_stays_queued_and_says_why(store: Store, put: Any, begun: bool) -> None:
    put(careful=CAREFUL)
    named = begin(store) if begun else submit(store, strategy="careful")
    other = submit(store, strategy="random")

    put(careful=TYPO)

    assert claimed(store) == [other]
    assert claimed(store) == []
    found = reading.read_experiment(store, named)
    assert found.state is (State.RUNNING if begun else State.QUEUED)
    assert [each for each in found.warnings if WHY in each and "start the service again" in each]
    assert [each.experiment for each in refusals(store)] == [named]
    put(careful=CAREFUL)
    assert claimed(store) == [named]
    assert reading.read_experiment(store, named).warnings == ()


def test_an_experiment_whose_plug_in_is_gone_stays_queued_as_well(store: Store, put: Any) -> None:
    home = put(careful=CAREFUL)
    named = submit(store, strategy="careful")
    (home / "careful.py").unlink()
    put()

    assert claimed(store) == []
    (warning,) = reading.read_experiment(store, named).warnings
    assert "strategy careful (unavailable: it is not installed)" in warning


def test_a_name_that_reads_like_a_reason_holds_up_nothing(store: Store, put: Any) -> None:
    put(careful=CAREFUL.replace('"careful"', '"random (unavailable: x"'))
    submit(store, strategy="random (unavailable: x")
    put(careful=TYPO)

    assert claimed(store) == []
    assert claimed(store) == []
    assert len(refusals(store)) == 1


def test_a_check_whose_robot_is_broken_waits_and_others_are_done(store: Store, put: Any) -> None:
    put(slippery=SLIPPERY)
    waiting = checks.admit(store, SensitivitySpec(robot="slippery", engine="analytic")).answer.id
    other = checks.admit(store, SensitivitySpec(robot="toy_function")).answer.id

    put(slippery="1 / 0")

    assert "slippery" not in robots
    assert sensitivity.claim(store, "me").id == other
    assert sensitivity.claim(store, "me") is None
    found = checks.read(store, waiting)
    assert found.state is State.QUEUED
    assert "robot slippery (unavailable: slippery.py cannot be imported: ZeroDivisionError" in found.reason
    put(slippery=SLIPPERY)
    assert sensitivity.claim(store, "me").id == waiting


def refused_by_a_process(store: Store, plugins: Plugins) -> str:
    """The experiment of a repetition that was claimed, and then refused by its process."""
    (claim,) = execution.claim(store, "me", 1, plugins.under, plugins.refused())
    version = versions.plugin_versions()["strategy careful"]
    refused = PluginDiffers({"strategy careful": "a process has another"}, {"strategy careful": version})
    plugins.hand_back(store, claim, refused)
    return claim.experiment_id


def test_what_a_process_refuses_waits_without_a_hot_loop_and_is_tried_again(store: Store, put: Any) -> None:
    put(careful=CAREFUL)
    now = [0.0]
    plugins = Plugins(clock=lambda: now[0])
    named, other = submit(store, strategy="careful"), submit(store, strategy="random")

    assert refused_by_a_process(store, plugins) == named
    assert claimed(store, plugins) == [other]
    (warning,) = reading.read_experiment(store, named).warnings
    assert "strategy careful (unavailable: a process has another)" in warning
    assert provenance.read(store, named).computed_with is None
    assert [each.state for each in reading.list_repetitions(store, named)] == [State.QUEUED] * 2

    tries = 0
    while now[0] < 1.9 * LONGEST_S:
        now[0] += FIRST_S
        if not plugins.refused():
            assert refused_by_a_process(store, plugins) == named
            tries += 1
    assert 4 <= tries <= 6
    now[0] += LONGEST_S
    assert claimed(store, plugins) == [named]


def test_a_supervisor_that_starts_tries_what_was_refused(store: Store, put: Any) -> None:
    put(careful=CAREFUL)
    plugins, named = Plugins(), submit(store, strategy="careful")
    refused_by_a_process(store, plugins)
    assert claimed(store, plugins) == []

    assert claimed(store) == [named]
