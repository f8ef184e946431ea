"""How figures write names and numbers, and how far their axes reach."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from math import isfinite

LONGEST = 60  # characters of a name in a figure
TITLE = 200  # of a title, which has as many lines as it needs
LARGEST = 1e300  # of what is drawn: sums and the room around it are numbers still

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def spoken(name: str, longest: int = LONGEST) -> str:
    """`known_fit` is written *Known fit*; a name that a person gave stays as it is."""
    identifier = re.fullmatch(r"[a-z][a-z0-9_]*", name)
    return printable(name.replace("_", " ").capitalize() if identifier else name, longest)


def heading(text: str) -> str:
    """A title as every renderer can show it."""
    return printable(text, TITLE)


def printable(text: str, longest: int = LONGEST) -> str:
    """The text as every renderer can show it, cut to so many characters."""
    shown = "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in text)
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def told_apart(named: Sequence[tuple[str, str]]) -> list[str]:
    """Names as people write them, of pairs of name and id; of two that are alike each carries its id."""
    names = [spoken(name) for name, _ in named]
    often = Counter(names)
    return [
        f"{name} ({identity[:8]})" if often[name] > 1 else name
        for name, (_, identity) in zip(names, named, strict=True)
    ]


def with_unit(label: str, units: Iterable[str]) -> str:
    """The label of an axis with its unit, if there is one and all share it."""
    known = set(units)
    unit = known.pop() if len(known) == 1 else ""
    return f"{label} ({printable(unit)})" if unit not in {"", "1"} else label


def span(counts: Sequence[int]) -> str:
    """`3`, or `2–5`."""
    least, most = min(counts), max(counts)
    return f"{least}" if least == most else f"{least}\N{EN DASH}{most}"


def counted(counts: Sequence[int], noun: str) -> str:
    """`1 repetition`, `2–5 repetitions`."""
    return f"{span(counts)}\N{NO-BREAK SPACE}{noun}{'' if set(counts) == {1} else 's'}"


def number(value: float | None, digits: int = 3) -> str:
    """To so many significant digits; nothing for what is not there."""
    return "" if value is None else f"{value:.{digits}g}"


def power(value: float) -> str:
    """A value of a logarithmic axis: `0.01`, `10`, `10⁻⁶`; nothing for a tick beyond all numbers."""
    if not isfinite(value):
        return ""
    if 1e-3 <= value < 1e4:
        return f"{value:g}"
    mantissa, exponent = f"{value:.0e}".split("e")
    ten = f"10{str(int(exponent)).translate(SUPERSCRIPT)}"
    return ten if mantissa == "1" else f"{mantissa}·{ten}"


def drawable(value: float | None) -> float | None:
    """The value; None in place of nan, infinity, and what is too large to be reckoned with."""
    return value if value is not None and abs(value) <= LARGEST else None


def limits(values: Iterable[float | None], *, margin: float = 0.05) -> tuple[float, float]:
    """Ends of an axis with room for all values, and a little more; 0 to 1 if there is none."""
    there = [each for each in values if each is not None]
    if not there:
        return 0.0, 1.0
    least, most = min(there), max(there)
    room = margin * (most - least) or max(0.1 * abs(most), 1e-9)
    return least - room, most + room
