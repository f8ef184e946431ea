"""What leaves the page besides figures: settings that differ, coordinates and reports, in a real Chromium."""

import re
from typing import Any

import pytest
from playwright.sync_api import expect

from tests.e2e.browser import fits, screenshot

STUDY = "Fig. 4, lean: MuJoCo in MuJoCo"

PRINTED_PX = 680
"""Width of A4 between its margins."""


@pytest.fixture
def study(archive: Any) -> Any:
    """The published study, with seven experiments."""
    return archive.get("/studies", text=STUDY)["items"][0]


@pytest.fixture
def walker(study: Any) -> Any:
    """The id of an experiment of the study with simulators."""
    return study["experiments"][0]["id"]


def saved(page: Any, link: str, part: Any = None) -> Any:
    """The name and the content of the file that a link of the page, or of a part of it, saves."""
    with page.expect_download() as download:
        (part or page).get_by_role("link", name=link, exact=True).click()
    return download.value.suggested_filename, download.value.path().read_bytes()


@pytest.mark.release
def test_the_settings_that_differ_are_those_that_the_service_found(archive: Any, study: Any, visit: Any) -> None:
    ids = [each["id"] for each in study["experiments"]][:3]
    found = archive.get("/differences", study=ids)

    page = visit(f"{archive.url}/#/compare?experiments={','.join(ids)}")

    table = page.get_by_role("region", name="Settings that differ").get_by_role("table")
    expect(table.locator("tbody tr")).to_have_count(len(found["settings"]))
    assert table.locator("tbody code").all_inner_texts() == [each["pointer"] for each in found["settings"]]
    strategies = table.locator("tbody tr", has_text="/strategy").locator("td").all_inner_texts()
    assert strategies[-3:] == [each["strategy"] for each in study["experiments"][:3]]
    expect(page.get_by_text(f"{found['equal']} other settings are equal.")).to_be_visible()


@pytest.mark.release
def test_simulators_are_drawn_in_parallel_coordinates(archive: Any, walker: Any, visit: Any) -> None:
    tunables = [each["name"] for each in archive.get(f"/experiments/{walker}")["spec"]["tunables"]]

    page = visit(f"{archive.url}/#/experiments/{walker}")
    figure = page.locator(".figure-coordinates")
    figure.scroll_into_view_if_needed()

    expect(figure.get_by_role("heading")).to_have_text("Simulators in parallel coordinates")
    expect(figure.locator(".scatterlayer .js-line").first).to_be_attached()
    for tunable in tunables:
        expect(
            figure.locator("svg").get_by_text(re.compile(tunable.replace("_", " "), re.IGNORECASE)).first
        ).to_be_visible()
    name, content = saved(page, "SVG", figure)
    assert (name.rpartition("-")[2], content[:5]) == ("coordinates.svg", b"<?xml")


@pytest.mark.release
def test_on_a_phone_every_axis_of_the_coordinates_has_its_label(archive: Any, walker: Any, visit: Any) -> None:
    page = visit(f"{archive.url}/#/experiments/{walker}", width=390)
    figure = page.locator(".figure-coordinates")
    figure.scroll_into_view_if_needed()

    labels = figure.locator(".xtick text")
    expect(labels.filter(has_text="Error per sample")).to_be_visible()
    expect(labels.filter(has_text="Real fitness")).to_be_visible()
    assert [each.is_visible() for each in labels.all()] == [True] * labels.count()
    fits(page)
    figure.scroll_into_view_if_needed()
    screenshot(page, "coordinates-phone")


@pytest.mark.release
def test_in_the_dark_the_lines_of_the_coordinates_have_the_colours_of_their_bar(
    archive: Any, walker: Any, visit: Any
) -> None:
    page = visit(f"{archive.url}/#/experiments/{walker}", dark=True)
    figure = page.locator(".figure-coordinates")
    figure.scroll_into_view_if_needed()
    expect(figure.locator(".scatterlayer .js-line").first).to_be_attached()

    lines, scale = figure.locator(".plot").evaluate("""(plot) => [
      plot.data.filter(({ mode, meta }) => mode === "lines" && !meta).map(({ line }) => line.color),
      plot.layout.coloraxis.colorscale.map(([, color]) => color)]""")

    assert (lines[0], lines[-1]) == (scale[0], scale[-1])
    screenshot(page, "coordinates-dark")


@pytest.mark.release
@pytest.mark.parametrize("of", ["experiments", pytest.param("studies", marks=pytest.mark.release)])
def test_a_report_is_saved_with_the_verdict_that_the_service_gives(api: Any, known: Any, visit: Any, of: str) -> None:
    id_ = known.study if of == "studies" else known.ids[0]
    page = visit(f"{api.url}/#/{of}/{id_}")

    name, content = saved(page, "Report")

    assert name == f"gaplab-{id_}-report.html"
    assert content.startswith(b"<!doctype html>")
    assert api.get(f"/studies/{id_}/report", format="json")["headline"] in content.decode()


@pytest.mark.release
@pytest.mark.parametrize("of", ["experiment", "study"])
def test_a_report_is_printed_whole_on_a4(archive: Any, study: Any, walker: Any, visit: Any, of: str) -> None:
    page = visit(f"{archive.url}/studies/{study['id'] if of == 'study' else walker}/report", width=PRINTED_PX)
    page.emulate_media(media="print")

    fits(page)

    printed = page.pdf(prefer_css_page_size=True)
    assert printed.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", printed)) > 3
