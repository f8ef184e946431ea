"""Texts of people in CSV."""

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters of a formula. Source: https://owasp.org/www-community/attacks/CSV_Injection"""


def cell(text: str) -> str:
    """Return the text as it is written: no formula, and without the line break that `csv` does not quote.

    A text that a spreadsheet would take for a formula begins with an apostrophe.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n")
    return f"'{lines}" if text.startswith(_FORMULA) else lines
