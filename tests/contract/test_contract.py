"""Every plug-in keeps the contract of its kind, the day its file is there; `gaplab plugin check` asks the same."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gaplab.services.contract import checks
from gaplab.services.contract.checks import CHECKS, Check, results
from gaplab.services.contract.files import check_file, write_skeleton
from gaplab.services.core import external_plugins
from gaplab.services.core.errors import GaplabError
from gaplab.services.core.tuners.search import SearchTuner
from gaplab.services.engines import engines
from gaplab.services.plugins.external import REGISTRIES


def own() -> Iterator[Any]:
    """Each check of each plug-in that is installed."""
    for kind, registry in REGISTRIES.items():
        for name, plugin in registry.items():
            if kind != "engine" or engines[name].available():
                for check in CHECKS[kind]:
                    yield pytest.param(plugin, check, id=f"{name}-{check.__name__}")


@pytest.fixture
def restored() -> Iterator[None]:
    """Sets the plug-in folders as they were before."""
    before = external_plugins.named_folders()
    yield
    external_plugins.set_folders(before)


@pytest.mark.parametrize(("plugin", "check"), list(own()))
def test_each_plug_in_keeps_the_contract(plugin: type[Any], check: Check) -> None:
    check(plugin)


def test_each_kind_has_checks_with_a_promise() -> None:
    assert set(CHECKS) == set(REGISTRIES)
    for check in (check for of_kind in CHECKS.values() for check in of_kind):
        assert re.match(r"[A-Z]\w+s |Is ", checks.promise_of(check)), check


@pytest.mark.usefixtures("restored")
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


@pytest.mark.usefixtures("restored")
def test_a_broken_promise_is_told_with_its_reason(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN.format(gene="7.0"))

    (found,) = check_file(tmp_path / "broken.py")

    reasons = [result.reason for result in found.results if result.reason]
    assert not found.passes
    assert any("outside the bounds 0 to 1" in reason for reason in reasons)
    assert any("use only `rng`" in reason for reason in reasons)
    assert any("has searches = True, but searches 0 times" in reason for reason in reasons)
    assert any("end it with a full stop" in reason for reason in reasons)


@pytest.mark.usefixtures("restored")
def test_an_error_of_the_plug_in_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN.format(gene="belief.nothing"))

    (found,) = check_file(tmp_path / "broken.py")

    assert "AttributeError: 'Belief' object has no attribute 'nothing' (broken.py, line 12)" in {
        result.reason for result in found.results
    }


@pytest.mark.usefixtures("restored")
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


@pytest.mark.usefixtures("restored")
def test_a_check_runs_no_file_that_the_checked_one_does_not_import(tmp_path: Path) -> None:
    plugins, drafts = tmp_path / "plugins", tmp_path / "drafts"
    file = write_skeleton("strategy", "my_strategy", drafts)
    write_skeleton("strategy", "my_strategy", plugins)
    file.write_text(f"{file.read_text()}\nfrom gaplab_plugins.beside import X  # noqa\n")
    (drafts / "beside.py").write_text("X = 1\n")
    (drafts / "analysis.py").write_text(f"open({str(tmp_path / 'moved')!r}, 'w').write('the robot')\n")
    external_plugins.set_folders((plugins,))

    (found,) = check_file(file)

    assert found.name == "my_strategy"
    assert found.passes
    assert not (tmp_path / "moved").exists()


@pytest.mark.usefixtures("restored")
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
