"""How a spec names a plug-in, and how the catalogue shows one."""

from typing import Any

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from gaplab.schemas.base import Frozen, Real


class Named(Frozen):
    """Something a spec names: `"x"` is short for `{"name": "x"}`."""

    name: str = Field(min_length=1, max_length=100)

    @model_validator(mode="before")
    @classmethod
    def _accept_a_bare_name(cls, value: object) -> object:
        return {"name": value} if isinstance(value, str) else value

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Show both spellings, the bare name and the object."""
        return {"anyOf": [{"type": "string"}, handler.resolve_ref_schema(handler(core))]}


class PluginRef(Named):
    """A plug-in by name, with those of its options that differ from their defaults."""

    options: dict[str, Any] = Field(default_factory=dict)


class TunableRef(Named):
    """A simulator parameter to tune, by name, with its bounds; a bound left out is the tunable's own."""

    lower: Real | None = None
    upper: Real | None = None


class PluginRead(Frozen):
    """A plug-in as the catalogue lists it."""

    name: str
    summary: str
    source: str
    options: dict[str, Any] = Field(description="JSON Schema of the plug-in's options, with defaults")
    available: bool = True
    note: str | None = Field(default=None, description="how to install it, if it is not available")
    details: dict[str, Any] = Field(
        default_factory=dict, description="bounds and unit of a tunable, engines of a robot"
    )


class BudgetRead(Frozen):
    """A named budget: what a spec has that leaves these numbers out."""

    name: str
    iterations: int
    repetitions: int
    controller_evaluations: int
    selection_evaluations: int
    simulator_evaluations: int


class Catalogue(Frozen):
    """Every plug-in that this service has, and the named budgets."""

    strategies: tuple[PluginRead, ...]
    robots: tuple[PluginRead, ...]
    engines: tuple[PluginRead, ...]
    tunables: tuple[PluginRead, ...]
    optimizers: tuple[PluginRead, ...]
    budgets: tuple[BudgetRead, ...] = ()
    defaults: dict[str, Any] = Field(
        default_factory=dict, description="the value of each field that a study's spec leaves out"
    )
