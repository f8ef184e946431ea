"""Plug-ins: references in a spec, and entries of the catalogue."""

from collections.abc import Mapping
from typing import Any

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gaplab.schemas.base import Frozen, Read, Real, from_name

LONGEST_NAME = 100
"""Largest number of characters of a plug-in's name."""


def tunable_label(name: str, options: Mapping[str, Any]) -> str:
    """Return the label of a tunable with options, like `mass(trunk)` or `kp(*_knee, as=value)`.

    Args:
        name: name of the plug-in.
        options: its options; `of` has no name in a label, and is first.
    """
    parts = [str(options["of"])] if "of" in options else []
    parts += [f"{key}={value}" for key, value in sorted(options.items()) if key != "of"]
    return f"{name}({', '.join(parts)})" if parts else name


class Named(Frozen):
    """A reference by name: `"x"` is short for `{"name": "x"}`."""

    name: str = Field(min_length=1, max_length=LONGEST_NAME)

    @model_validator(mode="before")
    @classmethod
    def _accept_a_bare_name(cls, value: object) -> object:
        return from_name(value, "name")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return a JSON Schema with both spellings, the bare name and the object."""
        return {"anyOf": [{"type": "string"}, handler.resolve_ref_schema(handler(core))]}


class PluginRef(Named):
    """A plug-in by name, with the options that differ from their defaults, or from those of one of its presets."""

    options: dict[str, Any] = Field(default_factory=dict)
    preset: str | None = Field(
        None,
        max_length=LONGEST_NAME,
        exclude_if=lambda value: value is None,
        description="options that are left out are those of this preset of the plug-in, like the published ones; a "
        "stored spec has the options alone",
    )


class TunableRef(Named):
    """A simulator parameter to tune, with its bounds; a missing bound is the tunable's default.

    Its name is a label with the options in parentheses: `{"name": "mass", "options": {"of": "trunk"}}` is
    `{"name": "mass(trunk)"}`.
    """

    lower: Real | None = None
    upper: Real | None = None

    @model_validator(mode="before")
    @classmethod
    def _put_options_into_the_name(cls, value: object) -> object:
        if (
            isinstance(value, Mapping)
            and isinstance(value.get("name"), str)
            and isinstance(value.get("options"), Mapping)
        ):
            others = {key: given for key, given in value.items() if key != "options"}
            return {**others, "name": tunable_label(value["name"], value["options"])}
        return value

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return a JSON Schema of both ways to write a tunable: its label, or an object with `options`."""
        schema = super().__get_pydantic_json_schema__(core, handler)
        options = {
            "type": "object",
            "description": "options, which become part of the name",
            "additionalProperties": True,
        }
        schema["anyOf"][-1]["properties"]["options"] = {"title": "Options", **options}
        return schema


class PluginRead(Read):
    """A plug-in in the catalogue."""

    name: str
    summary: str
    source: str
    options: dict[str, Any] = Field(description="JSON Schema of the plug-in's options, with defaults")
    presets: dict[str, dict[str, Any]] = Field(
        default_factory=dict, description="options under names that a spec may choose as `preset`"
    )
    available: bool = True
    note: str | None = Field(None, description="why the plug-in is not available, and how to install or repair it")
    details: dict[str, Any] = Field(
        default_factory=dict, description="bounds and unit of a tunable, engines of a robot"
    )


class IgnoredFile(Frozen):
    """A file in a plug-in folder that is not a plug-in."""

    file: str
    why: str = Field(description="why it is not a plug-in, and what to do")


class BudgetRead(Read):
    """A named budget: the numbers that a spec gets if it leaves them out."""

    name: str
    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int
    controller_optimizer: str | None = Field(
        None, description="optimizer of controllers, if a spec leaves it out; null: that of simulators"
    )


class Catalogue(Read):
    """All plug-ins of this service, and the named budgets."""

    strategies: tuple[PluginRead, ...]
    robots: tuple[PluginRead, ...]
    engines: tuple[PluginRead, ...]
    tunables: tuple[PluginRead, ...]
    optimizers: tuple[PluginRead, ...]
    discrepancies: tuple[PluginRead, ...] = ()
    controllers: tuple[PluginRead, ...] = ()
    tasks: tuple[PluginRead, ...] = ()
    tuners: tuple[PluginRead, ...] = ()
    budgets: tuple[BudgetRead, ...] = ()
    ignored: tuple[IgnoredFile, ...] = Field(
        (), description="files in the folders of GAPLAB_PLUGINS that are not plug-ins"
    )
    defaults: dict[str, Any] = Field(
        default_factory=dict, description="the value of each field that a study's spec leaves out"
    )
