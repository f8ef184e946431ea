"""Reports as PDF, by fpdf2: the same blocks as in HTML, with tables that continue on the next page.

Fonts are matplotlib's, which has glyphs of all names that figures can show. Figures are drawn at 300 dpi.
"""

from datetime import datetime
from io import BytesIO
from pathlib import Path
from typing import assert_never

from fpdf import FPDF
from fpdf.enums import TableBordersLayout, XPos, YPos
from fpdf.fonts import FontFace
from PIL import Image

from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import render_file
from gaplab.services.reports.blocks import Block, Bullets, Code, Drawing, Grid, Paragraph, Report
from gaplab.services.reports.html import WIDTH_IN

MARGIN_MM = 15.0
FAMILY, FIXED = "text", "fixed"
FILES = {(FAMILY, ""): "DejaVuSans.ttf", (FAMILY, "B"): "DejaVuSans-Bold.ttf", (FIXED, ""): "DejaVuSansMono.ttf"}
INK, FAINT = (34, 34, 34), (85, 85, 85)
SIZES_PT = {"title": 18, "headline": 11.5, "section": 13, "text": 9.5, "note": 8, "table": 7, "code": 6.5}


class _Pages(FPDF):
    """Pages with the title and their number at the bottom."""

    def __init__(self, title: str) -> None:
        from matplotlib import get_data_path

        super().__init__(format="A4")
        self._title = title
        folder = Path(get_data_path()) / "fonts" / "ttf"
        for (family, style), file in FILES.items():
            self.add_font(family, style, folder / file)
        self.set_margin(MARGIN_MM)
        self.set_auto_page_break(auto=True, margin=MARGIN_MM + 4)

    def footer(self) -> None:
        """Draw the title and the number of the page."""
        self.set_y(-MARGIN_MM)
        self.set_font(FAMILY, size=SIZES_PT["note"])
        self.set_text_color(*FAINT)
        self.cell(0, 5, self._title[:90])
        self.cell(0, 5, f"{self.page_no()}", align="R")

    def write_text(
        self, text: str, size: str, *, bold: bool = False, faint: bool = False, indent_mm: float = 0
    ) -> None:
        """Write a paragraph in one of the sizes."""
        points = SIZES_PT[size]
        self.set_font(FAMILY, "B" if bold else "", points)
        self.set_text_color(*(FAINT if faint else INK))
        self.set_x(MARGIN_MM + indent_mm)
        self.multi_cell(0, points * 0.5, text, align="L", new_x=XPos.LMARGIN, new_y=YPos.NEXT)


def render_pdf(report: Report, made: str, at: datetime) -> bytes:
    """Return the report as a PDF.

    Args:
        report: the content.
        made: how and when the report was made, in one line.
        at: time that the file states.
    """
    pages = _Pages(report.title)
    pages.set_creation_date(at)
    pages.set_title(report.title)
    pages.set_lang("en")
    pages.add_page()
    pages.write_text(report.title, "title", bold=True)
    pages.write_text(report.subtitle, "note", faint=True)
    pages.ln(2)
    pages.write_text(report.headline, "headline", bold=True)
    for section in report.sections:
        pages.ln(4)
        if pages.will_page_break(100 if isinstance(section.blocks[0], Drawing) else 30):
            pages.add_page()
        pages.start_section(section.title)
        pages.write_text(section.title, "section", bold=True)
        for block in section.blocks:
            pages.ln(1.5)
            _draw(pages, block)
    pages.ln(4)
    pages.write_text(made, "note", faint=True)
    return bytes(pages.output())


def _draw(pages: _Pages, block: Block) -> None:
    match block:
        case Paragraph():
            pages.write_text(block.text, "note" if block.note else "text", faint=block.note)
        case Bullets():
            for sentence in block.sentences:
                pages.write_text(f"\N{BULLET} {sentence}", "text", indent_mm=2)
                pages.ln(0.8)
        case Grid():
            _table(pages, block)
        case Drawing():
            _figure(pages, block.figure)
        case Code():
            pages.set_font(FIXED, size=SIZES_PT["code"])
            pages.set_text_color(*INK)
            pages.multi_cell(0, SIZES_PT["code"] * 0.48, block.text, align="L", new_x=XPos.LMARGIN, new_y=YPos.NEXT)
        case _:
            assert_never(block)


def _table(pages: _Pages, grid: Grid) -> None:
    if pages.will_page_break(20):
        pages.add_page()
    pages.write_text(grid.caption, "note", faint=True)
    pages.set_font(FAMILY, size=SIZES_PT["table"])
    pages.set_text_color(*INK)
    pages.set_draw_color(200)
    first = 2 if grid.words else 3
    widths = (first, *(1 for _ in grid.head[1:])) if len(grid.head) > 2 else (1, 3)
    align = ("LEFT",) * len(grid.head) if grid.words else ("LEFT", *("RIGHT" for _ in grid.head[1:]))
    with pages.table(
        borders_layout=TableBordersLayout.HORIZONTAL_LINES,
        col_widths=widths,
        text_align=align,
        line_height=SIZES_PT["table"] * 0.5,
        padding=0.5,
        headings_style=FontFace(emphasis="B"),
    ) as table:
        for row in (grid.head, *grid.rows):
            table.row(row)


def _figure(pages: _Pages, figure: FigureDefinition) -> None:
    picture = BytesIO(render_file(figure, "png", width_in=WIDTH_IN, caption=False))
    width_mm = pages.epw
    with Image.open(picture) as opened:
        height_mm = width_mm * opened.height / opened.width
    if pages.will_page_break(height_mm + 12):
        pages.add_page()
    pages.image(picture, w=width_mm, alt_text=figure.alt)
    pages.write_text(figure.caption, "note", faint=True)
