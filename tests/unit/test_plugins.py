"""Plug-ins from outside: found in a folder, told apart by their content, unavailable with a reason if broken."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.core.registry import Registry
from gaplab.services.core.strategies.base import Strategy
from gaplab.services.engines.base import Engine
from gaplab.services.plugins import contents, loading
from gaplab.services.specs.registries import REGISTRIES
from gaplab.services.world.tunables.base import Tunable
from tests.fakes import CAREFUL

ROOT = Path(__file__).parents[2]

Put = Callable[..., Path]


def strategies() -> Registry[Strategy]:
    return REGISTRIES["strategy"]


def tunables() -> Registry[Tunable]:
    return REGISTRIES["tunable"]


def test_a_file_in_the_folder_is_a_plug_in_among_gaplabs_own(put: Put) -> None:
    put(careful=CAREFUL)

    found = strategies()

    assert "careful" in found
    assert "informative" in found
    assert list(found) == sorted(found)
    sources = {each.name: each.source for each in found.describe()}
    assert sources["careful"] == "careful.py of GAPLAB_PLUGINS"
    assert sources["random"].startswith("Paper")
    assert isinstance(found.create(PluginRef(name="careful")), Strategy)


def test_it_belongs_to_its_kind_only(put: Put) -> None:
    put(careful=CAREFUL)

    assert "careful" not in tunables()


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

    found = strategies()
    assert "careful" not in found
    assert "brave" in found
    files = "mine/careful.py and yours/careful.py"
    assert found.unusable["careful"].startswith(f"{files} have the same name: rename one of them")


def test_of_folders_with_one_name_as_much_of_the_path_is_told_as_makes_them_differ(put: Put, tmp_path: Path) -> None:
    for home in ("first", "second"):
        (tmp_path / home / "plugins" / "careful").mkdir(parents=True)
        (tmp_path / home / "plugins" / "careful" / "__init__.py").write_text(CAREFUL)
        put(f"{home}/plugins")

    files = "first/plugins/careful and second/plugins/careful"
    assert strategies().unusable["careful"].startswith(f"{files} have the same name: rename one of them")


BROKEN = [
    ("def (", "broken", r"broken\.py cannot be imported: SyntaxError: invalid syntax \(broken\.py, line 1\)"),
    (CAREFUL.replace("numpy as", "numpy us"), "broken", r"SyntaxError: invalid syntax \(broken\.py, line 4\)"),
    ("import no_such_module", "broken", "ModuleNotFoundError: No module named 'no_such_module'"),
    (f"{CAREFUL}\n1 / 0", "careful", r"ZeroDivisionError: division by zero \(broken\.py, line 18\)"),
    ("raise SystemExit(3)", "broken", "SystemExit: 3"),
    ("raise ValueError('x' * 9_999)", "broken", "ValueError: x{200,290}…"),
    (
        CAREFUL.replace('"careful"', '"random"'),
        "random (broken.py)",
        "has a strategy called 'random', but so has gaplab",
    ),
    (CAREFUL.replace("def select", "def choose"), "careful", r"Careful in broken\.py does not define select"),
    (CAREFUL.replace('    name = "careful"\n', ""), "broken", "has no name for specs to use"),
    (CAREFUL.replace("searches = False", "Options = 7"), "careful", "has Options that accept misspelt names"),
    (CAREFUL.replace("searches = False", "details = {1, 2}.pop"), "careful", "cannot be described: "),
]


@pytest.mark.parametrize(("text", "name", "says"), BROKEN)
def test_a_broken_file_is_unavailable_with_the_reason_and_stops_nothing_else(
    put: Put, text: str, name: str, says: str
) -> None:
    put(broken=text, brave=CAREFUL.replace("careful", "brave"))

    found = strategies()

    assert {"brave", "random", "informative"} <= set(found)
    assert name not in found
    (entry,) = [each for each in found.describe() if not each.available]
    assert (entry.name, entry.source) == (name, "broken.py of GAPLAB_PLUGINS")
    assert re.search(says, entry.note)
    assert entry.note.endswith("; repair the file, and start the service again")
    with pytest.raises(InvalidSpec, match=f"'{re.escape(name)}' is not available: ") as refused:
        found.create(PluginRef(name=name), "/strategy")
    assert refused.value.violations[0].pointer == "/strategy"
    assert entry.note in refused.value.violations[0].message


def test_a_file_that_cannot_be_imported_counts_among_the_kind_that_its_classes_tell(put: Put) -> None:
    put(friction='import nowhere\n\n\nclass Law(MaterialTunable):\n    name: str = "law"\n', unknown="def (")

    assert set(strategies().unusable) == {"unknown"}
    assert set(tunables().unusable) == {"law", "unknown"}


def test_two_files_with_plug_ins_of_one_name_are_both_unavailable(put: Put) -> None:
    put(first=CAREFUL, second=CAREFUL)

    found = strategies()

    assert "careful" not in found
    assert found.unusable["careful"].startswith("first.py has a strategy called 'careful', but so has second.py")
    second = found.unusable["careful (second.py)"]
    assert second.startswith("second.py has a strategy called 'careful', but so has first.py")


def test_two_plug_ins_of_one_name_in_a_file_are_both_unavailable(put: Put) -> None:
    put(twice=CAREFUL + CAREFUL.replace("class Careful", "class Other"))

    why = "twice.py has a strategy called 'careful', but so has another class in it: rename one of them"
    assert strategies().unusable["careful"].startswith(why)


def test_what_imports_a_broken_file_is_unavailable_as_well(put: Put) -> None:
    put(_middle="1 / 0", careful=f"from gaplab_plugins._middle import X\n{CAREFUL}")

    assert "ZeroDivisionError: division by zero (_middle.py, line 1)" in strategies().unusable["careful"]


def test_a_plug_in_that_cannot_be_created_is_a_violation_of_its_spec(put: Put) -> None:
    text = CAREFUL.replace("searches = False", "Options = DiverseOptions")
    text = text.replace("import Strategy", "import DiverseOptions, Strategy")
    refusal = "if options and options.simulators == 9: raise KeyError('oops')"
    put(careful=f"{text}\n    def __init__(self, options=None):\n        {refusal}\n")

    with pytest.raises(InvalidSpec, match=r"'careful' cannot be created .*KeyError: 'oops' \(careful\.py, line 19\)"):
        strategies().create(PluginRef(name="careful", options={"simulators": 9}))


def test_a_folder_that_is_not_there_is_empty(tmp_path: Path, plug_ins: Callable[..., None]) -> None:
    plug_ins(tmp_path / "nowhere")

    assert strategies().unusable == {}
    assert loading.here().contents.digests == {}


def test_what_is_in_the_folder_has_a_hash_and_files_that_python_keeps_have_none(put: Put) -> None:
    home = put(careful=CAREFUL)
    before = contents.read([home]).digests

    (home / "careful.py").write_text(CAREFUL + "\n# another\n")

    assert set(before) == {"careful.py"}
    assert contents.read([home]).digests["careful.py"] != before["careful.py"]


@pytest.mark.parametrize(
    ("statement", "file"),
    [
        ("from gaplab_plugins._middle import X", "_middle.py"),
        ("from gaplab_plugins import _middle", "_middle.py"),
        ("import gaplab_plugins._middle as middle", "_middle.py"),
        ("from ._middle import X", "_middle.py"),
        ("def later():\n    from . import _middle", "_middle.py"),
        ("from gaplab_plugins.glide.law import X", "glide/__init__.py"),
        ("from gaplab_plugins._outer import X", "_middle.py"),
        ("import_module(name)", "_middle.py"),
        ("importlib.import_module(name)", "_middle.py"),
    ],
)
def test_the_text_of_a_plug_in_has_all_that_it_imports_from_the_folders(put: Put, statement: str, file: str) -> None:
    home = put(_middle="X = 1", _outer="from ._middle import X", careful=statement, alone="import numpy, json")
    (home / "glide").mkdir()
    (home / "glide" / "__init__.py").write_text("")
    (home / "glide" / "law.py").write_text("from ..careful import later")
    before = contents.read([home])

    edited = home / ("glide/law.py" if file.startswith("glide") else file)
    edited.write_text(f"{edited.read_text()}\n# another\n")
    after = contents.read([home])

    assert f", {file} " in before.text_of("careful.py")
    assert before.text_of("careful.py") != after.text_of("careful.py")
    assert before.text_of("alone.py") == after.text_of("alone.py") == f"alone.py {before.digest_of('alone.py')}"
    assert before.text_of("gone.py") is None


def test_data_counts_in_a_package_and_not_beside_modules(put: Put) -> None:
    home = put(careful=CAREFUL)
    for folder, file in (("glide", "__init__.py"), ("glide", "friction.csv"), ("results", "curve.csv")):
        (home / folder).mkdir(exist_ok=True)
        (home / folder / file).write_text("1.0")
    (home / "gaplab.db").write_text("a database")

    assert set(contents.read([home]).digests) == {"careful.py", "glide/__init__.py", "glide/friction.csv"}


def test_a_package_may_have_its_plug_in_in_any_of_its_files(put: Put) -> None:
    package = put() / "thorough"
    package.mkdir()
    (package / "core.py").write_text(CAREFUL)
    (package / "__init__.py").write_text("from gaplab_plugins.thorough.core import Careful")

    put()

    assert strategies().files["careful"] == "thorough/core.py"
    found_here = loading.here().contents
    assert found_here.digest_of("thorough/core.py") == found_here.digest_of("thorough/__init__.py")


def test_the_content_of_a_package_is_all_that_is_in_it(put: Put) -> None:
    home = put(alone="")
    package = home / "glide"
    package.mkdir()
    (package / "__init__.py").write_text(GLIDE)
    (package / "law.py").write_text("SPEED = 1.0")
    before = contents.read([home])

    (package / "law.py").write_text("SPEED = 2.0")

    after = contents.read([home])
    assert after.digest_of("glide/__init__.py") != before.digest_of("glide/__init__.py")
    assert after.digest_of("alone.py") == before.digest_of("alone.py") == after.digests["alone.py"]


ELSEWHERE = """
import os

from gaplab.services.plugins import folders
from gaplab.services.running.versions import named_versions, provenance
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.running.provenance import decisive

assert os.environ["GAPLAB_PLUGINS"] == "mine", "an import has changed the environment"
folders.load()
found = provenance()
print("careful" in [each.name for each in catalogue().strategies])
print(sorted(found.plugins) == ["careful.py", "glide.py"])
spec = {
    "engine": {"name": "glide"},
    "reality": {"engine": None},
    "robot": {"name": "toy_function"},
    "optimizer": {"name": "steady_state"},
    "tunables": [],
}
for strategy in ("careful", "random"):
    named = spec | {"strategy": {"name": strategy}}
    print(decisive(found, named))
    print(named_versions(found, named))
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
        environment = os.environ | {"GAPLAB_PLUGINS": "mine", "PYTHONPATH": str(ROOT)}
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
    assert before[2].startswith("glide (glide.py ")
    assert ", strategy careful (careful.py " in before[2]
    assert len({before[2], careful[2], both[2]}) == len({before[3], careful[3], both[3]}) == 3
    assert before[4:] == careful[4:] != both[4:]  # of an experiment with a strategy of gaplab's own


def test_a_process_starts_with_broken_plug_ins_and_warns_once(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text("1 / 0")
    missing = tmp_path / "nowhere"
    loading_twice = "folders.load(warn=True)\nfolders.load(warn=True)"
    program = f"from gaplab.services.plugins import folders\n{loading_twice}\nprint('started')"
    environment = os.environ | {"GAPLAB_PLUGINS": f"{tmp_path}{os.pathsep}{missing}"}

    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False, cwd=ROOT
    )

    assert done.stdout == "started\n"
    assert (
        done.stderr.count("broken.py cannot be imported: ZeroDivisionError: division by zero (broken.py, line 1)") == 1
    )
    assert done.stderr.count(f"there is no plug-in folder {missing}, which GAPLAB_PLUGINS names") == 1
    assert "Traceback" not in done.stderr


def test_what_plug_ins_are_written_with_is_there() -> None:
    import gaplab.plugins

    assert gaplab.plugins.Strategy is Strategy
    assert gaplab.plugins.Engine is Engine
    assert gaplab.plugins.frozen([1]).dtype == np.float64
