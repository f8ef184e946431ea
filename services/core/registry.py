"""Plug-ins: each file in a plug-in folder is one plug-in; `external_plugins` imports those outside gaplab."""

from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from inspect import cleandoc, isabstract
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import PluginRead, PluginRef
from gaplab.services.core import external_plugins
from gaplab.services.core.errors import GaplabError, InvalidSpec, Violation, unknown_name
from gaplab.services.core.plugin_faults import Unusable, option_violation, quoted, remedied


class NoOptions(Frozen):
    """Options of a plug-in without options."""


class Plugin:
    """Base of all plug-ins: a class with a name, a docstring and a frozen model of its options.

    Attributes:
        name: name in specs, and of the file.
        source: origin of its idea or its numbers.
        Options: frozen model whose fields all have defaults.
        published: options of the formula as its source prints it, which the preset `as_published` sets.
        lean: options that save rollouts, which the preset `lean` sets.
    """

    name: ClassVar[str]
    source: ClassVar[str] = "gaplab"
    Options: ClassVar[type[Frozen]] = NoOptions
    published: ClassVar[Mapping[str, Any]] = {}
    lean: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, options: Frozen | None = None) -> None:
        self.options = options if options is not None else self.Options()

    @classmethod
    def describe(cls) -> PluginRead:
        """Return the catalogue's entry of the plug-in; one without a docstring has no summary."""
        summary = cleandoc(cls.__doc__ or "").split("\n\n", maxsplit=1)[0].replace("\n", " ")
        return PluginRead(
            name=cls.name,
            summary=summary,
            source=_source(cls),
            options=cls.Options.model_json_schema(),
            details=cls.details(),
        )

    @classmethod
    def details(cls) -> dict[str, Any]:
        """Return further details for the catalogue, as JSON."""
        return {}


P = TypeVar("P", bound=Plugin)


@dataclass(frozen=True)
class _Found(Generic[P]):
    usable: dict[str, type[P]]
    unusable: dict[str, Unusable]


class Registry(Mapping[str, type[P]], Generic[P]):
    """The usable plug-ins of one kind, by name, in alphabetical order.

    The first use imports every module of `package` and every external plug-in. A broken external one is `unusable`.
    """

    def __init__(self, kind: str, package: str, base: type[P]) -> None:
        self.kind = kind
        self._package = package
        self._base = base
        self._sorted: tuple[ModuleType | None, _Found[P]] | None = None

    @property
    def unusable(self) -> Mapping[str, str]:
        """Why specs cannot use an external plug-in, by its name in the catalogue."""
        return {name: each.why for name, each in self._found.unusable.items()}

    @property
    def refused(self) -> tuple[Unusable, ...]:
        """The external plug-ins that specs cannot use."""
        return tuple(self._found.unusable.values())

    @property
    def _found(self) -> _Found[P]:
        """The plug-ins, sorted again after the plug-in folders were set again."""
        package = external_plugins.package()
        if self._sorted is None or self._sorted[0] is not package:
            self._sorted = package, self._sort()
        return self._sorted[1]

    def _sort(self) -> _Found[P]:
        usable = self._own()
        valid, unusable = external_plugins.classes(self._base, self.kind)
        unusable += [each for each in external_plugins.loaded().unusable if each.kind in {None, self.kind}]
        for name in sorted({each.name for each in valid}):
            alike = [each for each in valid if each.name == name]
            if len(alike) == 1 and name not in usable:
                usable[name] = alike[0]
            else:
                files = [external_plugins.file_of(each) or "" for each in alike]
                unusable += _of_one_name(self.kind, name, files, ["gaplab"] if name in usable else [])
        return _Found(dict(sorted(usable.items())), _by_name(unusable, usable))

    def _own(self) -> dict[str, type[P]]:
        modules = (
            import_module(f"{self._package}.{info.name}")
            for info in iter_modules(import_module(self._package).__path__)
        )
        return {
            each.name: each
            for module in modules
            for each in vars(module).values()
            if isinstance(each, type)
            and issubclass(each, self._base)
            and not isabstract(each)
            and hasattr(each, "name")
        }

    def __getitem__(self, name: str) -> type[P]:
        return self._found.usable[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found.usable)

    def __len__(self) -> int:
        return len(self._found.usable)

    def check(self, ref: PluginRef, pointer: str = "") -> tuple[type[P], Frozen]:
        """Return the plug-in class that a spec names, and its complete options.

        Args:
            ref: name and options.
            pointer: place in the spec, for errors.

        Raises:
            InvalidSpec: the name is unknown, the plug-in is unusable, or it refuses the options.
        """
        if (why := self.unusable.get(ref.name)) is not None:
            message = f"the {self.kind} {ref.name!r} is not available: {why}"
            raise InvalidSpec([Violation(pointer, ref.name, message, tuple(self))])
        if ref.name not in self:
            raise InvalidSpec([unknown_name(pointer, self.kind, ref.name, list(self))])
        plugin = self[ref.name]
        try:
            return plugin, plugin.Options.model_validate(ref.options)
        except ValidationError as error:
            raise InvalidSpec(
                option_violation(plugin.name, plugin.Options, dict(each), f"{pointer}/options")
                for each in error.errors()
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
            why = quoted(error, external_plugins.folders())
            message = f"the {self.kind} {ref.name!r} cannot be created with these options: {why}"
            raise InvalidSpec([Violation(pointer, ref.model_dump(mode="json"), message)]) from error

    def describe(self) -> tuple[PluginRead, ...]:
        """Return the catalogue's entries of all plug-ins."""
        found = self._found
        entries = [*(plugin.describe() for plugin in found.usable.values()), *map(_entry, found.unusable.items())]
        return tuple(sorted(entries, key=lambda entry: entry.name))


def _of_one_name(kind: str, name: str, files: list[str], owner: list[str]) -> Iterator[Unusable]:
    """Yield for each file that its plug-in has the name of another; a file with several of them is there as often.

    The owner is "gaplab", if it has the name too.
    """
    for file in dict.fromkeys(files):
        others = [*owner, *(each for each in files if each != file), "another class in it"]
        why = f"{file} has a {kind} called {name!r}, but so has {others[0]}: rename one of them"
        yield Unusable(file, name, kind, remedied(why))


def _by_name(unusable: Iterable[Unusable], usable: Container[str]) -> dict[str, Unusable]:
    """Return unusable plug-ins by their names in the catalogue: with the file where the name alone is another's."""
    named: dict[str, Unusable] = {}
    for each in unusable:
        named[each.name if each.name not in usable and each.name not in named else f"{each.name} ({each.file})"] = each
    return named


def _entry(named: tuple[str, Unusable]) -> PluginRead:
    name, found = named
    source = f"{found.file} of GAPLAB_PLUGINS"
    return PluginRead(name=name, summary="", source=source, options={}, available=False, note=found.why)


def _source(plugin: type[Plugin]) -> str:
    """Return the stated source of a plug-in, or else the file of an external one."""
    file = external_plugins.file_of(plugin)
    return f"{file} of GAPLAB_PLUGINS" if file and plugin.source == Plugin.source else plugin.source
