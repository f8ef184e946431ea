"""The structure of the code in figures: `python -m benchmarks.house [FOLDER]`.

It prints the size of each room, class names that exist twice, import circles, and the arrows between the rooms of the
API. FOLDER is another checkout, to compare with.
"""

import ast
import sys
from collections import Counter, defaultdict
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

FOLDERS = ("api", "benchmarks", "docs", "migrations", "schemas", "services", "src", "workers")

Trees = Mapping[Path, ast.Module]
Graph = Mapping[str, set[str]]


def parsed(root: Path) -> dict[Path, ast.Module]:
    """Parse every Python file outside the tests."""
    paths = (path for folder in FOLDERS for path in sorted((root / folder).rglob("*.py")))
    return {path.relative_to(root): ast.parse(path.read_text()) for path in paths}


def code_lines(source: str, tree: ast.Module) -> int:
    """Count the lines that are neither blank nor part of a docstring."""
    documented = {
        number
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for number in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    lines = enumerate(source.splitlines(), 1)
    return sum(bool(line.strip()) and number not in documented for number, line in lines)


def repeated_classes(trees: Trees) -> dict[str, list[str]]:
    """Return the names that more than one module gives to a class, with those modules."""
    homes = defaultdict(list)
    for path, tree in trees.items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(path.as_posix())
    return {name: paths for name, paths in homes.items() if len(paths) > 1}


def module_of(path: Path) -> str:
    """Return the dotted name of a file's module, without `gaplab`."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def import_graph(trees: Trees) -> Graph:
    """Return for each module the modules of gaplab that it imports, inside functions and for types too."""
    modules = {module_of(path) for path in trees}
    graph: dict[str, set[str]] = defaultdict(set)
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                package = node.module.removeprefix("gaplab.")
                targets = {f"{package}.{alias.name}" for alias in node.names}
                graph[module_of(path)] |= (targets & modules) or ({package} & modules)
    return graph


def circle(graph: Graph) -> list[str]:
    """Return the modules of one import circle; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def arrows(graph: Graph, top: str) -> set[tuple[str, str]]:
    """Return the pairs of rooms of a top-level folder in which the first imports from the second."""
    rooms = ((_room(module, top), _room(target, top)) for module in graph for target in graph[module])
    return {(source, target) for source, target in rooms if source and target and source != target}


def _room(module: str, top: str) -> str:
    parts = module.split(".")
    return parts[1] if parts[0] == top and len(parts) > 1 else ""


def main(root: Path) -> None:
    """Print the figures of a checkout."""
    trees = parsed(root)
    sizes: Counter[str] = Counter()
    for path, tree in trees.items():
        room = "/".join(path.parts[:2]) if path.parts[0] in {"api", "services"} else path.parts[0]
        sizes[room] += code_lines((root / path).read_text(), tree)
    for room, lines in sorted(sizes.items()):
        print(f"{lines:6}  {room}")
    functions = sum(isinstance(node, ast.FunctionDef) for tree in trees.values() for node in ast.walk(tree))
    print(f"{sum(sizes.values()):6}  lines in all, without docstrings and blank lines, in {functions} functions")
    graph = import_graph(trees)
    print("class names that exist twice:", repeated_classes(trees) or "none")
    print("import circle:", " -> ".join(circle(graph)) or "none")
    found = sorted(arrows(graph, "api"))
    print(f"{len(found)} arrows between the rooms of the API:", ", ".join(f"{a} -> {b}" for a, b in found))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1])
