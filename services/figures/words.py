"""Names, numbers and axis limits in figures."""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from math import isfinite

from gaplab.schemas.curves import from_before

LONGEST = 60  # characters of a name in a figure
OF_STUDY = 40  # characters of the name of a study beside it
TITLE = 200  # characters of a title, which may have several lines
WIDE = 30.0  # ratio of the greatest to the least value from which their axis is logarithmic
LARGEST = 1e300  # of values that are drawn: sums and margins of them stay finite

SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


PROPER = {"cma_es": "CMA-ES", "abc_smc": "ABC-SMC", "gauss_newton": "Gauss-Newton", "cpg": "CPG", "mlp": "MLP"}
PROPER |= {"simopt": "SimOpt", "bayrn": "BayRn", "mujoco": "MuJoCo", "pybullet": "PyBullet", "physx": "PhysX"}


def spoken(name: str, longest: int = LONGEST) -> str:
    """Return an identifier like `known_fit` as *Known fit*, `cma_es` as *CMA-ES*, and any other name unchanged."""
    identifier = re.fullmatch(r"[a-z][a-z0-9_]*", name)
    return PROPER.get(name) or printable(name.replace("_", " ").capitalize() if identifier else name, longest)


def titled(name: str, strategy: str, longest: int = LONGEST) -> str:
    """Return the name of an experiment as a person wrote it; that of its strategy, which it has by default, spoken."""
    return spoken(name, longest) if name == strategy else printable(name, longest)


def heading(text: str) -> str:
    """Return a title that every renderer can show."""
    return printable(text, TITLE)


def printable(text: str, longest: int = LONGEST) -> str:
    """Return a text that every renderer can show, cut to `longest` characters."""
    shown = "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in text)
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def distinct_names(named: Sequence[tuple[str, str, str, str]]) -> list[str]:
    """Return distinct names from names, strategies, names of studies, and ids of experiments.

    Equal names in several studies are followed by those of their studies, and names that are still equal by their ids.
    """
    names = [titled(name, strategy) for name, strategy, *_ in named]
    if len({study for *_, study, _ in named}) > 1:
        own = ("" if study == name else f" · {printable(study, OF_STUDY)}" for name, _, study, _ in named)
        names = _apart(names, own)
    return _apart(names, (f" ({identity[:8]})" for *_, identity in named))


def _apart(names: Sequence[str], additions: Iterable[str]) -> list[str]:
    often = Counter(names)
    return [name + more if often[name] > 1 else name for name, more in zip(names, additions, strict=True)]


def with_unit(label: str, units: Iterable[str]) -> str:
    """Return the label of an axis, with the unit if there is exactly one."""
    known = set(units)
    unit = known.pop() if len(known) == 1 else ""
    return f"{label} ({printable(unit)})" if unit not in {"", "1"} else label


def number_of(noun: str, *counts: int) -> str:
    """Return `1 repetition`, or `2–5 repetitions` for counts between 2 and 5."""
    least, most = min(counts), max(counts)
    span = f"{least}" if least == most else f"{least}\N{EN DASH}{most}"
    return f"{span}\N{NO-BREAK SPACE}{noun}{'' if least == most == 1 else 's'}"


def evaluations(count: int, *known: int) -> str:
    """Return `3 real-world evaluations (and 12 from before)`, given the samples from before each experiment."""
    return number_of("real-world evaluation", count) + from_before(*known)


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with `digits` significant digits; empty for None."""
    return "" if value is None else f"{value:.{digits}g}"


def power(value: float) -> str:
    """Return a tick of a logarithmic axis, as `0.01`, `10` or `10⁻⁶`; empty for infinity."""
    if not isfinite(value):
        return ""
    if 1e-3 <= value < 1e4:
        return f"{value:g}"
    mantissa, exponent = f"{value:.0e}".split("e")
    ten = f"10{str(int(exponent)).translate(SUPERSCRIPT)}"
    return ten if mantissa == "1" else f"{mantissa}·{ten}"


def drawable(value: float | None) -> float | None:
    """Return the value, or None for nan, infinity and values too large to compute with."""
    return value if value is not None and abs(value) <= LARGEST else None


def is_wide(values: Iterable[float | None]) -> bool:
    """Return whether all values are above 0, and so far apart that their axis is logarithmic."""
    there = [each for each in values if each is not None]
    return bool(there) and min(there) > 0 and max(there) >= WIDE * min(there)


def evenly(least: float, most: float) -> tuple[float, ...]:
    """Return nine evenly spaced places from one end of an axis to the other."""
    return tuple(least + (most - least) * eighth / 8 for eighth in range(9))


def limits(values: Iterable[float | None], *, margin: float = 0.05) -> tuple[float, float]:
    """Return the ends of an axis with a margin around all values; 0 to 1 if there are none."""
    there = [each for each in values if each is not None]
    if not there:
        return 0.0, 1.0
    least, most = min(there), max(there)
    room = margin * (most - least) or max(0.1 * abs(most), 1e-9)
    return least - room, most + room
