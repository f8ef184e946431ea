"""Every plug-in keeps the contract of its kind, the day its file is there; `gaplab plugin check` asks the same."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.contract import checks
from gaplab.services.contract.checks import CHECKS, Check, check_file, results, write_skeleton
from gaplab.services.core.errors import GaplabError
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.engines import engines
from gaplab.services.plugins import loading
from gaplab.services.specs.registries import REGISTRIES


def own() -> Iterator[Any]:
    """Each check of each plug-in that is installed."""
    for kind, registry in REGISTRIES.items():
        for name, plugin in registry.items():
            if kind != "engine" or engines[name].available():
                for check in CHECKS[kind]:
                    yield pytest.param(plugin, check, id=f"{name}-{check.__name__}")


@pytest.mark.parametrize(("plugin", "check"), list(own()))
def test_each_plug_in_keeps_the_contract(plugin: type[Any], check: Check) -> None:
    check(plugin)


def test_each_kind_has_checks_with_a_promise() -> None:
    assert set(CHECKS) == set(REGISTRIES)
    for check in (check for of_kind in CHECKS.values() for check in of_kind):
        assert re.match(r"[A-Z]\w+s |Is ", checks.promise_of(check)), check


@pytest.mark.usefixtures("plug_ins")
def test_a_skeleton_of_each_kind_keeps_the_contract_at_once(tmp_path: Path) -> None:
    for kind in CHECKS:
        file = write_skeleton(kind, f"my_{kind}", tmp_path / kind)

        (found,) = check_file(file)

        assert (found.kind, found.name) == (kind, f"my_{kind}")
        assert [result for result in found.results if result.reason] == []
        assert found.passes
        with pytest.raises(FileExistsError):
            write_skeleton(kind, f"my_{kind}", tmp_path / kind)


@pytest.mark.parametrize("name", ["My", "9lives", "a-b", "class", "", "../x"])
def test_a_name_that_no_module_can_have_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(GaplabError, match="cannot be the name of a plug-in"):
        write_skeleton("strategy", name, tmp_path)


@pytest.mark.parametrize("name", ["none", "true", "false"])
def test_a_name_whose_class_would_be_a_word_of_python_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(GaplabError, match=f"its class would be {name.capitalize()}, a word of Python"):
        write_skeleton("strategy", name, tmp_path)

    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("plug_ins")
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("controller", "motion"),
        ("discrepancy", "frozen"),
        ("engine", "trajectory"),
        ("optimizer", "population"),
        ("robot", "motion"),
        ("strategy", "strategy"),
        ("tunable", "tunable"),
        ("tuner", "simulator"),
    ],
)
def test_a_skeleton_named_like_what_it_imports_keeps_the_contract(tmp_path: Path, kind: str, name: str) -> None:
    (found,) = check_file(write_skeleton(kind, name, tmp_path))

    assert (found.kind, found.name, found.passes) == (kind, name, True)


@pytest.mark.usefixtures("plug_ins")
def test_the_skeleton_of_an_engine_is_no_hardware(tmp_path: Path) -> None:
    (found,) = check_file(write_skeleton("engine", "my_engine", tmp_path))

    assert REGISTRIES["engine"][found.name].repeatable


@pytest.mark.usefixtures("plug_ins")
@pytest.mark.parametrize("scale", [0.1, 0.25])
def test_the_skeleton_of_a_discrepancy_reports_errors_in_the_unit_of_fitness(tmp_path: Path, scale: float) -> None:
    (found,) = check_file(write_skeleton("discrepancy", "my_discrepancy", tmp_path))
    discrepancy = REGISTRIES["discrepancy"].create(PluginRef(name=found.name, options={"scale": scale}))

    for away in (0.0, 0.05, scale, 0.3, 2.0):
        term = discrepancy.terms(np.array([[[1.0 + away]]]), np.array([[1.0]]), np.empty(0))[0, 0]
        assert term == pytest.approx(discrepancy.floor(away))
        assert discrepancy.error(term) == pytest.approx(away)


def test_a_name_that_is_taken_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GaplabError, match="already"):
        write_skeleton("strategy", "random", tmp_path)


BROKEN = '''
from gaplab.plugins import Strategy
import numpy as np


class Broken(Strategy):
    """No sentence"""

    name = "broken"

    def select(self, belief, search, rng):
        return np.array([np.random.random(), {gene}])
'''


@pytest.mark.usefixtures("plug_ins")
def test_a_broken_promise_is_told_with_its_reason(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN.format(gene="7.0"))

    (found,) = check_file(tmp_path / "broken.py")

    reasons = [result.reason for result in found.results if result.reason]
    assert not found.passes
    assert any("outside the bounds 0 to 1" in reason for reason in reasons)
    assert any("use only `rng`" in reason for reason in reasons)
    assert any("has searches = True, but searches 0 times" in reason for reason in reasons)
    assert any("end it with a full stop" in reason for reason in reasons)


@pytest.mark.usefixtures("plug_ins")
def test_an_error_of_the_plug_in_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN.format(gene="belief.nothing"))

    (found,) = check_file(tmp_path / "broken.py")

    assert "AttributeError: 'Belief' object has no attribute 'nothing' (broken.py, line 12)" in {
        result.reason for result in found.results
    }


@pytest.mark.usefixtures("plug_ins")
def test_a_file_that_cannot_be_used_says_why(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("from gaplab.plugins import Strategy\nimport nowhere\n")
    (tmp_path / "none.py").write_text("X = 1\n")

    (bad,) = check_file(tmp_path / "bad.py")

    assert bad.unusable is not None
    assert "nowhere" in bad.unusable
    with pytest.raises(GaplabError, match=r"none\.py has no plug-in; it needs a class of one of Strategy, "):
        list(check_file(tmp_path / "none.py"))
    with pytest.raises(FileNotFoundError):
        list(check_file(tmp_path / "absent.py"))


STRATEGY = BROKEN.format(gene="0.5")


@pytest.mark.usefixtures("plug_ins")
@pytest.mark.parametrize(
    ("place", "text", "says"),
    [
        ("_draft.py", STRATEGY, "its name begins with _, so it is only for other files to import"),
        ("hidden.py", STRATEGY.replace("class Broken", "class _Hidden"), "its class _Hidden begins with _"),
        ("my.strategy.py", STRATEGY, "a module cannot be imported by a name with a dot"),
        ("text.txt", STRATEGY, "it is not a Python module; put data"),
        ("folder/strategy.py", STRATEGY, "the folder has no __init__.py, so it is not a package"),
    ],
)
def test_a_file_whose_plug_in_is_not_imported_says_why(tmp_path: Path, place: str, text: str, says: str) -> None:
    file = tmp_path / place
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    checked = file.parent if place.startswith("folder") else file

    with pytest.raises(GaplabError, match=f"{re.escape(str(checked))} has no plug-in; {re.escape(says)}"):
        list(check_file(checked))
    ignored = loading.load((tmp_path,)).ignored
    assert [each.why.startswith(says) for each in ignored] == ([] if place[0] == "_" else [True])


@pytest.mark.usefixtures("plug_ins")
def test_the_first_file_of_a_package_is_the_package(tmp_path: Path) -> None:
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack" / "__init__.py").write_text(STRATEGY)

    for checked in ("pack", "pack/__init__.py"):
        assert [found.name for found in check_file(tmp_path / checked)] == ["broken"]


@pytest.mark.usefixtures("plug_ins")
@pytest.mark.parametrize(("checked", "other"), [("a", "b"), ("b", "a")])
def test_a_name_that_another_file_has_is_told_of_either_file(tmp_path: Path, checked: str, other: str) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.py").write_text(STRATEGY)

    (found,) = check_file(tmp_path / f"{checked}.py", (tmp_path,))

    assert found.unusable is not None
    assert found.unusable.startswith(f"{checked}.py has a strategy called 'broken', but so has {other}.py")


@pytest.mark.usefixtures("plug_ins")
def test_a_check_runs_no_file_that_the_checked_one_does_not_import(tmp_path: Path) -> None:
    plugins, drafts = tmp_path / "plugins", tmp_path / "drafts"
    file = write_skeleton("strategy", "my_strategy", drafts)
    write_skeleton("strategy", "my_strategy", plugins)
    file.write_text(f"{file.read_text()}\nfrom gaplab_plugins.beside import X  # noqa\n")
    (drafts / "beside.py").write_text("X = 1\n")
    (drafts / "analysis.py").write_text(f"open({str(tmp_path / 'moved')!r}, 'w').write('the robot')\n")

    (found,) = check_file(file, (plugins,))

    assert found.name == "my_strategy"
    assert found.passes
    assert not (tmp_path / "moved").exists()


@pytest.mark.usefixtures("plug_ins")
def test_a_check_knows_the_plug_ins_of_the_files_that_the_checked_one_imports(tmp_path: Path) -> None:
    robot = write_skeleton("robot", "my_robot", tmp_path)
    write_skeleton("controller", "my_controller", tmp_path)
    robot.write_text(f"{robot.read_text()}\nfrom gaplab_plugins import my_controller  # noqa\n")

    assert [found.name for found in check_file(robot)] == ["my_robot"]
    assert "my_controller" in REGISTRIES["controller"]


def test_a_tuner_that_divides_its_evaluations_by_nothing_is_told() -> None:
    class Careless(SearchTuner):
        """A tuner."""

        def divisor(self, samples: int) -> int:
            return samples

    assert "for 0 samples its divisor is 0" in {result.reason for result in results("tuner", Careless)}


def test_results_go_on_after_a_check_that_fails() -> None:
    class NoStrategy:
        pass

    found = list(results("strategy", NoStrategy))

    assert len(found) == len(CHECKS["strategy"])
    assert all(result.reason for result in found)
