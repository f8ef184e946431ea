"""The figure of curves: what is in it, and that both drawings show it."""

import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import pytest

from schemas.curves import Curve, CurvePoint
from schemas.lifecycle import State
from services.figures.definition import curves_figure
from services.figures.html import render_html
from services.figures.style import COLORS, style_of
from services.figures.svg import render_svg

SVG = "{http://www.w3.org/2000/svg}"


def point(evaluations: int, mean: float | None, n: int = 30, sd: float | None = 0.1) -> CurvePoint:
    ends = (mean - 0.2, mean + 0.2) if mean is not None and sd is not None else (None, None)
    return CurvePoint(evaluations=evaluations, n=n, mean=mean, sd=sd, lower=ends[0], upper=ends[1], values=(mean,))


def curve(name: str, *points: CurvePoint, direct: bool = False, unit: str = "m/s") -> Curve:
    return Curve(
        experiment=f"id-of-{name[:20]}",
        name=name,
        strategy="s",
        state=State.RUNNING,
        unit=unit,
        direct=direct,
        points=points,
    )


RISING = curve("simulated_fit", point(0, 0.9), point(1, 1.2), point(2, 1.3))
DIRECT = curve("direct", point(0, 1.33, n=100, sd=0.1), direct=True)


def test_a_curve_becomes_a_line_with_its_interval_and_the_baseline_a_level_with_its_sd():
    figure = curves_figure([RISING, DIRECT])

    (series,), (baseline,) = figure.series, figure.baselines
    assert series.name == "Simulated fit"
    assert [each.mean for each in series.points] == [0.9, 1.2, 1.3]
    assert series.points[1].upper == pytest.approx(1.4)
    assert (baseline.level.lower, baseline.level.upper) == pytest.approx((1.23, 1.43))
    assert figure.y_label == "Fitness in reality (m/s)"
    assert figure.span == 2


def test_fewer_than_five_repetitions_are_drawn_with_their_sd():
    few = curves_figure([curve("a", point(0, 1.0, n=4)), DIRECT])

    assert "standard deviation" in few.note
    assert few.series[0].points[0].upper == pytest.approx(1.1)


def test_the_note_says_n_and_what_the_bands_are():
    interval = curves_figure([RISING, DIRECT]).note.replace("\N{NO-BREAK SPACE}", " ")
    deviation = curves_figure([curve("a", point(0, 1, n=2), point(1, 1, n=5))], band="sd").note

    assert "Mean over 30 repetitions; bands: 95 % interval of the mean." in interval
    assert "1.33 ± 0.10 SD (n = 100)" in interval
    assert "2\N{EN DASH}5 repetitions" in deviation
    assert "standard deviation" in deviation


def test_points_that_no_repetition_has_reached_are_left_out_and_one_repetition_has_no_band():
    figure = curves_figure([curve("a", point(0, 1.0, n=1, sd=None), point(1, None, n=0, sd=None))])

    (only,) = figure.series[0].points
    assert (only.mean, only.lower, only.upper) == (1.0, None, None)
    assert render_svg(figure)
    assert render_html(figure)


def test_the_frame_shows_the_means_however_wide_a_band_is():
    wild = CurvePoint(evaluations=1, n=2, mean=1.2, sd=0.1, lower=-50, upper=50, values=(1.1, 1.3))
    least, most = curves_figure([curve("a", point(0, 1.0), wild)], band="interval").limits
    tame = curves_figure([RISING]).limits

    assert 0.7 < least < 1.0
    assert 1.2 < most < 1.5
    assert tame[0] <= 0.7
    assert tame[1] > 1.5


def test_experiments_of_one_name_are_told_apart_by_their_ids():
    first, second = RISING, RISING.model_copy(update={"experiment": "another-id"})

    names = [each.name for each in curves_figure([first, second]).series]

    assert names == ["Simulated fit (id-of-si)", "Simulated fit (another-)"]


def test_units_are_shown_only_where_all_curves_share_one():
    assert curves_figure([RISING, curve("b", unit="m")]).y_label == "Fitness in reality"
    assert curves_figure([curve("b", unit="1")]).y_label == "Fitness in reality"


def test_thirty_six_lines_differ_in_more_than_colour():
    styles = [style_of(position) for position in range(36)]

    assert len(set(styles)) == 36
    assert len({each.dash for each in styles[:6]}) == len({each.marker for each in styles[:6]}) == len(COLORS)


def test_the_same_figure_is_the_same_bytes():
    figure = curves_figure([RISING, DIRECT], title="twice")

    assert render_svg(figure) == render_svg(figure)
    assert render_html(figure) == render_html(figure)


def test_the_page_fetches_nothing_from_elsewhere():
    found: list[str] = []

    class Sources(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]):
            found.extend(f"{tag} {value}" for name, value in attrs if name in {"src", "href"})

    page = render_html(curves_figure([RISING, DIRECT]))
    Sources().feed(page)

    assert found == []
    assert re.search(r'"modeBarButtonsToRemove": *\["sendChartToCloud"', page)


def test_the_page_has_its_numbers_in_a_table_for_those_who_cannot_see_the_lines():
    page = render_html(curves_figure([RISING, DIRECT], title="The title"))

    assert "<h1>The title</h1>" in page
    row = re.search(r'<tr><th scope="row">Simulated fit</th>(.*?)</tr>', page)
    assert row
    assert re.findall(r"<td>(.*?)</td>", row[1]) == ["0.900 ± 0.100 (30)", "1.200 ± 0.100 (30)", "1.300 ± 0.100 (30)"]


@pytest.mark.parametrize(
    "name",
    ["<script>alert(1)</script>", "a $\\frac{ b", "--> x", "\x01\x1b[31m", "%", "_a_b^c_", "x" * 200, "{braces}"],
)
def test_hostile_names_are_only_text(name: str):
    figure = curves_figure([curve(name, point(0, 1.0), point(1, 2.0))], title=name)

    page, drawing = render_html(figure), render_svg(figure)

    assert "<script>alert" not in page
    assert ET.fromstring(drawing).tag == f"{SVG}svg"


@pytest.mark.parametrize(
    "curves", [[], [curve("a")], [DIRECT], [curve(f"line {each}", point(0, each)) for each in range(40)]]
)
def test_figures_of_nothing_of_a_baseline_alone_and_of_very_many_lines_are_drawn(curves: list[Curve]):
    figure = curves_figure(curves)

    assert figure.empty == (not any(each.points for each in curves))
    assert ET.fromstring(render_svg(figure)).tag == f"{SVG}svg"
    assert ("no results yet" in render_html(figure)) == figure.empty
