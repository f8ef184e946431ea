"""Errors on the wire: RFC 9457 problem details."""

from typing import Any

from pydantic import Field

from gaplab.schemas.base import Frozen


class SpecError(Frozen):
    """One thing wrong with what was sent."""

    pointer: str = Field(description="JSON pointer into the body, or the name of a query or path parameter")
    value: Any = Field(default=None, description="as it was sent")
    message: str
    permitted: tuple[str, ...] | str | None = None
    nearest: str | None = None


class Problem(Frozen):
    """Why a request was not served; sent as `application/problem+json`."""

    type: str
    title: str
    status: int
    detail: str
    errors: tuple[SpecError, ...] = ()
