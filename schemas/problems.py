"""Errors of the API: problem details after RFC 9457."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class SpecError(Frozen):
    """One error in a request."""

    pointer: str = Field(
        description="JSON pointer into the body, or the name of a query or path parameter", examples=["/robot"]
    )
    value: Any = Field(default=None, description="the offending value, as sent")
    message: str = Field(
        examples=["unknown robot 'quadrupet' (did you mean 'quadruped'?); permitted: quadruped, toy_function"]
    )
    permitted: tuple[str, ...] | str | None = None
    nearest: str | None = None


class Problem(Frozen):
    """The reason why a request failed, sent as `application/problem+json`."""

    type: str = Field(examples=["urn:gaplab:problem:not-found"])
    title: str = Field(examples=["Not found"])
    status: int = Field(examples=[404])
    detail: str = Field(examples=["there is nothing with the id 'x'"])
    errors: tuple[SpecError, ...] = ()
