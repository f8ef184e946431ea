"""Errors on the wire: RFC 9457 problem details."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class SpecError(Frozen):
    """One thing wrong with what was sent."""

    pointer: str = Field(
        description="JSON pointer into the body, or the name of a query or path parameter", examples=["/robot"]
    )
    value: Any = Field(default=None, description="as it was sent")
    message: str = Field(examples=["there is no robot 'quadrupet' (did you mean 'quadruped'?)"])
    permitted: tuple[str, ...] | str | None = None
    nearest: str | None = None


class Problem(Frozen):
    """Why a request was not served; sent as `application/problem+json`."""

    type: str = Field(examples=["urn:gaplab:problem:not-found"])
    title: str = Field(examples=["Not found"])
    status: int = Field(examples=[404])
    detail: str = Field(examples=["there is nothing with the id 'x'"])
    errors: tuple[SpecError, ...] = ()
