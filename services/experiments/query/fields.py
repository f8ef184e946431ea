"""The fields of queries: for each its meaning, the permitted operators, and its SQL condition."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from math import isfinite
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, func, literal, not_, true

from gaplab.schemas.lifecycle import State
from gaplab.services.core.errors import unknown_name
from gaplab.services.experiments.query.parsing import Value, refusal
from gaplab.services.store.cursor import Column
from gaplab.services.store.texts import storable

Condition = ColumnElement[bool]
Meets = Callable[[str, Value], Condition]

TEXT, NUMBER, CHOICE = ("=", "~"), ("=", ">", ">=", "<", "<="), ("=",)
"""Operators of kinds of fields. `!=`, `!~`, `in` and `not in` follow from them."""

OF_MISSING = ("=", "!=", "in", "not in")
"""Operators of `none`."""

LAST = datetime.max.replace(tzinfo=UTC)
"""The last time that a database can store."""

_SPANS = {"m": "minutes", "h": "hours", "d": "days", "w": "weeks"}
_FLAGS = ("true", "false", "any")


@dataclass(frozen=True)
class Field:
    """What a query can ask about.

    Attributes:
        meaning: what it holds, for documentation and errors.
        operators: operators that it permits, without the ones that follow from them.
        meets: returns the SQL condition of an operator and a value; never NULL.
    """

    meaning: str
    operators: tuple[str, ...]
    meets: Meets


def text(column: Column, meaning: str) -> Field:
    """Return the field of a text; `none` asks for one that is missing."""

    def meets(operator: str, value: Value) -> Condition:
        if asks_for_missing(operator, value):
            return column.is_(None)
        wanted = storable(value.text)
        met = column.icontains(wanted, autoescape=True) if operator == "~" else column == wanted
        return and_(column.is_not(None), met)

    return Field(meaning, TEXT, meets)


def tags(column: Column, meaning: str) -> Field:
    """Return the field of packed tags; `none` asks for what has none."""

    def meets(operator: str, value: Value) -> Condition:
        if asks_for_missing(operator, value):
            return column.is_(None)
        wanted = storable(value.text.lower())
        packed = wanted if operator == "~" else f" {wanted} "
        return and_(column.is_not(None), column.contains(packed, autoescape=True))

    return Field(meaning, TEXT, meets)


def whole(column: Column, meaning: str) -> Field:
    """Return the field of a number that is never missing."""
    return Field(meaning, NUMBER, lambda operator, value: compared(column, operator, number_of(value)))


def moment(column: Column, meaning: str) -> Field:
    """Return the field of a time: a date, a date with a time, or how long ago; a date alone is a whole day for `=`."""

    def meets(operator: str, value: Value) -> Condition:
        if asks_for_missing(operator, value):
            return column.is_(None)
        at, length = _moment_of(value)
        if operator == "=":
            if at > LAST - length:
                raise refusal(value, f"{value.text!r} is too late for =; permitted: times before {LAST:%Y-%m-%d}")
            return and_(column.is_not(None), column >= at, column < at + length)
        return and_(column.is_not(None), compared(column, operator, at))

    return Field(f"{meaning}: 2026-11-05, 2026-11-05T09:00 (UTC), or -7d for seven days ago", NUMBER, meets)


def state(meets: Callable[[State], Condition], meaning: str) -> Field:
    """Return the field of a state, in upper or lower case."""

    def of(_: str, value: Value) -> Condition:
        return meets(State(choice(value, [each.value for each in State], "state", str.upper)))

    return Field(f"{meaning}: {', '.join(State)}", CHOICE, of)


def flag(is_set: Condition, meaning: str) -> Field:
    """Return the field of a truth value; `any` permits both."""

    def meets(_: str, value: Value) -> Condition:
        match choice(value, _FLAGS, "value", str.lower):
            case "true":
                return is_set
            case "false":
                return not_(is_set)
        return true()

    return Field(f"{meaning}: {', '.join(_FLAGS)}", CHOICE, meets)


def fitness(experiment: Column, points: Select[Any], value: ColumnElement[Any], meaning: str) -> Field:
    """Return the field of a fitness that is averaged over repetitions; `none` asks for experiments without one.

    `points` selects ids of experiments with a fitness, grouped by id; `value` is that of a repetition in these groups.
    """

    def meets(operator: str, wanted: Value) -> Condition:
        if asks_for_missing(operator, wanted):
            return experiment.not_in(points)
        return experiment.in_(points.having(compared(func.avg(value), operator, number_of(wanted))))

    return Field(meaning, NUMBER, meets)


def compared(column: ColumnElement[object] | Column, operator: str, value: object) -> Condition:
    """Return the condition of `=`, `>`, `>=`, `<` or `<=`."""
    return column.op(operator, is_comparison=True)(literal(value))


def asks_for_missing(operator: str, value: Value) -> bool:
    """Return whether the value is `none`, which asks for something that is missing.

    Raises:
        InvalidSpec: it is, and the operator is not `=`.
    """
    if value.quoted or value.text.lower() != "none":
        return False
    if operator != "=":
        hint = "; put a text in quotes" if operator == "~" else ""
        message = f"{value.text!r} is what is missing, and has no operator {operator}"
        raise refusal(value, f"{message}; permitted: {', '.join(OF_MISSING)}{hint}", OF_MISSING)
    return True


def number_of(value: Value) -> float:
    """Return the number that a query names.

    Raises:
        InvalidSpec: it is not a number.
    """
    try:
        number = float(value.text)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise refusal(value, f"{value.text!r} is not a number, like 0.5")
    return number


def choice(value: Value, permitted: Sequence[str], kind: str, case: Callable[[str], str]) -> str:
    """Return the permitted word that a query names.

    Raises:
        InvalidSpec: it is not permitted; the error has the nearest one.
    """
    if (word := case(value.text)) in permitted:
        return word
    violation = unknown_name("q", kind, word, permitted)
    raise refusal(value, violation.message, permitted, violation.nearest)


def field_of(fields: Mapping[str, Field], name: Value) -> Field:
    """Return the field with this name, in upper or lower case.

    Raises:
        InvalidSpec: there is none; the error has the nearest one.
    """
    return fields[choice(name, list(fields), "field", str.lower)]


def _moment_of(value: Value) -> tuple[datetime, timedelta]:
    """Return the beginning and the length of the time that a query names."""
    word = value.text
    try:
        if word[:1] == "-" and word[-1:] in _SPANS:
            return datetime.now(UTC) - timedelta(**{_SPANS[word[-1]]: float(word[1:-1])}), timedelta(seconds=1)
        at = datetime.fromisoformat(word)
        at = at.replace(tzinfo=UTC) if at.tzinfo is None else at.astimezone(UTC)
        return at, timedelta(days=1) if len(word) == len("2026-11-05") else timedelta(minutes=1)
    except (ValueError, OverflowError) as error:
        raise refusal(value, f"{word!r} is not a time, like 2026-11-05, 2026-11-05T09:00 or -7d") from error
