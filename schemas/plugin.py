"""Plug-ins: references in a spec, and entries of the catalogue."""

from typing import Any

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gaplab.schemas.base import Frozen, Real


class Named(Frozen):
    """A reference by name: `"x"` is short for `{"name": "x"}`."""

    name: str = Field(min_length=1, max_length=100)

    @model_validator(mode="before")
    @classmethod
    def _accept_a_bare_name(cls, value: object) -> object:
        return {"name": value} if isinstance(value, str) else value

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return a JSON Schema with both spellings, the bare name and the object."""
        return {"anyOf": [{"type": "string"}, handler.resolve_ref_schema(handler(core))]}


class PluginRef(Named):
    """A plug-in by name, with the options that differ from their defaults."""

    options: dict[str, Any] = Field(default_factory=dict)


class TunableRef(Named):
    """A simulator parameter to tune, with its bounds; a missing bound is the tunable's default."""

    lower: Real | None = None
    upper: Real | None = None


class PluginRead(Frozen):
    """A plug-in in the catalogue."""

    name: str
    summary: str
    source: str
    options: dict[str, Any] = Field(description="JSON Schema of the plug-in's options, with defaults")
    available: bool = True
    note: str | None = Field(
        default=None, description="why the plug-in is not available, and how to install or repair it"
    )
    details: dict[str, Any] = Field(
        default_factory=dict, description="bounds and unit of a tunable, engines of a robot"
    )


class IgnoredFile(Frozen):
    """A file in a plug-in folder that is no plug-in."""

    file: str
    why: str = Field(description="why it is no plug-in, and what to do")


class BudgetRead(Frozen):
    """A named budget: the numbers that a spec gets if it leaves them out."""

    name: str
    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int
    as_published: bool = Field(
        default=False, description="whether options that a spec leaves out are those of the plain, published formulas"
    )
    lean: bool = Field(default=False, description="whether plug-ins and options that a spec leaves out save rollouts")


class Catalogue(Frozen):
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
        default=(), description="files in the folders of GAPLAB_PLUGINS that are no plug-ins"
    )
    defaults: dict[str, Any] = Field(
        default_factory=dict, description="the value of each field that a study's spec leaves out"
    )
