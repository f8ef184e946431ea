"""Answers of the command in small things: what is wrong, and what to do."""

import io
import logging
from pathlib import Path
from typing import Any

import pytest

import gaplab as package
from gaplab.api.commands.cli import app
from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.spec import StudySpec
from gaplab.services import logs
from gaplab.services.engines import engines
from gaplab.services.experiments import submission
from gaplab.services.plugins import loading
from gaplab.services.specs.defaults import default_engine
from gaplab.services.store.session import Store
from gaplab.services.world.robots.quadruped import Quadruped
from tests.commands import Gaplab

SMALL = {"strategies": ["random", "direct"], "robot": "toy_function", "budget": "smoke"}


def test_a_study_is_told_apart_from_an_unknown_experiment(gaplab: Gaplab, sqlite_store: Store, tmp_path: Path) -> None:
    study = submission.submit(sqlite_store, StudySpec.model_validate(SMALL))
    first = study.experiments[0].id

    drawn = gaplab("figure", "simulators", study.id, "--out", str(tmp_path / "a.svg"))

    assert drawn.code == Exit.NOT_FOUND
    assert f"'{study.id}' is a study, and this needs an experiment: {first} (random), " in drawn.err


def test_an_address_without_its_scheme_is_told_how_it_begins(gaplab: Gaplab) -> None:
    for address in ("localhost:8137", "gaplab.example.org", "ftp://127.0.0.1"):
        said = gaplab("list", "--url", address)

        assert said.code == Exit.UNREACHABLE
        assert f"like http://{address.removeprefix('ftp://')}" in said.err


def test_after_the_last_token_the_command_names_the_one_that_makes_another(gaplab: Gaplab, sqlite_url: str) -> None:
    database = {"GAPLAB_DATABASE_URL": sqlite_url}
    ids = []
    for _ in range(2):
        gaplab("token", "create", "--role", "admin", **database)
    for line in gaplab("token", "list", **database).out.splitlines():
        ids += [line.split()[0]] if "admin" in line else []

    first, last = (gaplab("token", "revoke", id, **database) for id in ids)

    assert first.err == ""
    assert "`gaplab token create --role admin`" in last.err


def test_the_version_is_printed_and_has_a_name(gaplab: Gaplab) -> None:
    assert gaplab("--version").out == f"gaplab {package.__version__}\n"


def test_every_command_is_in_a_group_of_the_help() -> None:
    groups: list[Any] = [*app.registered_commands, *app.registered_groups]

    assert [each.name or each.callback for each in groups if not isinstance(each.rich_help_panel, str)] == []


@pytest.mark.parametrize("terminal", [pytest.param(True, marks=pytest.mark.release), False])
def test_a_figure_and_a_report_log_no_fonts(
    gaplab: Gaplab, sqlite_store: Store, tmp_path: Path, terminal: bool
) -> None:
    study = submission.submit(sqlite_store, StudySpec.model_validate(SMALL))
    log = io.StringIO()
    log.isatty = lambda: terminal  # type: ignore[method-assign]
    root = logging.getLogger()
    before = root.handlers[:], root.level
    try:
        logs.configure(log)
        assert gaplab("figure", "curves", study.id, "--out", str(tmp_path / "a.pdf")).code == 0
        assert gaplab("report", study.id, "--save", str(tmp_path / "b.html")).code == 0
    finally:
        root.handlers[:] = before[0]
        root.setLevel(before[1])

    assert log.getvalue() == ""


def test_where_the_robots_engine_is_not_installed_another_of_gaplabs_own_runs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert default_engine(Quadruped()) == "pybullet"

    monkeypatch.setattr(engines["pybullet"], "available", classmethod(lambda _: False))

    assert default_engine(Quadruped()) == "mujoco"


PLUGIN = '''
from gaplab.plugins import Strategy


class {cls}(Strategy):
    """Select the known genome."""

    name = "{name}"
    searches = False

    def select(self, belief, search, rng):
        return belief.known
'''


@pytest.mark.usefixtures("plug_ins")
def test_a_file_that_is_not_a_plug_in_is_named(tmp_path: Path, gaplab: Gaplab) -> None:
    (tmp_path / "robot.urdf").write_text("<robot/>")
    (tmp_path / "robot.sdf").write_text("<sdf/>")
    (tmp_path / "data").mkdir()
    (tmp_path / "extra.py").write_text("X = 1\n")
    (tmp_path / "_shared.py").write_text("X = 1\n")
    (tmp_path / "used.py").write_text("X = 1\n")
    (tmp_path / "mine.py").write_text("from gaplab_plugins.used import X\n" + PLUGIN.format(cls="Mine", name="mine"))

    found = {each.file: each.why for each in loading.load((tmp_path,)).ignored}

    assert set(found) == {"data/", "extra.py", "robot.sdf", "robot.urdf"}
    assert "gaplab robot import FILE, then gaplab robot add (docs/how-to/robot-file.md)" in found["robot.urdf"]
    assert "make a URDF or an MJCF of it" in found["robot.sdf"]
    assert "robot.urdf is not used: it is not a Python module" in gaplab("catalogue").out
