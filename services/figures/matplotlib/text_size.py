"""Words in files: how wide they are, and what the font can write. Asked within the settings of the file."""

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.ft2font import FT2Font

FAMILY = "DejaVu Sans"
POINTS_PER_INCH = 72
MEASURED_PT = 100  # what it measures at: large, for its measures are rounded
FRACTIONS = 64  # of a pixel, in which it measures
MARK = "\N{REPLACEMENT CHARACTER}"


def shown(text: str) -> str:
    """The text with a mark in place of each character that the font does not have."""
    return "".join(each if _font().get_char_index(ord(each)) else MARK for each in text)


def width_in(text: str, size_pt: float) -> float:
    """How wide a line of text is, in inches."""
    font = _font()
    font.set_text(shown(text), 0.0)
    return float(font.get_width_height()[0]) / FRACTIONS / MEASURED_PT * size_pt / POINTS_PER_INCH


def lines(text: str, size_pt: float, width: float) -> list[str]:
    """The text in lines of at most this width in inches; a word that is wider is broken."""
    found = [""]
    for word in text.split(" "):
        longer = f"{found[-1]} {word}".lstrip()
        if width_in(longer, size_pt) <= width:
            found[-1] = longer
        else:
            found += _broken(word, size_pt, width)
    return [each for each in found if each]


def shortened(text: str, size_pt: float, width: float) -> str:
    """The text, with its middle left out if it is wider than so many inches: names are told apart at their ends."""
    left_out = 0
    found = text
    while width_in(found, size_pt) > width and left_out < len(text) - 2:
        left_out += 1
        keep = len(text) - left_out
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
