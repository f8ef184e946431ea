"""Checks of plug-ins by kind, their results for a file, and skeletons to begin with."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from inspect import getdoc, isfunction, signature
from keyword import iskeyword
from pathlib import Path
from traceback import walk_tb
from typing import Any, get_args

from gaplab.services.contract import discrepancies, optimizers, promises, robots, strategies, tuners, worlds
from gaplab.services.core.errors import GaplabError
from gaplab.services.plugins import loading
from gaplab.services.plugins.faults import NO_CLASS, why_no_plugin
from gaplab.services.specs.registries import REGISTRIES

Check = Callable[[type[Any]], None]

MODULES = (strategies, robots, worlds, optimizers, discrepancies, tuners, promises)


def _checks_of(base: type[Any]) -> Iterator[Check]:
    """Yield the checks of plug-ins with this base: the functions of nothing but such a plug-in that return nothing."""
    for module in MODULES:
        for name, found in vars(module).items():
            if isfunction(found) and found.__module__ == module.__name__ and not name.startswith("_"):
                asked = signature(found)
                if list(asked.parameters) == ["plugin"] and asked.return_annotation is None:
                    (checked,) = get_args(asked.parameters["plugin"].annotation)
                    if issubclass(base, checked):
                        yield found


CHECKS: dict[str, tuple[Check, ...]] = {kind: tuple(_checks_of(each.base)) for kind, each in REGISTRIES.items()}
"""The checks of each kind of plug-in."""


@dataclass(frozen=True)
class Result:
    """The result of one check: what a plug-in of this kind does, and why this one does not; None if it does."""

    promise: str
    reason: str | None


def promise_of(check: Check) -> str:
    """Return what a check checks, in words."""
    return (getdoc(check) or check.__name__).partition("\n")[0].rstrip(".")


def results(kind: str, plugin: type[Any]) -> Iterator[Result]:
    """Yield the result of each check of a plug-in of this kind."""
    for check in CHECKS[kind]:
        try:
            check(plugin)
        except (Exception, SystemExit) as error:  # noqa: BLE001 - a plug-in may raise anything
            yield Result(promise_of(check), _reason(error))
        else:
            yield Result(promise_of(check), None)


def _reason(error: BaseException) -> str:
    """Return the message of a failed check; for an error of the plug-in, its kind and line too."""
    message = str(error).strip().partition("\n")[0]
    (*_, (frame, line)) = walk_tb(error.__traceback__)
    if isinstance(error, AssertionError) and frame.f_globals.get("__name__", "").startswith(f"{__package__}."):
        return message
    told = f"{type(error).__name__}: {message} ({Path(frame.f_code.co_filename).name}, line {line})"
    changes = isinstance(error, ValueError) and "read-only" in message
    return f"{told}: it changes an array that it was given; change a copy" if changes else told


_IMPORT = re.compile(r"^(?:from \S+ )?import (.+)$", re.MULTILINE)


@dataclass(frozen=True)
class CheckedPlugin:
    """A plug-in that was checked, with the result of each check, or why it cannot be used."""

    kind: str
    name: str
    results: tuple[Result, ...] = ()
    unusable: str | None = None

    @property
    def passes(self) -> bool:
        """Whether the plug-in keeps the whole contract."""
        return self.unusable is None and all(result.reason is None for result in self.results)


def write_skeleton(kind: str, name: str, folder: Path) -> Path:
    """Write a plug-in that runs into a new file of a folder, which is created if absent, and return the file.

    The kind is one of `CHECKS`, or `driver`, which no spec names; the name is that in specs, and of the file.

    Raises:
        GaplabError: the name is not permitted, or the kind has a plug-in of this name.
        FileExistsError: the file exists.
    """
    _check_name(kind, name)
    file = folder / f"{name}.py"
    if file.exists():
        raise FileExistsError(17, "the file exists; choose another name or folder", str(file))
    if name in REGISTRIES.get(kind, ()):
        raise GaplabError(f"there is a {kind} called {name!r} already; choose another name")
    template = files("gaplab.services.contract").joinpath("skeletons", f"{kind}.txt").read_text("utf-8")
    class_name = _class_name(name)
    if class_name in re.findall(r"\w+", " ".join(_IMPORT.findall(template))):
        class_name += kind.capitalize()
    folder.mkdir(parents=True, exist_ok=True)
    with file.open("x", encoding="utf-8") as target:
        target.write(template.replace("{class}", class_name).replace("{name}", name))
    return file


def _check_name(kind: str, name: str) -> None:
    """Refuse a name that no module can have, or whose class no module can have."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name) or iskeyword(name):
        raise GaplabError(f"{name!r} cannot be the name of a plug-in; use small letters, digits and _, like my_{kind}")
    if iskeyword(class_name := _class_name(name)):
        why = f"its class would be {class_name}, a word of Python"
        raise GaplabError(f"{name!r} cannot be the name of a plug-in, since {why}; use another, like my_{kind}")


def _class_name(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def check_file(file: Path, folders: Sequence[Path] = ()) -> Iterator[CheckedPlugin]:
    """Import a file, or the folder of a package, and yield each of its plug-ins, checked.

    The file can import others of its folder and of the plug-in folders. Outside the plug-in folders, no other file is
    imported.

    Raises:
        FileNotFoundError: there is no such file.
        GaplabError: it has no plug-in; the message says why.
    """
    if not file.exists():
        raise FileNotFoundError(2, "there is no such file", str(file))
    path = file.absolute().parent if file.name == "__init__.py" else file.absolute()
    module = f"{path.name}/" if path.is_dir() else path.name
    if path.parent in folders:
        loading.load(folders)
    else:
        loading.load((path.parent, *folders), only={path.name.removesuffix(".py")})
    found = False
    for kind, registry in REGISTRIES.items():
        for name in [name for name, place in registry.files.items() if place.startswith(module)]:
            found = True
            yield CheckedPlugin(kind, name, tuple(results(kind, registry[name])))
    for name, refused_kind, why in _unusable(module):
        found = True
        yield CheckedPlugin(refused_kind or "plug-in", name, unusable=why)
    if not found:
        raise GaplabError(f"{file} has no plug-in; {_needed(path)}")


def _needed(path: Path) -> str:
    """Return what a file without a plug-in lacks."""
    if (why := why_no_plugin(path)) != NO_CLASS:
        return why
    return f"it needs a class of one of {', '.join(kind.capitalize() for kind in CHECKS)} from gaplab.plugins"


def _unusable(module: str) -> list[tuple[str, str | None, str]]:
    """Return name, kind and reason of each plug-in of a file that cannot be used, once."""
    every = (each for registry in REGISTRIES.values() for each in registry.refused.values())
    found = [each for each in every if each.file.startswith(module)]
    return list({(each.name, each.why): (each.name, each.kind, each.why) for each in found}.values())
