"""Versions of external plug-ins, which are files of GAPLAB_PLUGINS, and the plug-ins that a spec names."""

from collections.abc import Iterator, Mapping
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.services.core.external_plugins import file_of
from gaplab.services.core.tunables.labels import plain_name
from gaplab.services.engines import engines
from gaplab.services.plugins.contents import Contents
from gaplab.services.plugins.watching import imported, present
from gaplab.services.specs.registries import REGISTRIES as REGISTRIES
from gaplab.services.specs.robots import Driven, installed_robot


def external_plugins(contents: Contents | None = None) -> Mapping[str, str]:
    """Return the files of each external plug-in with their hashes, by its kind and name, as in `"robot hexapod"`.

    Args:
        contents: of the folders; left out, those of now.
    """
    found = present() if contents is None else contents
    texts = {
        f"{kind} {name}": found.text_of(file)
        for kind, registry in REGISTRIES.items()
        for name, plugin in registry.items()
        if (file := file_of(plugin)) is not None
    }
    return {plugin: text for plugin, text in texts.items() if text is not None}


def named_in(spec: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the plug-ins that a resolved spec needs, or the spec of a sensitivity check, by kind and name.

    Those are the ones that it names, and the usual controller and task of its robot.
    """
    return tuple(dict.fromkeys(_named_in(spec)))


def imported_files(spec: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the files of each external plug-in that a resolved spec names, with their hashes, as imported here."""
    found = external_plugins(imported.contents())
    return tuple(found[plugin] for plugin in named_in(spec) if plugin in found)


def unavailable(plugin: str) -> str | None:
    """Return why this process cannot use a plug-in; None if it can.

    Args:
        plugin: its kind and name.
    """
    kind, _, name = plugin.partition(" ")
    registry = REGISTRIES[kind]
    if name not in registry:
        return registry.unusable.get(name, "it is not installed")
    if kind == engines.kind and not engines[name].available():
        return f"not installed: {engines[name].install}"
    return None


def _named_in(spec: Mapping[str, Any]) -> Iterator[str]:
    yield from (
        f"{kind} {spec[kind]['name']}"
        for kind in ("strategy", "robot", "controller", "task", "optimizer", "engine", "discrepancy", "tuner")
        if spec.get(kind)
    )
    if spec.get("controller_optimizer"):
        yield f"optimizer {spec['controller_optimizer']['name']}"
    reality = spec.get("reality") or {}
    if reality.get("engine"):
        yield f"engine {reality['engine']['name']}"
    if robot := installed_robot(Driven(PluginRef.model_validate(spec["robot"]))):
        usual = ("controller", robot.usual_controller), ("task", robot.usual_task)
        yield from (f"{kind} {ref.name}" for kind, ref in usual if ref and not spec.get(kind))
    yield from (f"tunable {plain_name(ref['name'])}" for ref in spec["tunables"])
    yield from (f"tunable {plain_name(name)}" for name in reality.get("parameters", ()))
