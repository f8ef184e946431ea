"""Plug-ins: each file in a plug-in folder is one plug-in; `external_plugins` imports those outside gaplab."""

from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib import import_module
from inspect import getdoc, isabstract
from pkgutil import iter_modules
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import ValidationError

from gaplab.schemas.base import Frozen
from gaplab.schemas.plugin import PluginRead, PluginRef
from gaplab.services.core import external_plugins
from gaplab.services.core.errors import InvalidSpec, PluginBroken, Violation, unknown_name


class NoOptions(Frozen):
    """Options of a plug-in without options."""


class Plugin:
    """Base of all plug-ins: a class with a name, a docstring and a frozen model of its options.

    Attributes:
        name: name in specs, and of the file.
        source: origin of its idea or its numbers.
        Options: frozen model whose fields all have defaults.
    """

    name: ClassVar[str]
    source: ClassVar[str] = "gaplab"
    Options: ClassVar[type[Frozen]] = NoOptions

    def __init__(self, options: Frozen | None = None) -> None:
        self.options = options if options is not None else self.Options()

    @classmethod
    def describe(cls) -> PluginRead:
        """Return the catalogue's entry of the plug-in."""
        summary = (getdoc(cls) or "").split("\n\n", maxsplit=1)[0].replace("\n", " ")
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


class Registry(Mapping[str, type[P]], Generic[P]):
    """The plug-ins of one kind, by name, in alphabetical order.

    The first use imports every module of `package` and every external plug-in, and may raise PluginBroken.
    """

    def __init__(self, kind: str, package: str, base: type[P]) -> None:
        self.kind = kind
        self._package = package
        self._base = base

    @cached_property
    def _plugins(self) -> dict[str, type[P]]:
        modules = (
            import_module(f"{self._package}.{info.name}")
            for info in iter_modules(import_module(self._package).__path__)
        )
        found = {
            each.name: each
            for module in modules
            for each in vars(module).values()
            if isinstance(each, type)
            and issubclass(each, self._base)
            and not isabstract(each)
            and hasattr(each, "name")
        }
        for each in external_plugins.classes(self._base):
            if each.name in found:
                file, other = (external_plugins.file_of(plugin) for plugin in (each, found[each.name]))
                msg = f"{file} has a {self.kind} called {each.name!r}, but so has {other or 'gaplab'}: rename it"
                raise PluginBroken(msg)
            found[each.name] = each
        return dict(sorted(found.items()))

    def __getitem__(self, name: str) -> type[P]:
        return self._plugins[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._plugins)

    def __len__(self) -> int:
        return len(self._plugins)

    def check(self, ref: PluginRef, pointer: str = "") -> tuple[type[P], Frozen]:
        """Return the plug-in class that a spec names, and its complete options.

        Args:
            ref: name and options.
            pointer: place in the spec, for errors.

        Raises:
            InvalidSpec: the name is unknown, or the plug-in refuses the options.
        """
        if ref.name not in self:
            raise InvalidSpec([unknown_name(pointer, self.kind, ref.name, list(self))])
        plugin = self[ref.name]
        try:
            return plugin, plugin.Options.model_validate(ref.options)
        except ValidationError as error:
            raise InvalidSpec(
                _option_violation(plugin, dict(each), f"{pointer}/options") for each in error.errors()
            ) from error

    def create(self, ref: PluginRef, pointer: str = "") -> P:
        """Create the plug-in that a spec names; raise as `check` does."""
        plugin, options = self.check(ref, pointer)
        return plugin(options)

    def describe(self) -> tuple[PluginRead, ...]:
        """Return the catalogue's entries of all plug-ins."""
        return tuple(plugin.describe() for plugin in self.values())


def _source(plugin: type[Plugin]) -> str:
    """Return the stated source of a plug-in, or else the file of an external one."""
    file = external_plugins.file_of(plugin)
    return f"{file} of GAPLAB_PLUGINS" if file and plugin.source == Plugin.source else plugin.source


def _option_violation(plugin: type[Plugin], error: dict[str, Any], pointer: str) -> Violation:
    place = "".join(f"/{part}" for part in error["loc"])
    if error["type"] == "extra_forbidden":
        kind = f"option of {plugin.name!r}"
        return unknown_name(pointer + place, kind, str(error["loc"][-1]), list(plugin.Options.model_fields) or ["none"])
    return Violation(pointer + place, error["input"], error["msg"])
