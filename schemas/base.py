"""The base of every schema, and the bounded numbers they share."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

SEED_LIMIT = 2**64


class Frozen(BaseModel):
    """Immutable data that refuses unknown fields, infinities and nan."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


Count = Annotated[int, Field(strict=True, ge=1, le=10_000_000)]
"""A whole number of at least one; strings and booleans are refused."""

Real = Annotated[float, Field(strict=True)]
"""A finite number; strings and booleans are refused."""

Seed = Annotated[int, Field(strict=True, ge=0, lt=SEED_LIMIT)]
"""A seed: a whole number of 64 bits."""

Priority = Annotated[int, Field(strict=True, ge=-10, le=10)]
"""A priority: a whole number; higher is computed first."""

Label = Annotated[str, Field(min_length=1, max_length=200)]
"""A name that a person gives to a study or an experiment."""
