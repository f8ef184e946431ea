"""Plug-ins: each module in the package of a kind has one of gaplab's own, and external ones are put beside them."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from inspect import cleandoc, isabstract
from pathlib import PurePath
from pkgutil import iter_modules
from traceback import walk_tb
from typing import Any, ClassVar, Generic, TypeAlias, TypeVar

from pydantic import ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.mistakes import permitted_by, pointer_to, sentence
from gaplab.schemas.plugin import PluginRead, PluginRef
from gaplab.services.core.errors import GaplabError, InvalidSpec, Violation, unknown_name

EXTERNAL = "gaplab_plugins"
"""Package of the external plug-ins, whose files import each other as `from gaplab_plugins.other import …`."""

LONGEST = 300
"""Longest message of a plug-in's own error that is quoted, in characters."""


Presets: TypeAlias = Mapping[str, Mapping[str, Any]]
"""Options of a plug-in, under the name of a preset."""


class NoOptions(Frozen):
    """Options of a plug-in without options."""


class Plugin:
    """Base of all plug-ins: a class with a name, a docstring and a frozen model of its options.

    Attributes:
        name: name in specs.
        source: origin of its idea or its numbers.
        Options: frozen model whose fields all have defaults.
        presets: options under a name, like those that its source published, from which a spec may choose. Those under
            the name of a budget, as `as_published` or `lean`, are set by that budget too.
        catalogued: names of its attributes that the catalogue shows.
    """

    name: ClassVar[str]
    source: ClassVar[str] = "gaplab"
    Options: ClassVar[type[Frozen]] = NoOptions
    presets: ClassVar[Presets] = {}
    catalogued: ClassVar[tuple[str, ...]] = ()

    def __init__(self, options: Frozen | None = None) -> None:
        self.options = options if options is not None else self.Options()

    @classmethod
    def preset(cls, name: str | None) -> Mapping[str, Any]:
        """Return the options of a preset; none if there is none of this name."""
        return cls.presets.get(name or "", {})

    @classmethod
    def describe(cls) -> PluginRead:
        """Return the catalogue's entry of the plug-in; one without a docstring has no summary."""
        summary = cleandoc(cls.__doc__ or "").split("\n\n", maxsplit=1)[0].replace("\n", " ")
        return PluginRead(
            name=cls.name,
            summary=summary,
            source=cls.source,
            options=cls.Options.model_json_schema(),
            presets={name: dict(options) for name, options in cls.presets.items()},
            details=cls.details(),
        )

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return further details for the catalogue, as JSON."""
        return {name: getattr(cls, name) for name in cls.catalogued}


P = TypeVar("P", bound=Plugin)


@dataclass(frozen=True)
class Unusable:
    """An external plug-in that specs cannot use.

    Attributes:
        file: the file relative to its folder.
        name: the name that specs would call it.
        kind: its kind; None if the file does not tell.
        why: one sentence with the remedy.
    """

    file: str
    name: str
    kind: str | None
    why: str


class Registry(Mapping[str, type[P]], Generic[P]):
    """The usable plug-ins of one kind, by name, in alphabetical order.

    The first use imports gaplab's own, from every module of `package`.

    Attributes:
        kind: the kind.
        base: base class of the plug-ins.
        files: the file of each external plug-in, relative to its folder, by name.
        refused: the external plug-ins that specs cannot use, by their names in the catalogue.
    """

    def __init__(self, kind: str, package: str, base: type[P]) -> None:
        self.kind, self.base = kind, base
        self.files: Mapping[str, str] = {}
        self.refused: Mapping[str, Unusable] = {}
        self._package = package
        self._own: Mapping[str, type[P]] | None = None
        self._usable: Mapping[str, type[P]] | None = None

    @property
    def own(self) -> Mapping[str, type[P]]:
        """Gaplab's own plug-ins."""
        if self._own is None:
            names = [info.name for info in iter_modules(import_module(self._package).__path__)]
            modules = [import_module(f"{self._package}.{name}") for name in names]
            found = (each for module in modules for each in vars(module).values() if isinstance(each, type))
            plugins = (each for each in found if issubclass(each, self.base) and not isabstract(each))
            self._own = {each.name: each for each in plugins if hasattr(each, "name")}
        return self._own

    @property
    def unusable(self) -> Mapping[str, str]:
        """Why specs cannot use an external plug-in, by its name in the catalogue."""
        return {name: each.why for name, each in self.refused.items()}

    def put(self, plugins: Mapping[str, type[P]], files: Mapping[str, str], refused: Mapping[str, Unusable]) -> None:
        """Put external plug-ins beside gaplab's own, in place of those before; the arguments are as the attributes."""
        self.files, self.refused = files, refused
        self._usable = dict(sorted({**plugins, **self.own}.items()))

    @property
    def _all(self) -> Mapping[str, type[P]]:
        if self._usable is None:
            self.put({}, {}, {})
        assert self._usable is not None
        return self._usable

    def __getitem__(self, name: str) -> type[P]:
        return self._all[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def check(self, ref: PluginRef, pointer: str = "") -> tuple[type[P], Frozen]:
        """Return the plug-in class that a spec names, and its complete options.

        Args:
            ref: name, options, and perhaps the preset of those that it leaves out.
            pointer: place in the spec, for errors.

        Raises:
            InvalidSpec: the name or the preset is unknown, the plug-in is unusable, or it refuses the options.
        """
        if (refused := self.refused.get(ref.name)) is not None:
            message = f"the {self.kind} {ref.name!r} is not available: {refused.why}"
            raise InvalidSpec([Violation(pointer, ref.name, message, tuple(self))])
        if ref.name not in self:
            raise InvalidSpec([unknown_name(pointer, self.kind, ref.name, list(self))])
        plugin = self[ref.name]
        if ref.preset is not None and ref.preset not in plugin.presets:
            of = f"preset of {ref.name!r}"
            raise InvalidSpec([unknown_name(f"{pointer}/preset", of, ref.preset, list(plugin.presets) or ["none"])])
        try:
            return plugin, plugin.Options.model_validate({**plugin.preset(ref.preset), **ref.options})
        except ValidationError as error:
            raise InvalidSpec(
                option_violation(plugin, dict(each), f"{pointer}/options") for each in error.errors()
            ) from error

    def create(self, ref: PluginRef, pointer: str = "") -> P:
        """Create the plug-in that a spec names.

        Raises:
            InvalidSpec: as by `check`, or because the plug-in raises.
        """
        plugin, options = self.check(ref, pointer)
        try:
            return plugin(options)
        except GaplabError:
            raise
        except Exception as error:
            message = f"the {self.kind} {ref.name!r} cannot be created with these options: {quoted(error)}"
            raise InvalidSpec([Violation(pointer, ref.model_dump(mode="json"), message)]) from error

    def describe(self) -> tuple[PluginRead, ...]:
        """Return the catalogue's entries of all plug-ins."""
        entries = [*map(self._entry, self), *(_refused_entry(*each) for each in self.refused.items())]
        return tuple(sorted(entries, key=lambda entry: entry.name))

    def _entry(self, name: str) -> PluginRead:
        """Return the entry of a plug-in; an external one that states no source has its file."""
        entry = self[name].describe()
        unstated = name in self.files and entry.source == Plugin.source
        return entry.model_copy(update={"source": _source(self.files[name])}) if unstated else entry


def listed(value: object) -> object:
    """Return the names that an option lists, perhaps as a text, in which commas outside parentheses separate them."""
    if not isinstance(value, str):
        return value
    return [part.strip() for part in re.split(r",(?![^()]*\))", value) if part.strip()]


def option_violation(plugin: type[Plugin], error: Mapping[str, Any], pointer: str = "") -> Violation:
    """Return the violation of an option that the model of a plug-in's options refuses.

    The error is an item of `ValidationError.errors()`; the pointer is the place of the options in the spec.
    """
    place = pointer_to(error["loc"])
    if error["type"] == "extra_forbidden":
        names = [field.alias or name for name, field in plugin.Options.model_fields.items()]  # as specs have them
        kind = f"option of {plugin.name!r}"
        return unknown_name(pointer + place, kind, str(error["loc"][-1]), names or ["none"])
    return Violation(pointer + place, error["input"], sentence(error), permitted_by(error))


def quoted(error: BaseException, place: str | None = None) -> str:
    """Return type and message of a plug-in's error in one line of limited length, with its place.

    The place is file and line; left out: those of the last code of an external plug-in that led to the error.
    """
    try:
        message = error.msg if isinstance(error, SyntaxError) else str(error)
    except Exception:  # noqa: BLE001 - an error of a plug-in may itself be broken
        message = "its message cannot be read"
    line = " ".join(f"{type(error).__name__}: {message}".split())
    line = line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…"
    place = place or _place(error)
    return f"{line} ({place})" if place else line


def _place(error: BaseException) -> str | None:
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        package, *modules = str(frame.f_globals.get("__name__")).split(".")
        if package == EXTERNAL and modules:
            path = PurePath(frame.f_code.co_filename)
            return f"{'/'.join(path.parts[-len(modules) - (path.stem == '__init__') :])}, line {line}"
    return None


def _refused_entry(name: str, found: Unusable) -> PluginRead:
    return PluginRead(name=name, summary="", source=_source(found.file), options={}, available=False, note=found.why)


def _source(file: str) -> str:
    return f"{file} of GAPLAB_PLUGINS"
