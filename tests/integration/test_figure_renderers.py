"""Every renderer draws every kind of figure, and the same one alike; with few, many and no marks for a release."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO

import matplotlib.image
import numpy as np
import pytest
from matplotlib import rc_context
from plotly.graph_objects import Figure as Chart

from gaplab.api.http.figures import DRAWING
from gaplab.services.figures.kinds.curves import curves_figure
from gaplab.services.figures.marks import FigureDefinition
from gaplab.services.figures.matplotlib.files import COLUMN_IN, DPI, LOOK, FileFormat, Look, render_file
from gaplab.services.figures.matplotlib.page_layout import lines, shortened, width_in
from gaplab.services.figures.plotly.chart import chart
from gaplab.services.figures.plotly.html import render_html
from gaplab.services.figures.style import INK
from tests.figures import DIRECT, EVERYTHING, FIGURES, MORE_FIGURES, NAMES, RISING, curve, point

SVG = "{http://www.w3.org/2000/svg}"

EVERY = pytest.mark.parametrize(
    "figure", [*FIGURES, *(pytest.param(each, marks=pytest.mark.release) for each in MORE_FIGURES)]
)


def render_svg(figure: FigureDefinition) -> str:
    return render_file(figure, "svg").decode()


def pixels(figure: FigureDefinition, **how: object) -> np.ndarray:
    return matplotlib.image.imread(BytesIO(render_file(figure, "png", Look(**how))))  # type: ignore[arg-type]


@EVERY
def test_plotly_takes_the_chart_and_json_has_all_its_numbers(figure: FigureDefinition) -> None:
    drawn = json.loads(json.dumps(chart(figure), allow_nan=False))

    assert len(Chart(drawn).data) == len(drawn["data"])
    texts = [each["text"] for each in drawn["layout"]["annotations"]]
    assert (figure.nothing in texts) == figure.empty


@EVERY
def test_every_mark_leaves_ink_on_paper(figure: FigureDefinition) -> None:
    picture = pixels(figure)

    assert picture.shape[1] == pytest.approx(COLUMN_IN * DPI, abs=1)
    assert (picture[:, :, :3].min(axis=2) < 0.9).mean() > 0.01
    edge = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])[:, :3]
    assert edge.min() > 0.99, "something is cut off at the edge"


@EVERY
def test_drawings_are_whole_documents_with_letters_that_publishers_take(figure: FigureDefinition) -> None:
    drawing, document = render_svg(figure), render_file(figure, "pdf")

    assert ET.fromstring(drawing).tag == f"{SVG}svg"
    assert document.startswith(b"%PDF")
    assert document.rstrip().endswith(b"%%EOF")
    assert b"/Type3" not in document
    assert b"/CreationDate" not in document
    assert b"/TrueType" in document or b"/CIDFontType2" in document


def test_the_same_figure_is_the_same_bytes() -> None:
    kinds: tuple[FileFormat, ...] = ("svg", "png", "pdf")

    assert [each for each in kinds if render_file(EVERYTHING, each) != render_file(EVERYTHING, each)] == []


@EVERY
def test_the_page_is_the_same_each_time_and_says_everything_in_words(figure: FigureDefinition) -> None:
    page = render_html(figure)

    assert page == render_html(figure)
    assert figure.empty == (figure.nothing in page.partition("<script>Plotly")[2])
    assert 'role="img" aria-label="' in page


def test_marks_in_the_colour_of_text_say_so_and_the_page_decides_on_the_rest() -> None:
    drawn = chart(EVERYTHING)

    for trace in drawn["data"]:
        inked = INK in (trace.get("line", {}).get("color"), trace["marker"].get("color") if "marker" in trace else None)
        assert inked == (trace.get("meta") == {"ink": True}), trace["name"]
    assert [each.get("name") for each in drawn["layout"]["annotations"] if each["showarrow"]] == [None, "ink"]
    assert "template" not in drawn["layout"]
    for foreign in ("font", "bgcolor", "gridcolor", "linecolor"):
        assert foreign not in json.dumps(drawn["layout"])


def test_a_name_stands_in_the_legend_once_and_in_the_order_of_the_marks() -> None:
    drawn = [each for each in chart(EVERYTHING)["data"] if each["showlegend"]]
    first = sorted((each for each in drawn if each["xaxis"] == "x2"), key=lambda each: each["legendrank"])

    assert len({each["name"] for each in drawn}) == len(drawn)
    assert [each["name"] for each in first] == ["simulator", "second", "mean", "equal", "tuned", "truth"]


def test_panels_one_above_another_share_their_horizontal_axis() -> None:
    layout = chart(EVERYTHING)["layout"]

    assert layout["xaxis3"]["matches"] == layout["xaxis2"]["matches"] == "x"
    assert layout["xaxis3"]["title"]["text"] == "time (s)"
    assert layout["xaxis"]["title"]["text"] == ""
    assert layout["yaxis"]["domain"][0] > layout["yaxis2"]["domain"][1] > layout["yaxis3"]["domain"][1]
    assert layout["yaxis3"]["type"] == "log"
    assert layout["yaxis3"]["range"] == [-7, 2]


def test_the_chart_of_a_study_is_a_few_kilobytes() -> None:
    curves = [curve(f"strategy {each}", *(point(at, 0.1 + at / 7) for at in range(11))) for each in range(7)]

    assert len(json.dumps(chart(curves_figure(curves)))) < 15_000


def test_a_file_is_as_wide_as_asked_for_and_without_its_caption_lower() -> None:
    figure = curves_figure([RISING, DIRECT], title="wide")

    assert pixels(figure, width_in=7.2).shape[1] == 2160
    assert pixels(figure, caption=False).shape[0] < pixels(figure).shape[0]


@pytest.mark.parametrize("words", ["a title of many words " * 9, "x" * 200])
def test_long_titles_are_broken_and_long_names_shortened_in_their_middle(words: str) -> None:
    first, second = (curve(words, point(0, 1.0)).model_copy(update={"experiment": each}) for each in "ab")
    figure = replace(curves_figure([first, second], title=words), caption=words)

    picture = pixels(figure)

    assert figure.title == words
    edge = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])[:, :3]
    assert edge.min() > 0.99, "something is cut off at the edge"
    with rc_context(LOOK):
        short = shortened("abcdefghij" * 5, 8, 1.0)
        assert width_in(short, 8) <= 1.0
        assert "".join(lines(words, 8, 1.0)).replace(" ", "") == words.replace(" ", "")
        assert max(width_in(each, 8) for each in lines(words, 8, 1.0)) <= 1.0
    assert (short[:3], short[-3:]) == ("abc", "hij")


def test_the_page_fetches_nothing_from_elsewhere() -> None:
    found: list[str] = []

    class Sources(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            found.extend(f"{tag} {value}" for name, value in attrs if name in {"src", "href"})

    page = render_html(curves_figure([RISING, DIRECT]))
    Sources().feed(page)

    assert found == []
    assert re.search(r'"modeBarButtonsToRemove": *\["sendChartToCloud"', page)


def test_the_page_has_its_numbers_in_a_table_for_those_who_cannot_see_the_lines() -> None:
    page = render_html(curves_figure([RISING, DIRECT], title="The title"))

    assert "<h1>The title</h1>" in page
    row = re.search(r'<tr><th scope="row">Simulated fit</th>(.*?)</tr>', page)
    assert row
    assert re.findall(r"<td>(.*?)</td>", row[1]) == ["0.900 ± 0.100 (30)", "1.200 ± 0.100 (30)", "1.300 ± 0.100 (30)"]


def test_hostile_names_are_only_text() -> None:
    for name in NAMES:
        figure = curves_figure([curve(name, point(0, 1.0), point(1, 2.0))], title=name)
        page, trace = render_html(figure), chart(figure)["data"][-1]
        assert "<script>alert" not in page
        assert page.count("</script>") == 2
        assert "<" not in trace["name"]

    together = curves_figure([curve(name, point(0, 1.0), point(1, 2.0)) for name in NAMES], title=" ".join(NAMES))
    assert ET.fromstring(render_svg(together)).tag == f"{SVG}svg"
    assert render_file(together, "pdf")


@EVERY
def test_marks_can_be_sent_and_drawn_elsewhere(figure: FigureDefinition) -> None:
    look = Look(5.0, 6.0, font="DejaVu Serif")

    assert DRAWING.validate_json(DRAWING.dump_json((figure, look))) == (figure, look)
