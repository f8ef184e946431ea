"""The grammar of queries: a text becomes a tree, or an error that names the place and what is permitted there."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TypeAlias, cast

from lark import Lark, Token, Transformer
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from gaplab.services.core.errors import InvalidSpec, Violation

LONGEST = 1_000
"""Characters of a query."""

MOST_CONDITIONS = 50
DEEPEST = 20
"""Limits of a query: of its conditions, and of the depth to which parentheses and `not` nest."""

_GRAMMAR = r"""
?start: either
either: both (OR both)*
both: factor (AND? factor)*
?factor: NOT factor -> negation | "(" either ")" | comparison
comparison: WORD OPERATOR value
          | WORD IN "(" value ("," value)* ")"
          | WORD NOT_IN "(" value ("," value)* ")"
          | value -> words
value: WORD | STRING
OR.3: /or(?![^\s()=!<>~,"])/i
AND.3: /and(?![^\s()=!<>~,"])/i
NOT_IN.4: /not\s+in(?=\s*\()/i
NOT.3: /not(?![^\s()=!<>~,"])/i
IN.3: /in(?=\s*\()/i
OPERATOR: "!=" | "!~" | ">=" | "<=" | "=" | "~" | ">" | "<"
STRING: /"(\\.|[^"\\])*"/ | /'(\\.|[^'\\])*'/
WORD: /[^\s()=!<>~,"'][^\s()=!<>~,"]*/
%ignore /\s+/
"""

_READABLE = {
    "WORD": "a word",
    "STRING": "a text in quotes",
    "OPERATOR": "one of = != > >= < <= ~ !~",
    "AND": "and",
    "OR": "or",
    "NOT": "not",
    "IN": "in (…)",
    "NOT_IN": "not in (…)",
    "LPAR": "(",
    "RPAR": ")",
    "COMMA": ",",
    "$END": "the end",
}


@dataclass(frozen=True)
class Value:
    """A word or a quoted text of a query.

    Attributes:
        text: without quotes.
        place: number of its first character in the query, from 1.
        quoted: whether it had quotes, so that `"none"` is a text.
    """

    text: str
    place: int
    quoted: bool = False


@dataclass(frozen=True)
class Term:
    """A field, an operator and its values: several for `in`, else one."""

    field: Value
    operator: str
    values: tuple[Value, ...]


@dataclass(frozen=True)
class Words:
    """A text to search for."""

    value: Value


@dataclass(frozen=True)
class Not:
    """A condition that must not hold."""

    part: "Tree"


@dataclass(frozen=True)
class Every:
    """Conditions that must all hold."""

    parts: tuple["Tree", ...]


@dataclass(frozen=True)
class Some:
    """Conditions of which at least one must hold."""

    parts: tuple["Tree", ...]


Tree: TypeAlias = Term | Words | Not | Every | Some


def parse(query: str) -> Tree | None:
    """Return the tree of a query; None if it is blank.

    Raises:
        InvalidSpec: the query is not a sentence of the language; its pointer is `q`.
    """
    if not query.strip():
        return None
    if len(query) > LONGEST:
        raise refusal(Value(query, LONGEST + 1), f"a query has at most {LONGEST:,} characters")
    try:
        tree = cast("Tree", _parser().parse(query))
    except UnexpectedInput as error:
        raise _refusal(query, error) from error
    _check_size(query, tree)
    return tree


def refusal(
    value: Value, message: str, permitted: Sequence[str] | None = None, nearest: str | None = None
) -> InvalidSpec:
    """Return the error about a part of a query, which names its place."""
    return InvalidSpec([Violation("q", value.text, f"at character {value.place}: {message}", permitted, nearest)])


@cache
def _parser() -> Lark:
    return Lark(_GRAMMAR, parser="lalr", maybe_placeholders=False, transformer=_Building())


class _Building(Transformer[Token, Tree]):
    """Builds the tree while Lark parses, so that depth costs no stack; a method is named as its rule."""

    def either(self, found: list[Token | Tree]) -> Tree:
        return _joined(Some, found)

    def both(self, found: list[Token | Tree]) -> Tree:
        return _joined(Every, found)

    def negation(self, found: list[Tree]) -> Tree:
        return Not(found[-1])

    def comparison(self, found: list[Token | Value]) -> Tree:
        field, operator, *values = found
        assert isinstance(field, Token)
        kept = tuple(value for value in values if isinstance(value, Value))
        return Term(_value(field), " ".join(str(operator).lower().split()), kept)

    def words(self, found: list[Value]) -> Tree:
        return Words(found[0])

    def value(self, found: list[Token]) -> Value:
        return _value(found[0])


def _joined(kind: type[Every | Some], found: Sequence[Token | Tree]) -> Tree:
    parts = tuple(part for part in found if not isinstance(part, Token))
    return parts[0] if len(parts) == 1 else kind(parts)


def _value(token: Token) -> Value:
    place = (token.start_pos or 0) + 1
    if token.type != "STRING":
        return Value(str(token), place)
    return Value(re.sub(r"\\(.)", r"\1", token[1:-1], flags=re.DOTALL), place, quoted=True)


def _check_size(query: str, tree: Tree) -> None:
    """Refuse a tree that is too large for a database."""
    level, conditions = [tree], 0
    for _ in range(DEEPEST):
        conditions += sum(len(part.values) if isinstance(part, Term) else 1 for part in level)
        level = [child for part in level for child in inside(part)]
    if level or conditions > 3 * MOST_CONDITIONS:
        message = f"the query is too large: at most {MOST_CONDITIONS} conditions, nested at most {DEEPEST // 2} deep"
        raise refusal(Value(query, 1), message)


def inside(tree: Tree) -> tuple[Tree, ...]:
    """Return the branches of a tree; none for a condition."""
    match tree:
        case Not(part):
            return (part,)
        case Every(parts) | Some(parts):
            return parts
    return ()


def _refusal(query: str, error: UnexpectedInput) -> InvalidSpec:
    match error:
        case UnexpectedCharacters(pos_in_stream=int(place)):
            found = query[place]
            if found in "\"'":
                return refusal(Value(found, place + 1), f"the quote {found} is not closed")
            return refusal(Value(found, place + 1), f"{found!r} is unexpected; expected {_expected(error.allowed)}")
        case UnexpectedToken(token=Token(type="$END")):
            return refusal(Value("", len(query) + 1), f"the query ends; expected {_expected(error.accepts or ())}")
        case UnexpectedToken(token=token):
            place, accepted = (token.start_pos or 0) + 1, error.accepts or error.expected
            return refusal(Value(str(token), place), f"{str(token)!r} is unexpected; expected {_expected(accepted)}")
    return refusal(Value(query, 1), str(error))


def _expected(terminals: Sequence[str] | set[str] | None) -> str:
    """Return the permitted terminals in words, in the order of `_READABLE`."""
    known = [words for terminal, words in _READABLE.items() if terminal in (terminals or ())]
    return " or ".join(known) or "something else"
