"""The base of every schema, and the bounded numbers they share."""

from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from enum import StrEnum
from html import escape
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


LINE, WORDS = 160, 60
"""Most characters of what the service answered as one line, and of one text in it."""

MOST_ROWS, MOST_COLUMNS, MOST_ITEMS = 20, 9, 3


class Read(Frozen):
    """What the service answers: one line at a prompt, a small table in a notebook; `model_dump()` has everything."""

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={in_words(value)}" for name, value in _telling(self).items())
        return f"{shortened(f'{type(self).__name__}({fields}', LINE - 1)})"

    __str__ = __repr__

    def __dir__(self) -> list[str]:
        """Return what completion offers: not all that pydantic's base has."""
        return [name for name in super().__dir__() if name.startswith("_") or name not in _OF_PYDANTIC]

    def _repr_html_(self) -> str:
        return table((self,))


_OF_PYDANTIC = frozenset(dir(BaseModel)) - {"model_dump", "model_dump_json"}


def _telling(item: Read) -> dict[str, Any]:
    """Return the fields that say something, which defaults do not: first numbers and texts, last lists."""
    known = {name: (getattr(item, name), field.default) for name, field in type(item).model_fields.items()}
    said = {name: value for name, (value, usual) in known.items() if value not in (None, (), {}, "", usual)}
    kinds = (BaseModel, datetime, tuple | list | dict)
    return dict(sorted(said.items(), key=lambda each: [isinstance(each[1], kind) for kind in reversed(kinds)]))


def shortened(text: str, most: int = WORDS) -> str:
    """Return a text with at most this many characters."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


def in_words(value: object) -> str:
    """Return a value as a line has it: numbers to four digits, long texts and lists shortened."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, datetime):
        return f"{value:%Y-%m-%d %H:%M}"
    if isinstance(value, tuple | list | dict):
        items = tuple(value.items() if isinstance(value, dict) else value)
        if items and isinstance(items[0], BaseModel):
            return f"<{len(items)} {type(items[0]).__name__}>"
        return f"({', '.join(map(in_words, items[:MOST_ITEMS]))}{f', … {len(items)}' if items[MOST_ITEMS:] else ''})"
    if isinstance(value, StrEnum):
        return str(value)
    return str(getattr(value, "text", None) or shortened(repr(value)))


def table(items: Sequence[Any]) -> str:
    """Return HTML: a table of what the first items tell, a row for each; of one item alone, a row for each field."""
    told = [_telling(item) for item in items[:MOST_ROWS]]
    heads = list(dict.fromkeys(name for each in told for name in each))[: MOST_COLUMNS if told[1:] else None]
    rows = [heads, *([_cell(each.get(name)) for name in heads] for each in told)]
    more = f"<p>and {len(items) - MOST_ROWS} more</p>" if len(items) > MOST_ROWS else ""
    return html_of(rows if told[1:] else zip(*rows, strict=True)) + more


def html_of(rows: Iterable[Iterable[str]]) -> str:
    """Return texts as an HTML table."""
    lines = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows)
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _cell(value: object) -> str:
    """Return a value as a table has it: texts whole."""
    texts = value if isinstance(value, tuple) else ("" if value is None else value,)
    return "; ".join(map(str, texts)) if all(isinstance(each, str) for each in texts) else in_words(value)


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
