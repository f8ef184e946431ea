"""The arrows between the layers, and the sizes of things, read from the source itself."""

import ast
import re
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
OURS = ("schemas", "services", "workers", "api", "migrations")
MODULES = sorted(path.relative_to(ROOT) for top in (*OURS, "src") for path in (ROOT / top).rglob("*.py"))
PHYSICS = {"pybullet", "mujoco", "numba", "sapien"}
ON_DEMAND = {"pandas", "matplotlib"}  # heavy: the API imports it inside functions alone
WEB = {"fastapi", "starlette", "pydantic", "anyio", "prometheus_client"}

ROOMS = {
    "core": ((), {"numpy", "scipy", "pydantic"}),
    "world": (("core", "csv_tables"), {"numpy", "scipy", "pydantic"}),
    "engines": (("core", "world"), {"numpy", "pydantic"}),
    "robots": (("core", "world", "engines"), {"numpy", "scipy", "pydantic", "lxml"}),
    "figures": ((), {"matplotlib", "jinja2"}),
    "findings": (("core", "world", "figures"), {"numpy", "scipy"}),
    "specs": (("core", "world", "engines", "findings", "csv_tables"), {"numpy"}),
    "store": (("core", "world", "specs"), {"sqlalchemy", "psycopg"}),
    "plugins": (("core", "world", "engines", "specs"), {"pydantic"}),
    "contract": (("core", "world", "engines", "specs", "plugins"), {"numpy"}),
    "experiments": (
        ("core", "world", "engines", "findings", "store", "specs", "plugins", "settings"),
        {"sqlalchemy", "lark", "markdown_it"},
    ),
    "measuring": (
        ("core", "world", "findings", "store", "specs", "experiments", "settings", "csv_tables"),
        {"sqlalchemy"},
    ),
    "running": (("core", "engines", "store", "plugins", "experiments", "measuring"), {"sqlalchemy"}),
    "results": (
        ("core", "world", "figures", "findings", "store", "specs", "experiments", "csv_tables"),
        {"numpy"},
    ),
    "replay": (
        ("core", "world", "store", "specs", "plugins", "experiments", "waiting_line"),
        {"numpy", "scipy"},
    ),
    "notifications": (("core", "store", "experiments", "settings"), {"sqlalchemy", "httpx2"}),
    "archives": (
        (
            *("core", "world", "engines", "store", "specs", "plugins", "experiments", "running", "results"),
            *("settings", "nesting"),
        ),
        {"numpy", "pydantic"},
    ),
    "reports": (
        (
            *("core", "world", "engines", "figures", "findings", "store", "specs", "experiments", "measuring"),
            *("running", "results", "replay", "csv_tables"),
        ),
        {"numpy", "jinja2"},
    ),
}
"""Rooms of services, each below those that may import it: what of services each may import, and what of others."""

TOOLS = {"settings", "waiting_line", "csv_tables", "nesting"}
"""Modules of services, besides rooms, that rooms may import."""

MIGRATES = {"archives": ("migrations",)}
"""The room of services that migrates what it reads."""

# code in -> what of ours it may import, and what of others; the first prefix that fits counts
ARROWS = {
    "schemas": (("schemas",), {"pydantic", "pydantic_core"}),
    **{
        f"services/{room}": (
            ("schemas", *MIGRATES.get(room, ()), *(f"services.{each}" for each in (room, *below))),
            others,
        )
        for room, (below, others) in ROOMS.items()
    },
    "services": (
        ("schemas", "services.core", "services.findings", "services.plugins", "services.store"),
        {"pydantic", "sqlalchemy"},
    ),
    "workers": (("schemas", "services", "workers"), {"numpy", "ray"}),
    "api/http": (("schemas", "services", "api.http"), WEB | {"fastapi_offline"}),
    "api/routes": (("schemas", "services", "api.http", "api.routes"), WEB),
    "api/app.py": (("services", "api.http", "api.routes"), {"fastapi"}),
    "api/process": (("services", "migrations", "api.app", "api.clients", "api.process"), {"fastapi", "uvicorn", "h11"}),
    "api/clients": (
        (
            "schemas",
            *map("services.{}".format, ("settings", "csv_tables", "figures", "findings.tables")),
            "api.clients",
        ),
        ON_DEMAND | {"httpx2", "pydantic", "rich"},
    ),
    "api/library": (
        ("schemas", "services", "workers", "samples", "api.app", "api.clients", "api.process", "api.library"),
        ON_DEMAND | {"httpx2", "numpy", "pydantic", "rich"},
    ),
    "api/commands": (
        ("schemas", "services", "api.clients", "api.library", "api.process", "api.commands"),
        {"typer", "rich", "httpx2", "pydantic"},
    ),
    "api": (("services", "api.process"), set()),
    "src": (
        (
            "schemas",
            *map("services.{}".format, ("core", "world", "engines", "plugins", "specs", "replay", "csv_tables")),
            "api",
            "samples",
        ),
        set(),
    ),
    "migrations": (
        ("services.core.errors", "services.settings", "services.store", "migrations"),
        {"alembic", "sqlalchemy"},
    ),
}
ARITHMETIC = "arithmetic"
"""Module of ours that all code may import: it comes before NumPy."""

IMPURE = {
    "os",
    "sys",
    "sqlite3",
    "time",
    "datetime",
    "random",
    "threading",
    "logging",
    "pickle",
    "secrets",
    "uuid",
    "io",
    "socket",
}


@cache
def tree(path: Path) -> ast.Module:
    """The file as a syntax tree, parsed once for all rules."""
    return ast.parse((ROOT / path).read_text())


@cache
def imports(path: Path) -> frozenset[str]:
    """Every module that the file imports, inside functions too."""
    found = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            found.add(node.module)
    return frozenset(found)


def tops_of(path: Any) -> Any:
    """The packages that the file imports something of."""
    return {module.partition(".")[0] for module in imports(path)}


def name_of(path: Path) -> str:
    """Return the dotted name of a file's module, without `gaplab`."""
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__").removeprefix("src.gaplab.")


def rule(path: Any) -> Any:
    return next(rule for prefix, rule in ARROWS.items() if f"{path.as_posix()}/".startswith(f"{prefix}/"))


def is_under(module: Any, allowed: Any) -> Any:
    return any(module == each or module.startswith(f"{each}.") for each in allowed)


def permitted(module: str, ours: Any, others: Any) -> bool:
    """Whether a module that others or we wrote is one of those; ours are called `gaplab.` and no other name."""
    top = module.partition(".")[0]
    if top == "gaplab":
        return is_under(module.removeprefix("gaplab."), (*ours, ARITHMETIC))
    return top in others or (top in sys.stdlib_module_names and top not in OURS)


def test_imports_follow_the_arrows() -> None:
    wrong = [(str(path), module) for path in MODULES for module in imports(path) if not permitted(module, *rule(path))]

    assert wrong == [], "these modules may not import these"


def test_each_room_of_services_imports_only_rooms_before_it() -> None:
    """So there is no circle of rooms."""
    order = [*ROOMS, *TOOLS]

    for room, (below, _) in ROOMS.items():
        assert all(each in TOOLS or order.index(each) < order.index(room) for each in below), room
    folders = {path.parent.name for path in (ROOT / "services").glob("*/__init__.py")}
    assert folders == set(ROOMS)


def test_the_guide_names_the_rooms_in_their_order_and_those_that_write_sql() -> None:
    guide = " ".join((ROOT / "services" / "README.md").read_text().split())
    writers, others = re.findall(r"called with a store\. (.*) may write SQL|before it in this list: (.*)\.", guide)
    sql = {path.parts[1] for path in MODULES if path.parts[0] == "services" and "sqlalchemy" in tops_of(path)}

    assert re.findall(r"`(\w+)`", others[1]) == list(ROOMS)
    assert set(re.findall(r"`(\w+)/`", writers[0])) == sql & set(ROOMS) - {"store"}
    assert sql - set(ROOMS) == {"access.py", "events.py", "health.py"}


def test_states_are_written_in_one_place() -> None:
    """`move` alone, which uses the table of permitted moves; what is inserted or imported is not a move."""
    writers = set()
    for path in MODULES:
        if path.parts[0] in {"services", "workers", "api"} and path.parts[1] != "archives":
            for node in ast.walk(tree(path)):
                match node:
                    case ast.Call(func=ast.Attribute(attr="values"), keywords=keywords):
                        writers |= {path.as_posix() for each in keywords if each.arg == "state"}
                    case ast.Assign(targets=[ast.Attribute(attr="state")]):
                        writers.add(path.as_posix())
                    case ast.Dict(keys=keys, values=values):
                        pairs = zip(keys, values, strict=True)
                        named = [ast.unparse(value) for key, value in pairs if getattr(key, "value", None) == "state"]
                        writers |= {path.as_posix() for each in named if each.startswith("State.")}
    assert writers == {"services/experiments/states.py", "services/store/queries/requests.py"}


def test_no_modules_import_each_other_in_a_circle() -> None:
    names = {name_of(path) for path in MODULES}
    graph: dict[str, set[str]] = {}
    for path in MODULES:
        for node in set(ast.walk(tree(path))) - for_types(path):
            if isinstance(node, ast.ImportFrom) and node.module:
                package = node.module.removeprefix("gaplab.")
                found = {f"{package}.{alias.name}" for alias in node.names} & names or {package} & names
                graph[name_of(path)] = graph.get(name_of(path), set()) | found

    TopologicalSorter(graph).prepare()  # raises CycleError with the circle


def for_types(path: Path) -> set[ast.AST]:
    """What a file imports for types alone: it never runs, so that classes may name each other."""
    blocks = (
        node for node in tree(path).body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    return {node for block in blocks for node in ast.walk(block)}


def test_core_and_world_have_no_clock_no_chance_of_their_own_and_no_side_effects() -> None:
    pure = [path for path in MODULES if path.as_posix().startswith(("services/core/", "services/world/"))]

    assert {str(path): wrong for path in pure if (wrong := tops_of(path) & IMPURE)} == {}


CREATES = """
import sys

import numpy.ma  # which NumPy imports when it is first used
from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.errors import InvalidSpec
from gaplab.services.world.robots import robots
from gaplab.services.specs.registries import REGISTRIES
from gaplab.services.store.session import Store

every = [(kind, each) for kind, registry in REGISTRIES.items() for each in registry.values() if kind != "engine"]
touched = []
outside = {"open", "import", "os", "shutil", "socket", "sqlite3", "subprocess"}
store = Store("sqlite://")
sys.addaudithook(lambda event, given: touched.append((event, given)) if event.partition(".")[0] in outside else None)
for kind, plugin in every:
    plugin.example() if kind == "robot" else plugin(plugin.Options())
try:
    robots.create(PluginRef(name="robot_file", options={"sha256": "of none"}))
except InvalidSpec:
    print(len(every), touched)
"""


def test_to_create_a_plug_in_opens_imports_and_asks_nothing() -> None:
    done = subprocess.run([sys.executable, "-c", CREATES], capture_output=True, text=True, cwd=ROOT, check=False)

    count, _, touched = done.stdout.strip().partition(" ")
    assert (int(count) > 40, touched) == (True, "[]"), done.stderr


def test_only_the_workers_know_ray_and_nobody_imports_physics_at_the_top() -> None:
    others = [path for path in MODULES if path.parts[0] != "workers"]

    assert {str(path): wrong for path in others if (wrong := tops_of(path) & ({"ray"} | PHYSICS))} == {}


def test_the_api_imports_what_only_notebooks_need_where_it_is_needed() -> None:
    assert {
        str(path): wrong for path in MODULES if path.parts[0] == "api" and (wrong := at_the_top(path) & ON_DEMAND)
    } == {}


def at_the_top(path: Path) -> set[str]:
    """The packages that a file imports outside functions."""
    top = [node for node in tree(path).body if isinstance(node, ast.Import | ast.ImportFrom)]
    names = {alias.name for node in top for alias in node.names} | {getattr(node, "module", None) or "" for node in top}
    return {name.partition(".")[0] for name in names}


def test_a_module_stays_under_400_lines_and_a_function_under_40() -> None:
    own = [path for path in MODULES if "versions" not in path.parts]
    functions = [
        (str(path), node.name)
        for path in own
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.end_lineno - node.body[0].lineno >= 40
    ]

    assert [str(path) for path in own if len((ROOT / path).read_text().splitlines()) > 400] == []
    assert functions == []


def test_every_module_says_what_it_is() -> None:
    assert [str(path) for path in MODULES if not ast.get_docstring(tree(path))] == []


def test_benchmarks_use_what_tests_provide_and_no_test_uses_a_benchmark() -> None:
    tests = sorted((ROOT / "tests").rglob("*.py"))

    assert [str(path) for path in tests if re.search(r"^\s*(from|import) benchmarks\b", path.read_text(), re.M)] == []
