"""The width of text in files, and the characters of the font; to be called within matplotlib's settings for files."""

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.ft2font import FT2Font

FAMILY = "DejaVu Sans"
POINTS_PER_INCH = 72
MEASURED_PT = 100  # the size at which text is measured: large, since the measures are rounded
FRACTIONS = 64  # parts of a pixel, the unit of the measures


def printable(text: str) -> str:
    """Return the text with a replacement for each character that the font does not have."""
    return "".join(each if _font().get_char_index(ord(each)) else "\N{REPLACEMENT CHARACTER}" for each in text)


def width_in(text: str, size_pt: float) -> float:
    """Return the width of a line of text in inches."""
    font = _font()
    font.set_text(printable(text), 0.0)
    return float(font.get_width_height()[0]) / FRACTIONS / MEASURED_PT * size_pt / POINTS_PER_INCH


def lines(text: str, size_pt: float, width: float) -> list[str]:
    """Return the text in lines of at most `width` inches; a wider word is broken."""
    found = [""]
    for word in text.split(" "):
        longer = f"{found[-1]} {word}".lstrip()
        if width_in(longer, size_pt) <= width:
            found[-1] = longer
        else:
            found += _broken(word, size_pt, width)
    return [each for each in found if each]


def shortened(text: str, size_pt: float, width: float) -> str:
    """Return the text, without its middle if it is wider than `width` inches: names often differ at their ends."""
    found = text
    for keep in range(len(text) - 1, 1, -1):
        if width_in(found, size_pt) <= width:
            break
        found = f"{text[: keep - keep // 2]}…{text[len(text) - keep // 2 :]}"
    return found


def _broken(word: str, size_pt: float, width: float) -> list[str]:
    found = [""]
    for each in word:
        if width_in(found[-1] + each, size_pt) > width:
            found.append("")
        found[-1] += each
    return found


@cache
def _font() -> "FT2Font":
    from matplotlib.font_manager import findfont
    from matplotlib.ft2font import FT2Font

    font = FT2Font(findfont(FAMILY))
    font.set_size(MEASURED_PT, POINTS_PER_INCH)
    return font
