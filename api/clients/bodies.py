"""Bodies of requests: values of NumPy and pandas become numbers and lists, and what JSON cannot hold is refused."""

from collections.abc import Iterable, Mapping
from math import isfinite, isnan
from typing import Any


def json_of(value: Any, place: str = "") -> Any:  # noqa: ANN401 - JSON
    """Return a value as JSON has it; arrays, frames and numbers become lists and numbers.

    Args:
        value: a body, or a part of one.
        place: JSON pointer of the part, like "/values/1"; "" for the whole body.

    Raises:
        ValueError: a number is not finite.
        TypeError: JSON has no such value.
    """
    value = _python(value)
    if isinstance(value, Mapping):
        if wrong := [name for name in value if not isinstance(name, str)]:
            raise TypeError(f"{place or '(the whole)'}: names must be text, not {wrong[0]!r:.100}")
        return {name: json_of(each, f"{place}/{name}") for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_of(each, f"{place}/{number}") for number, each in enumerate(value)]
    if isinstance(value, float) and not isfinite(value):
        raise ValueError(f"{place or '(the whole)'}: must be a finite number, not {value}")
    if value is not None and not isinstance(value, bool | int | float | str):
        permitted = "text, a number, true, false, null, a list or an object"
        raise TypeError(f"{place or '(the whole)'}: must be {permitted}, not {value!r:.100}")
    return value


def numbers_of(values: Any, place: str) -> list[float]:  # noqa: ANN401 - a number, or several in whatever holds them
    """Return a number, or several, as a list.

    Raises:
        ValueError: one is not finite.
        TypeError: one is not a number.
    """
    values = _python(values)
    if isinstance(values, int | float):
        values = [values]
    if isinstance(values, str | Mapping) or not isinstance(values, Iterable):
        raise TypeError(f"{place}: must be a number or a list of numbers, not {values!r:.100}")
    found = json_of(list(values), place)
    for number, each in enumerate(found):
        if isinstance(each, bool) or not isinstance(each, int | float):
            raise TypeError(f"{place}/{number}: must be a number, not {each!r:.100}")
    return [float(each) for each in found]


def readings_of(value: Any) -> Any:  # noqa: ANN401 - whatever a driver returns
    """Return readings as lists, with None in place of NaN, which NumPy's users write where a sensor failed."""
    value = _python(value)
    if isinstance(value, list | tuple):
        return [readings_of(each) for each in value]
    return None if isinstance(value, float) and isnan(value) else value


def _python(value: Any) -> Any:  # noqa: ANN401 - anything
    """Return values of NumPy or pandas as lists and numbers of Python; anything else as it is."""
    if hasattr(value, "to_numpy"):
        value = value.to_numpy()
    return value.tolist() if hasattr(value, "tolist") else value
