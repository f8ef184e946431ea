"""`python -m docs.generate`, or `make docs`: writes docs/reference/ and the types of the page from the code.

tests/unit/test_docs.py fails while the files in the repository differ from what this would write.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

from docs import typescript
from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.commands.cli import app
from gaplab.api.commands.completion import KINDS
from gaplab.api.commands.exit_codes import Exit
from gaplab.schemas.plugin import BudgetRead, PluginRead
from gaplab.services.plugins.catalogue import catalogue
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.settings import Limits, Settings, variable_of
from gaplab.services.store.session import Store

FOLDER = Path(__file__).parent / "reference"
MADE = "<!-- Made by `make docs`; what is changed here is lost. -->"


def pages() -> dict[str, str]:
    """Each page of the reference by the name of its file."""
    made = {
        "commands.md": ("Commands", commands()),
        "http.md": ("HTTP operations", http()),
        "plug-ins.md": ("Plug-ins", plugins()),
        "python.md": ("The Python client", python()),
        "settings.md": ("Settings", settings()),
    }
    return {name: f"{MADE}\n\n# {title}\n\n{chr(10).join(body).strip()}\n" for name, (title, body) in made.items()}


def commands() -> Iterator[str]:
    """Every command of `gaplab` with its arguments and options."""
    yield "`--help` of each says the same. [Exit codes](#exit-codes) are at the end.\n"
    for name, command in sorted(_commands(typer.main.get_command(app), "gaplab")):
        context = command.make_context(name, [], resilient_parsing=True)
        usage = (
            re.sub(r"[{}]", "", " ".join([name, *command.collect_usage_pieces(context)]))
            .replace("[[", "[")
            .replace("]]", "]")
        )
        yield f"## {name}\n\n```text\n{usage}\n```\n\n{_cell(command.help)}\n"
        rows = [_parameter(each) for each in command.params]
        yield from _table(("argument or option", "meaning", "left out"), rows)
    yield "## Exit codes\n"
    yield from _table(("code", "meaning"), [(str(code.value), code.meaning) for code in Exit])


def http() -> Iterator[str]:
    """Every operation of the service with its parameters."""
    document = create_app(Store("sqlite://")).openapi()
    yield "A running service shows the same at `/docs`, with schemas and examples, and as OpenAPI at `/openapi.json`.\n"
    for path, operations in sorted(document["paths"].items()):
        for method, operation in operations.items():
            yield f"## {method.upper()} {path}\n\n**{operation['summary']}.** {_cell(operation.get('description'))}\n"
            rows = [
                (f"`{each['name']}` ({each['in']})", _type(each["schema"]), _cell(each.get("description")))
                for each in operation.get("parameters", ())
            ]
            yield from _table(("parameter", "type", "meaning"), rows)
            yield f"Answers: {', '.join(sorted(operation['responses']))}.\n"


def plugins() -> Iterator[str]:
    """Every plug-in with its options."""
    found = catalogue()
    yield "What specs can name. A running service lists its own, and those of `GAPLAB_PLUGINS`: `gaplab catalogue`.\n"
    for kind in KINDS:
        yield f"## {kind.capitalize()}\n"
        for each in getattr(found, kind):
            yield from _plugin(each)
    yield "## Budgets\n"
    columns = tuple(BudgetRead.model_fields)
    rows = [tuple(f"{getattr(each, name)}" for name in columns) for each in found.budgets]
    yield from _table(tuple(name.replace("_", " ") for name in columns), rows)


def python() -> Iterator[str]:
    """Every method of the client."""
    yield "`from gaplab import Client`. Methods raise `ServiceError`, which carries the service's `problem`, and"
    yield "`ServiceUnreachable`; a few `ExperimentFailed` or `ExtraMissing`. All are imported from `gaplab`.\n"
    yield f"## Client{_signature(Client.__init__)}\n\n{_docstring(Client)}\n"
    methods = inspect.getmembers(Client, lambda each: inspect.isfunction(each) and not each.__name__.startswith("_"))
    for name, method in methods:
        yield f"## {name}{_signature(method)}\n\n{_docstring(method)}\n"


def settings() -> Iterator[str]:
    """Every variable of the environment."""
    yield "The environment is read once, when a process starts.\n"
    rows = [(f"`GAPLAB_{name.upper()}`", _attribute(Settings, name), _default(value)) for name, value in Settings()]
    own = "folders with plug-ins of your own, like `PATH`: [how](../how-to/strategy.md)"
    yield from _table(("variable", "meaning", "left out"), [*rows, (f"`{VARIABLE}`", own, "none")])
    yield "## Limits\n\nWhat is said of a token holds as well for all who need none, taken together.\n"
    limits = [(f"`{variable_of(name)}`", _attribute(Limits, name), f"{most:,}") for name, most in Limits()]
    yield from _table(("variable", "at most", "left out"), limits)


def _commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - of typer's own click
    if hasattr(command, "commands"):
        for part, each in command.commands.items():
            yield from _commands(each, f"{name} {part}")
    else:
        yield name, command


def _parameter(found: Any) -> tuple[str, str, str]:  # noqa: ANN401 - of typer's own click
    names = ", ".join(f"`{each}`" for each in (*found.opts, *found.secondary_opts) if each.startswith("-"))
    default = "" if found.required else _default(found.default if found.default not in {None, ()} else None)
    return names or f"`{found.metavar or found.name.upper()}`", _cell(found.help), default


def _plugin(found: PluginRead) -> Iterator[str]:
    yield f"### {found.name}\n\n{_cell(found.summary)} Source: {_cell(found.source)}.\n"
    details = "; ".join(f"{name}: {_value(value)}" for name, value in found.details.items())
    if details:
        yield f"{details[0].upper()}{details[1:]}.\n"
    rows = [
        (f"`{name}`", _type(schema), _cell(schema.get("description")), _default(schema.get("default")))
        for name, schema in found.options.get("properties", {}).items()
    ]
    yield from _table(("option", "type", "meaning", "left out"), rows)


def _table(heads: tuple[str, ...], rows: list[tuple[str, ...]]) -> Iterator[str]:
    if rows:
        lines = [heads, ("---",) * len(heads), *rows]
        yield "\n".join(f"| {' | '.join(row)} |".replace("|  |", "| |") for row in lines) + "\n"


def _type(schema: Mapping[str, Any]) -> str:
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(_type(each) for each in schema["anyOf"] if each.get("type") != "null"))
    if "enum" in schema:
        return ", ".join(f"`{each}`" for each in schema["enum"])
    if "$ref" in schema:
        return f"`{schema['$ref'].rpartition('/')[2]}`"
    inside = f" of {_type(schema['items'])}" if schema.get("type") == "array" else ""
    return f"{schema.get('type', 'anything')}{inside}"


def _signature(method: Any) -> str:  # noqa: ANN401 - any function
    parameters = [each for name, each in inspect.signature(method).parameters.items() if name != "self"]
    written = str(inspect.Signature([each.replace(annotation=inspect.Parameter.empty) for each in parameters]))
    return written.replace("*_", "_")


def _docstring(of: Any) -> str:  # noqa: ANN401 - any function or class
    return re.sub(r"(?m)^ +(\w+): ", r"- `\1`: ", inspect.getdoc(of) or "").replace(":\n- ", ":\n\n- ")


def _attribute(of: type, name: str) -> str:
    """What the docstring says of an attribute."""
    found = re.search(rf"^ *{name}: (.*)$", inspect.getdoc(of) or "", re.MULTILINE)
    assert found is not None, f"{of.__name__} does not say what {name} is"
    return _cell(re.sub(r"\s*`GAPLAB_.*$", "", found[1]))


def _default(value: Any) -> str:  # noqa: ANN401 - JSON
    return "" if value is None or value is False else f"`{value}`"


def _value(value: Any) -> str:  # noqa: ANN401 - JSON
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _cell(text: str | None) -> str:
    return re.sub(r"\s+", " ", text or "").strip().replace("|", "\\|")


def main() -> None:
    """Write the pages."""
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, "utf-8")
        typer.echo(f"Wrote {FOLDER / name}.")
    typescript.FILE.write_text(typescript.declarations(), "utf-8")
    typer.echo(f"Wrote {typescript.FILE}.")


if __name__ == "__main__":
    main()
