"""The versions of external plug-ins, the plug-ins that a spec names, and those of them that cannot be used."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

from gaplab.schemas.plugin import PluginRef
from gaplab.services.engines import engines
from gaplab.services.plugins.loading import here
from gaplab.services.specs.registries import REGISTRIES
from gaplab.services.specs.robots import Driven, installed_robot
from gaplab.services.world.tunables.labels import plain_name

_FIRST = re.compile(rf"((?:{'|'.join(REGISTRIES)}) .{{1,100}}?) \(unavailable: ", re.DOTALL)
"""The first plug-in of a text that `text_of` wrote."""


def external_plugins() -> Mapping[str, str]:
    """Return the files of each external plug-in with their hashes, by its kind and name, as in `"robot hexapod"`."""
    loaded = here()
    texts = {
        f"{kind} {name}": loaded.contents.text_of(file)
        for kind, registry in REGISTRIES.items()
        for name, file in registry.files.items()
        if loaded is not None
    }
    return {plugin: text for plugin, text in texts.items() if text is not None}


def named_in(spec: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the plug-ins of a resolved spec or sensitivity check, and those usual for its robot, by kind and name."""
    return tuple(dict.fromkeys(_named_in(spec)))


def named_files(spec: Mapping[str, Any]) -> dict[str, str]:
    """Return the files of each external plug-in that a resolved spec names, with their hashes, by kind and name."""
    found = external_plugins()
    return {plugin: found[plugin] for plugin in named_in(spec) if plugin in found}


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


def text_of(reasons: Mapping[str, str]) -> str:
    """Return the text of plug-ins that cannot be used, each with the reason."""
    return ", ".join(f"{plugin} (unavailable: {why})" for plugin, why in reasons.items())


def tells_unavailable(text: str) -> bool:
    """Return whether a text is one of plug-ins that cannot be used."""
    return _FIRST.match(text) is not None


def still_holds(text: str, refused: Mapping[str, str]) -> bool:
    """Return whether the first plug-in of such a text cannot be used by this process either.

    Args:
        text: of any supervisor.
        refused: plug-ins that processes of this supervisor refuse, by kind and name.
    """
    first = _FIRST.match(text)
    return first is not None and (first[1] in refused or unavailable(first[1]) is not None)


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
