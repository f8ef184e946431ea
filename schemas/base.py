"""The base of every schema, and the bounded numbers they share."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

SEED_LIMIT = 2**64


class Frozen(BaseModel):
    """Immutable data that refuses unknown fields, infinities and nan."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


Count = Annotated[int, Field(strict=True, ge=1, le=10_000_000)]
"""A whole number of at least one; a string or a boolean is no number."""

Real = Annotated[float, Field(strict=True)]
"""A finite number; a string or a boolean is no number."""

Seed = Annotated[int, Field(strict=True, ge=0, lt=SEED_LIMIT)]
"""A seed of 64 bits."""

Priority = Annotated[int, Field(strict=True, ge=-10, le=10)]
"""What is computed first: the higher; a whole number."""

Label = Annotated[str, Field(min_length=1, max_length=200)]
"""A name that people give to their studies and experiments."""
