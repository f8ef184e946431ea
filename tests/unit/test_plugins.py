"""Plug-ins from outside: found in a folder, told apart by their content, refused with a sentence if they are broken."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core import external_plugins
from gaplab.services.core.errors import PluginBroken
from gaplab.services.core.registry import Registry
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.core.tunables.base import Tunable
from gaplab.services.engines.base import Engine
from gaplab.services.plugins import folders

CAREFUL = '''
"""A strategy."""

import numpy as np

from gaplab.plugins import Strategy


class Careful(Strategy):
    """Stays in the middle."""

    name = "careful"
    searches = False

    def select(self, belief, search, rng):
        return (belief.space.lower + belief.space.upper) / 2
'''

Put = Callable[..., Path]


@pytest.fixture
def put(tmp_path: Path) -> Iterator[Put]:
    """Writes files into a folder, and lets plug-ins be looked for there."""

    def write(folder: str = "mine", /, **files: str) -> Path:
        home = tmp_path / folder
        home.mkdir(exist_ok=True)
        for name, text in files.items():
            (home / f"{name}.py").write_text(text)
        external_plugins.set_folders((*external_plugins.folders(), home))
        return home

    yield write
    external_plugins.set_folders(())


def strategies() -> Registry[Strategy]:
    return Registry("strategy", "gaplab.services.core.strategies", Strategy)  # type: ignore[type-abstract]


def test_a_file_in_the_folder_is_a_plug_in_among_gaplabs_own(put: Put) -> None:
    put(careful=CAREFUL)

    found = strategies()

    assert "careful" in found
    assert "informative" in found
    assert list(found) == sorted(found)
    assert found["careful"].describe().source == "careful.py of GAPLAB_PLUGINS"
    assert found["random"].describe().source.startswith("Paper")
    assert isinstance(found.create(PluginRef(name="careful")), Strategy)


def test_it_belongs_to_its_kind_only(put: Put) -> None:
    put(careful=CAREFUL)

    assert "careful" not in Registry("tunable", "gaplab.services.core.tunables", Tunable)  # type: ignore[type-abstract]


def test_files_import_from_each_other_and_one_with_an_underscore_is_only_for_that(put: Put) -> None:
    put(
        _middle=CAREFUL.replace('"careful"', '"hidden"'),
        careful="from gaplab_plugins._middle import Careful as Middle\n\n\n"
        'class Careful(Middle):\n    """The same."""\n\n    name = "careful"\n',
    )

    assert "careful" in strategies()
    assert "hidden" not in strategies()


def test_folders_are_several_but_a_file_has_one_place(put: Put) -> None:
    put("mine", careful=CAREFUL)
    put("yours", brave=CAREFUL.replace("areful", "rave").replace("crave", "brave"))
    assert {"careful", "brave"} <= set(strategies())

    put("yours", careful=CAREFUL)

    with pytest.raises(PluginBroken, match=r"careful\.py is in .*mine and in .*yours"):
        list(strategies())


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("def (", r"broken\.py cannot be imported: SyntaxError"),
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("1 / 0", "ZeroDivisionError"),
        (CAREFUL.replace('"careful"', '"random"'), "has a strategy called 'random', but so has gaplab"),
        (CAREFUL.replace("def select", "def choose"), r"Careful in broken\.py does not define select"),
        (CAREFUL.replace('    name = "careful"\n', ""), "has no name for specs to use"),
        (CAREFUL.replace("searches = False", "Options = 7"), "cannot be described: AttributeError"),
    ],
)
def test_a_broken_file_is_a_sentence(put: Put, text: str, says: str) -> None:
    put(broken=text)

    with pytest.raises(PluginBroken, match=says):
        list(strategies())


def test_a_folder_that_is_not_there_is_a_sentence(tmp_path: Path) -> None:
    external_plugins.set_folders((tmp_path / "nowhere",))
    try:
        with pytest.raises(PluginBroken, match=r"there is no plug-in folder .*nowhere"):
            list(strategies())
    finally:
        external_plugins.set_folders(())


def test_what_is_in_the_folder_has_a_hash_and_files_that_python_keeps_have_none(put: Put) -> None:
    home = put(careful=CAREFUL)
    list(strategies())
    before, digest = folders.digests(), folders.digest()

    (home / "careful.py").write_text(CAREFUL + "\n# another\n")

    assert set(before) == {"careful.py"}
    assert folders.digests()["careful.py"] != before["careful.py"]
    assert folders.digest() != digest


def test_data_counts_in_a_package_and_not_beside_modules(put: Put) -> None:
    home = put(careful=CAREFUL)
    for folder, file in (("glide", "__init__.py"), ("glide", "friction.csv"), ("results", "curve.csv")):
        (home / folder).mkdir(exist_ok=True)
        (home / folder / file).write_text("1.0")
    (home / "gaplab.db").write_text("a database")

    assert set(folders.digests()) == {"careful.py", "glide/__init__.py", "glide/friction.csv"}


def test_a_package_may_have_its_plug_in_in_any_of_its_files(put: Put) -> None:
    package = put() / "thorough"
    package.mkdir()
    (package / "core.py").write_text(CAREFUL)
    (package / "__init__.py").write_text("from gaplab_plugins.thorough.core import Careful")

    found = strategies()["careful"]

    assert external_plugins.file_of(found) == "thorough/core.py"
    assert folders.digest_of("thorough/core.py") == folders.digest_of("thorough/__init__.py")


def test_the_content_of_a_package_is_all_that_is_in_it(put: Put) -> None:
    package = put(alone="") / "glide"
    package.mkdir()
    (package / "__init__.py").write_text(GLIDE)
    (package / "law.py").write_text("SPEED = 1.0")
    before, alone = folders.digest_of("glide/__init__.py"), folders.digest_of("alone.py")

    (package / "law.py").write_text("SPEED = 2.0")

    assert folders.digest_of("glide/__init__.py") != before
    assert folders.digest_of("alone.py") == alone == folders.digests()["alone.py"]


def test_without_folders_there_is_nothing_to_tell() -> None:
    assert folders.digests() == {}
    assert folders.digest() == "none"


ELSEWHERE = """
import os

from gaplab.services.plugins import folders
from gaplab.services.running.versions import provenance, versions
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.running.provenance import decisive

assert os.environ["GAPLAB_PLUGINS"] == "mine", "an import has changed the environment"
folders.find()
found = provenance()
print("careful" in [each.name for each in catalogue().strategies])
print(sorted(found.plugins) == ["careful.py", "glide.py"])
print(versions()["plug-ins"])
spec = {
    "engine": {"name": "glide"},
    "reality": {},
    "robot": {"name": "toy_function"},
    "optimizer": {"name": "steady_state"},
    "tunables": [],
}
for strategy in ("careful", "random"):
    print(decisive(found, spec | {"strategy": {"name": strategy}}))
"""

GLIDE = '''
"""An engine."""

from gaplab.services.engines.analytic import Analytic


class Glide(Analytic):
    """The analytic engine by another name."""

    name = "glide"
'''


def test_every_process_with_the_variable_has_them_and_their_content_decides_who_goes_on(tmp_path: Path) -> None:
    home = tmp_path / "mine"
    home.mkdir()
    (home / "careful.py").write_text(CAREFUL)
    (home / "glide.py").write_text(GLIDE)

    def ask() -> list[str]:
        environment = os.environ | {"GAPLAB_PLUGINS": "mine", "PYTHONPATH": str(Path(__file__).parents[2])}
        command = [sys.executable, "-c", ELSEWHERE]
        done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    before = ask()
    (home / "careful.py").write_text(CAREFUL.replace("the middle", "the very middle"))
    careful = ask()
    (home / "glide.py").write_text(GLIDE.replace("another name", "yet another name"))
    both = ask()

    assert before[:2] == careful[:2] == both[:2] == ["True", "True"]
    assert len({before[2], careful[2], both[2]}) == 3
    assert before[3].startswith("glide (glide.py ")
    assert ", strategy careful (careful.py " in before[3]
    assert len({before[3], careful[3], both[3]}) == 3
    assert before[4] == careful[4] != both[4]  # of an experiment with a strategy of gaplab's own


@pytest.mark.parametrize("module", ["gaplab.api", "gaplab.workers"])
def test_a_process_does_not_start_with_a_broken_plug_in(tmp_path: Path, module: str) -> None:
    (tmp_path / "broken.py").write_text("1 / 0")
    environment = os.environ | {"GAPLAB_PLUGINS": str(tmp_path), "GAPLAB_DATABASE_URL": "sqlite://", "GAPLAB_PORT": "1"}
    arguments = ["serve"] if module == "gaplab.workers" else []

    done = subprocess.run(
        [sys.executable, "-m", module, *arguments], env=environment, capture_output=True, text=True, check=False
    )

    assert done.returncode != 0
    assert "broken.py cannot be imported: ZeroDivisionError" in done.stderr
    assert "Traceback" not in done.stderr


def test_what_plug_ins_are_written_with_is_there() -> None:
    import gaplab.plugins

    assert gaplab.plugins.Strategy is Strategy
    assert gaplab.plugins.Engine is Engine
    assert gaplab.plugins.frozen([1]).dtype == np.float64
