"""The page's scripts: their own tests, what they know of the service, and what they must not know."""

import json
import os
import re
import subprocess
from pathlib import Path

from deno import find_deno_bin

from gaplab.schemas.lifecycle import PERMITTED, State
from gaplab.services.core.optimizers import optimizers
from gaplab.services.core.strategies import strategies
from gaplab.services.engines import engines
from gaplab.services.world.robots import robots
from gaplab.services.world.tunables import tunables

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "api" / "dashboard"
SCRIPTS = sorted(PAGE.rglob("*.js"))
TESTS = sorted((ROOT / "tests" / "page").glob("*.test.js"))
PLUGINS = sorted({name for registry in (strategies, robots, engines, optimizers, tunables) for name in registry})
IMPORT = re.compile(r'^(?:import|export)\b[^;]*?"(\.[^"]+)";', re.MULTILINE)


def deno(folder: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"DENO_DIR": str(folder), "DENO_NO_UPDATE_CHECK": "1", "NO_COLOR": "1"}
    return subprocess.run(
        [find_deno_bin(), *arguments], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )


def exported(folder: Path, script: str, name: str) -> object:
    """A constant of a script."""
    program = f"import {{ {name} }} from './api/dashboard/{script}'; console.log(JSON.stringify({name}));"
    done = deno(folder, "eval", program)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def named_plugins(text: str) -> list[str]:
    """The plug-ins that a script names: as a whole text, or anywhere if no English word is written so."""
    return [
        name
        for name in PLUGINS
        if re.search(rf"([\"'`]){name}\1", text) or ("_" in name and re.search(rf"\b{name}\b", text))
    ]


def imported(path: Path) -> list[Path]:
    return [(path.parent / found).resolve() for found in IMPORT.findall(path.read_text())]


def test_scripts_pass_their_tests(tmp_path: Path) -> None:
    done = deno(tmp_path, "test", "--no-check", *TESTS)

    assert done.returncode == 0, done.stdout + done.stderr
    ran = {name: int(count) for count, name in re.findall(r"running (\d+) tests? from ./tests/page/(\S+)", done.stdout)}
    assert set(ran) == {path.name for path in TESTS}
    assert 0 not in ran.values()
    assert f"ok | {sum(ran.values())} passed | 0 failed" in done.stdout


def test_no_script_names_a_plugin() -> None:
    found = {path.relative_to(PAGE).as_posix(): named_plugins(path.read_text()) for path in SCRIPTS}

    assert {name: names for name, names in found.items() if names} == {}


def test_names_of_plugins_would_be_found() -> None:
    text = "strategy === \"direct\"; // `known_fit`\nnames = ['toy_function', random]"

    assert named_plugins(text) == ["direct", "known_fit", "toy_function"]


def test_scripts_import_each_other_in_no_circle() -> None:
    left = {path: imported(path) for path in SCRIPTS}
    assert left[PAGE / "views" / "compare" / "pair_tables.js"]

    while left:
        free = [path for path, others in left.items() if not any(other in left for other in others)]
        assert free, f"among these is a circle: {sorted(path.relative_to(PAGE).as_posix() for path in left)}"
        for path in free:
            del left[path]


def test_the_page_permits_the_actions_that_the_service_permits(tmp_path: Path) -> None:
    permitted = exported(tmp_path, "views/study/actions.js", "PERMITTED")

    assert isinstance(permitted, dict)
    assert {action: set(states) for action, states in permitted.items()} == {
        action.value: {state.value for state in states} for action, states in PERMITTED.items()
    }


def test_the_page_knows_every_state(tmp_path: Path) -> None:
    assert exported(tmp_path, "lib/state_badge.js", "STATES") == [state.value for state in State]
    assert exported(tmp_path, "lib/state_badge.js", "ENDED") == [state.value for state in State if state.ended]
