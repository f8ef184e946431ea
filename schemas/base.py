"""The base of every schema, and the bounded numbers they share."""

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, StringConstraints
from pydantic_core import PydanticCustomError

SEED_LIMIT = 2**64


class Frozen(BaseModel):
    """Immutable data that refuses unknown fields, infinities and nan."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @classmethod
    def filled_from(cls, source: object, **others: Any) -> Self:  # noqa: ANN401 - fields of any type
        """Return the attributes of an object that have the names of fields, and `others` in place of or beside them."""
        named = [name for name in cls.model_fields if name not in others and hasattr(source, name)]
        return cls(**{name: getattr(source, name) for name in named} | others)


def from_name(value: object, field: str) -> object:
    """Return a value where an object may be written as a name alone: the object, with the name in this field.

    Raises:
        PydanticCustomError: it is neither.
    """
    if isinstance(value, str):
        return {field: value}
    if not isinstance(value, Mapping | BaseModel):
        raise PydanticCustomError("name_type", "Input should be a name or an object")
    return value


Count = Annotated[int, Field(strict=True, ge=1, le=10_000_000)]
"""A whole number of at least one; strings and booleans are refused."""

Real = Annotated[float, Field(strict=True)]
"""A finite number; strings and booleans are refused."""

Seed = Annotated[int, Field(strict=True, ge=0, lt=SEED_LIMIT)]
"""A seed: a whole number of 64 bits."""

Repetitions = Annotated[Count, Field(le=10_000)]
"""A number of repetitions."""

Priority = Annotated[int, Field(strict=True, ge=-10, le=10)]
"""A priority: a whole number; higher is computed first."""

Label = Annotated[str, Field(min_length=1, max_length=200)]
"""A name that a person gives to a study or an experiment."""

Reason = Annotated[str, Field(min_length=1, max_length=2_000)]
"""Why a person does something, or why there is nothing."""

TAG_PATTERN = r"^[^\W_][\w.:/+-]*$"

Tag = Annotated[
    str,
    StringConstraints(strip_whitespace=True, to_lower=True, max_length=50, pattern=TAG_PATTERN),
    Field(examples=["gait"]),
]
"""A tag, in lower case: letters, digits and `_ . : / + -`; the first is a letter or a digit."""

Id = Annotated[str, Field(examples=["01f2e3d4c5b6"])]
"""The id of a study, an experiment or a sensitivity check."""

Moment = Annotated[datetime, Field(examples=["2012-11-05T09:00:00Z"])]
"""A time in UTC."""

Unit = Annotated[str, Field(examples=["m/s"])]
"""A unit of fitness."""

Name = Annotated[str, Field(examples=["simulated_fit"])]
"""The name of a strategy, or of an experiment, which by default is that of its strategy."""

RobotName = Annotated[str, Field(examples=["quadruped"])]
EngineName = Annotated[str, Field(examples=["pybullet"])]
TunableName = Annotated[str, Field(examples=["restitution"])]

Examples = dict[str, Any]
"""Requests that `/docs` offers to send, by name, as OpenAPI has them."""

Statistic = Annotated[float | None, Field(examples=[0.93])]
"""A fitness or a number computed from fitnesses; null where it is undefined."""
