"""The comparison of any experiments, in a real Chromium: what is chosen is in the address, and what differs is said."""

import re
from itertools import islice
from typing import Any

import pytest
from playwright.sync_api import expect

from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.e2e.browser import axe, fits, screenshot
from tests.experiments import run, some_log, submit_one, toy

STUDY = "Fig. 4, lean: MuJoCo in MuJoCo"
MADE = "made: a study"


@pytest.fixture
def study(archive: Any) -> Any:
    """The published study, with seven experiments."""
    return archive.get("/studies", text=STUDY)["items"][0]


@pytest.fixture
def ids(study: Any) -> Any:
    return [each["id"] for each in study["experiments"]]


def address(api: Any, *experiments: Any, **query: Any) -> str:
    tail = "".join(f"&{name}={value}" for name, value in query.items())
    return f"{api.url}/#/compare?experiments={','.join(experiments)}{tail}"


def fragment(page: Any) -> Any:
    return page.evaluate("() => location.hash")


def lines(page: Any) -> Any:
    """The curves that are drawn: those with points."""
    return page.locator(".large .scatterlayer .trace:has(.point)")


@pytest.mark.release
def test_a_study_is_found_as_one_types_and_added_by_keyboard(api: Any, known: Any, visit: Any) -> None:
    page = visit(f"{api.url}/#/compare")
    expect(page.get_by_text("Choose experiments above")).to_be_visible()
    field = page.get_by_role("combobox", name="Add experiments")
    field.fill("a study")
    expect(page.get_by_role("option")).to_have_text([re.compile(f"^{MADE}study, all 3 experiments")])
    field.press("ArrowDown")
    expect(page.get_by_role("option", name=MADE).first).to_have_attribute("aria-selected", "true")
    field.press("Enter")
    chosen = page.get_by_role("list", name="Experiments that are compared").get_by_role("listitem")
    expect(chosen).to_have_count(3)
    assert fragment(page) == f"#/compare?experiments={','.join(known.ids)}"
    expect(lines(page)).to_have_count(2)

    page.get_by_role("button", name="Remove Known fit").click()
    expect(chosen).to_have_count(2)
    expect(lines(page)).to_have_count(1)
    assert known.ids[1] not in fragment(page)
    page.go_back()
    expect(chosen).to_have_count(3)
    page.go_back()
    expect(chosen).to_have_count(0)
    field.fill("no such thing")
    expect(page.get_by_role("option", name="No name or id contains this.")).to_be_visible()


@pytest.mark.release
def test_the_address_holds_everything(api: Any, known: Any, visit: Any) -> None:
    page = visit(address(api, *known.ids))
    expect(lines(page)).to_have_count(2)
    page.get_by_role("radio", name="Time").check()
    page.get_by_label("each real evaluation costs").fill("90")
    page.get_by_label("Band").select_option("sd")
    page.get_by_role("checkbox", name="Each repetition").check()
    page.get_by_label("Test").select_option("welch")
    page.get_by_label("from", exact=True).fill("2")
    page.get_by_label("to", exact=True).fill("4")
    page.get_by_label("to", exact=True).press("Tab")
    choices = "x=time&cost_s=90&band=sd&each=true&test=welch&from=2&to=4&margin=0.03"
    wanted = f"#/compare?experiments={','.join(known.ids)}&{choices}"
    page.get_by_label("equivalent within").fill("0.03")
    page.get_by_label("equivalent within").press("Tab")
    expect(page.get_by_text("over 2 to 4 real-world evaluations").first).to_be_attached()
    page.wait_for_function(f"() => location.hash === {wanted!r}")
    page.get_by_role("button", name="Copy the link").click()
    expect(page.get_by_role("button", name="Copied")).to_be_visible()

    other = visit(page.evaluate("() => navigator.clipboard.readText()"))
    expect(other.get_by_role("radio", name="Time")).to_be_checked()
    expect(other.get_by_label("each real evaluation costs")).to_have_value("90")
    expect(other.get_by_label("Band")).to_have_value("sd")
    expect(other.get_by_role("checkbox", name="Each repetition")).to_be_checked()
    expect(other.get_by_label("Test")).to_have_value("welch")
    expect(other.get_by_label("from", exact=True)).to_have_value("2")
    expect(other.get_by_label("equivalent within")).to_have_value("0.03")
    expect(other.get_by_text("over 2 to 4 real-world evaluations").first).to_be_attached()
    expect(other.locator(".large .xtitle")).to_contain_text("ime")
    assert fragment(other) == wanted


@pytest.mark.release
def test_a_number_of_evaluations_that_no_experiment_has_is_refused_in_one_sentence(
    archive: Any, ids: Any, visit: Any
) -> None:
    visit.forgive("422")
    page = visit(address(archive, *ids, to="50"))
    expect(page.get_by_text("no experiment has 50 real-world evaluations; permitted: 0 to 10")).to_have_count(1)
    page.get_by_role("button", name="at the last shared number").click()
    expect(page.locator("table.matrix")).to_be_visible()


def test_what_differs_is_what_the_service_found(api: Any, known: Any, visit: Any) -> None:
    page = visit(address(api, *known.ids, to="1"))
    matrix = page.locator("table.matrix")
    expect(page.get_by_text("The row against the column")).to_contain_text("after 1 real-world evaluation")
    found = api.get("/comparisons", study=known.ids, **{"from": 1, "to": 1})
    for pair in found:
        row, column = known.ids.index(pair["first"]), known.ids.index(pair["second"])
        here = matrix.locator("tbody tr").nth(row).locator("td").nth(column - 1)
        expect(here).to_contain_text(pair["trusted"]["found"])
        expect(here).to_contain_text(f"p {pair['trusted']['text']}")
    expect(matrix.locator("td .verdict")).to_have_count(len(found))  # each pair once
    differing = sum(pair["trusted"]["p_holm"] < 0.05 for pair in found)
    expect(page.locator(".sentence")).to_contain_text(f"{differing} of {len(found)} pairs differ after 1 real-world")
    assert differing

    page.get_by_text("Every pair, at every range").click()
    rows = page.get_by_role("region", name="Pairs").locator("tbody tr")
    expect(rows).to_have_count(len(found))
    heads = page.get_by_role("region", name="Pairs").locator("thead th").all_inner_texts()
    assert heads[1:6] == ["At 1", "Mean of 1–10", "Mean of 3–10", "Mean of 6–10", "At 10"]
    caution = page.get_by_text("are not independent")
    expect(caution).to_have_count(0)
    button = page.get_by_role("button", name="mean of 3–10", exact=True)
    button.click()
    expect(page.get_by_text("The row against the column")).to_contain_text("over 3 to 10")
    expect(button).to_have_attribute("aria-pressed", "true")
    expect(caution).to_be_hidden()
    page.get_by_text("The paper’s tests, pooled over the range").click()
    expect(caution).to_be_visible()


@pytest.mark.release
def test_a_pair_that_shares_random_streams_is_marked_and_a_margin_is_judged(
    api: Any, written: Store, visit: Any
) -> None:
    ids = [submit_one(written, toy(name=name, repetitions=6)).id for name in ("one", "two")]
    for claim in execution.claim(written, "tests", 12):
        better = 0.5 + 0.01 * (claim.number % 3) if claim.experiment_id == ids[0] else 0.0
        run(written, claim, some_log(recorded=1.0 + 0.02 * claim.number + better))
    page = visit(address(api, *ids))
    cell = page.locator("table.matrix td.better, table.matrix td.worse").first
    expect(cell).to_contain_text("paired")
    page.get_by_label("equivalent within").fill("9")
    page.get_by_label("equivalent within").press("Tab")
    expect(page.locator("table.matrix .within").first).to_contain_text("within ±9")
    page.get_by_label("Test").select_option("student")
    expect(page.get_by_text("trust the paired tests")).to_be_visible()
    page.get_by_text("Each experiment, with intervals").click()
    expect(page.get_by_role("region", name="Each experiment").locator("tbody tr")).to_have_count(2)
    axe(page)


@pytest.mark.release
def test_what_should_not_be_compared_is_warned_of(archive: Any, ids: Any, visit: Any) -> None:
    (toys,) = archive.get("/studies", q="robot = toy_function", limit=1)["items"]
    page = visit(address(archive, ids[0], toys["experiments"][0]["id"]))
    warned = page.locator(".remark.warned")
    expect(warned).to_contain_text("Different robots (quadruped; toy_function)")
    expect(warned).to_contain_text("Different realities")
    page.get_by_role("button", name="Remove").nth(2).click()
    expect(warned).to_have_count(0)


@pytest.mark.release
def test_a_reality_that_is_hidden_is_not_taken_for_the_same(api: Any, written: Store, visit: Any) -> None:
    first, second = (submit_one(written, toy(name=name)).id for name in ("one", "two"))
    page = visit(address(api, first, second, "nowhere"))
    expect(page.locator(".remark.warned")).to_contain_text("hidden until the experiments have ended")
    expect(page.get_by_text("There is no experiment nowhere")).to_be_visible()
    visit.forgive("404")


@pytest.mark.release
def test_of_many_experiments_the_figure_is_drawn_and_no_pair_is_tested(archive: Any, visit: Any) -> None:
    studies = archive.get("/studies", limit=30)["items"]
    many = [each["id"] for study in studies for each in study["experiments"]][:60]
    page = visit(address(archive, *many))
    expect(page.locator(".chosen li")).to_have_count(60)
    page.locator(".large").scroll_into_view_if_needed()  # what is out of sight is loaded once it is seen
    expect(page.locator(".large .plot .main-svg").first).to_be_visible()
    page.get_by_role("heading", name="Which differ").scroll_into_view_if_needed()
    expect(page.get_by_text("Pairs are tested for up to 20 experiments; these are 60.")).to_be_visible()
    page.get_by_role("button", name="Remove all").click()
    expect(page.get_by_text("Choose experiments above")).to_be_visible()
    expect(page.locator(".results")).to_be_hidden()


@pytest.mark.release
def test_it_grows_as_an_experiment_goes_on(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(name="growing", repetitions=2))
    claims = execution.claim(written, "tests", 2)
    logs = [some_log(2, recorded) for recorded in (1.0, 1.5)]
    page = visit(address(api, submitted.id))
    for iteration in range(3):
        for claim, log in zip(claims, logs, strict=True):
            for step in islice(log, 5 if iteration else 3):
                assert execution.record(written, claim, step)
        expect(page.locator(".large .point")).to_have_count(1 + iteration)
    for claim in claims:
        assert execution.complete(written, claim)
    expect(page.locator(".chosen .state-badge.completed")).to_be_visible()


@pytest.mark.release
def test_its_figure_is_saved_in_every_format(archive: Any, ids: Any, visit: Any) -> None:
    page = visit(address(archive, *ids, band="sd", x="rollouts"))
    for words, begins in (("SVG", b"<?xml"), ("PNG", b"\x89PNG"), ("PDF", b"%PDF"), ("CSV", b"experiment,")):
        with page.expect_download() as saved:
            page.get_by_role("link", name=words).first.click()
        assert saved.value.path().read_bytes().startswith(begins)


@pytest.mark.release
@pytest.mark.parametrize("dark", [False, True])
def test_it_is_accessible_and_fits_a_phone(archive: Any, ids: Any, visit: Any, dark: Any) -> None:
    for width in (1280, 375):
        page = visit(address(archive, *ids), dark=dark, width=width)
        page.locator(".large").scroll_into_view_if_needed()
        expect(lines(page)).to_have_count(6)
        page.get_by_role("heading", name="Which differ").scroll_into_view_if_needed()
        expect(page.locator("table.matrix")).to_be_visible()
        page.get_by_text("Every pair, at every range").click()
        axe(page)
        fits(page)
        page.get_by_text("Every pair, at every range").click()
        screenshot(page, f"compare-{'dark' if dark else 'light'}-{width}")


@pytest.mark.release
def test_the_tests_of_all_pairs_are_copied_as_a_table(archive: Any, ids: Any, visit: Any) -> None:
    page = visit(address(archive, *ids[:3]))
    page.get_by_role("button", name="Copy as LaTeX").click()
    expect(page.get_by_role("button", name="Copied")).to_be_visible()
    latex = page.evaluate("() => navigator.clipboard.readText()")
    page.get_by_role("button", name="Copy as CSV").click()
    expect(page.get_by_role("button", name="Copied").first).to_be_visible()

    page.wait_for_function("async () => (await navigator.clipboard.readText()).startsWith('first,')")
    assert latex.count(r" \\") == 4 * (1 + 3)  # experiments, and their pairs in three tables
    assert r"\toprule" in latex
