"""Settings in which studies and experiments differ."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen, Id, Name, Read

Values = tuple[Any, ...]


class DiffColumn(Frozen):
    """A study or an experiment whose settings are compared."""

    id: Id
    name: Name
    experiments: int = Field(description="number of its experiments", examples=[3])


class SettingRead(Read):
    """A setting with different values."""

    pointer: str = Field(
        description="JSON Pointer into the resolved spec of the first column that has the setting",
        examples=["/budget/simulator_evaluations"],
    )
    setting: str = Field(description="the setting in words", examples=["simulator evaluations of the budget"])
    values: tuple[Values, ...] = Field(
        description="by column: the distinct values of its experiments; empty if it has no such setting; "
        "null in a parameter of reality: hidden",
        examples=[((400,), (800,))],
    )
    texts: tuple[str, ...] = Field(description="by column: these values in words", examples=[("400", "800")])


class SpecDiff(Read):
    """The settings that differ. Names and the schedule change no number, so they are not settings."""

    columns: tuple[DiffColumn, ...]
    settings: tuple[SettingRead, ...] = Field(description="in the order of the spec; empty if all are equal")
    equal: int = Field(description="number of the other settings", examples=[31])
    note: str = Field(description="that number in a sentence", examples=["31 other settings are equal."])
    warnings: tuple[str, ...] = Field(
        (),
        description="why experiments of the service should not be compared: other robots, tasks or realities",
        examples=[("different robots (quadruped; toy_function): their fitness does not mean the same",)],
    )
    hidden: tuple[str, ...] = Field(
        (),
        description="pointers of parameters of reality that are still hidden in a column, so they cannot be compared",
        examples=[("/reality/parameters/restitution",)],
    )
