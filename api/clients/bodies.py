"""Bodies of requests: values of NumPy become numbers and lists, and what JSON cannot hold is refused with its place."""

from collections.abc import Mapping
from math import isfinite, isnan
from typing import Any


def json_of(value: Any, place: str = "") -> Any:  # noqa: ANN401 - JSON
    """Return a value as JSON has it; arrays and numbers of NumPy become lists and numbers.

    Args:
        value: a body, or a part of one.
        place: JSON pointer of the part, like "/values/1"; "" for the whole body.

    Raises:
        ValueError: a number is not finite.
        TypeError: JSON has no such value.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {name: json_of(each, f"{place}/{name}") for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_of(each, f"{place}/{number}") for number, each in enumerate(value)]
    if isinstance(value, float) and not isfinite(value):
        raise ValueError(f"{place or '(the whole)'}: must be a finite number, not {value}")
    if value is not None and not isinstance(value, bool | int | float | str):
        msg = f"must be text, a number, true, false, null, a list or an object, not {value!r:.100}"
        raise TypeError(f"{place or '(the whole)'}: {msg}")
    return value


def readings_of(value: Any) -> Any:  # noqa: ANN401 - whatever a driver returns
    """Return readings with None in place of NaN, which NumPy's users write where a sensor failed."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [readings_of(each) for each in value]
    return None if isinstance(value, float) and isnan(value) else value
