"""Numbers in the tables of a report; an undefined one is a dash."""

MISSING = "\N{EN DASH}"


def fixed(value: float | None) -> str:
    """Return a number with three digits after the point."""
    return MISSING if value is None else f"{value:.3f}"


def signed(value: float | None) -> str:
    """Return a number with its sign."""
    return MISSING if value is None else f"{value:+.3f}".replace("-", "\N{MINUS SIGN}")


def interval(lower: float | None, upper: float | None) -> str:
    """Return an interval in words."""
    return MISSING if lower is None or upper is None else f"{lower:.3f} to {upper:.3f}"


def probability(p: float | None) -> str:
    """Return a p-value as papers write it."""
    return MISSING if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"
