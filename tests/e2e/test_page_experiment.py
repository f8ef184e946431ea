"""The view of an experiment, in a real Chromium: it grows as results come in, and asks what the state permits."""

import json
from itertools import islice
from typing import Any

import httpx2
import pytest
from playwright.sync_api import expect

from gaplab.services.running import execution
from gaplab.services.store.lease import Failure
from gaplab.services.store.session import Store
from tests.e2e.browser import axe, fits, screenshot
from tests.experiments import some_log, submit_one, toy
from tests.waiting import LONGEST_S, wait_until

NAME = "simulated_fit"


@pytest.fixture
def ended(archive: Any) -> Any:
    """The address of an experiment that has everything."""
    (study,) = archive.get("/studies", q=f"robot = quadruped and strategy = {NAME}")["items"]
    return next(each for each in study["experiments"] if each["strategy"] == NAME)


def address(api: Any, experiment: Any, **query: Any) -> str:
    tail = "&".join(f"{name}={value}" for name, value in query.items())
    return f"{api.url}/#/experiments/{experiment}{'?' if tail else ''}{tail}"


def steps(store: Store, claim: Any, log: Any) -> None:
    for step in log:
        assert execution.record(store, claim, step)


def markers(page: Any) -> Any:
    """The points of the curve that are drawn."""
    return page.locator(".figure-curves .scatterlayer .point").count()


def test_it_grows_as_iterations_come_in_without_being_loaded_anew(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(name="growing", repetitions=2, iterations=3))
    claims = execution.claim(written, "tests", 2)
    logs = [some_log(3, recorded) for recorded in (1.0, 1.5)]
    for claim, log in zip(claims, logs, strict=True):
        steps(written, claim, islice(log, 3))  # number 0
    page = visit(address(api, submitted.id))
    page.evaluate("() => { window.untouched = true; }")
    expect(page.get_by_role("heading", level=1)).to_have_text("growing")
    expect(page.locator(".state-now")).to_contain_text("running")
    expect(page.locator(".figure-curves .point")).to_have_count(1)

    for iteration in (1, 2):
        for claim, log in zip(claims, logs, strict=True):
            steps(written, claim, islice(log, 5))
        expect(page.locator(".figure-curves .point")).to_have_count(1 + iteration)
    happened = page.locator(".events li")
    expect(happened.first).to_contain_text("Repetition 1, iteration 2: the controller reaches")
    expect(page.locator(".facts")).to_contain_text("4 of 6")

    for claim, log in zip(claims, logs, strict=True):
        steps(written, claim, log)
        assert execution.complete(written, claim)
    expect(page.locator(".state-now")).to_contain_text("completed")
    expect(happened.first).to_contain_text("Completed")
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    expect(page.get_by_role("tabpanel").locator("tbody .state-badge.completed")).to_have_count(2)
    simulators = page.locator(".figure-simulators")
    simulators.scroll_into_view_if_needed()
    expect(simulators.locator(".legendtext").get_by_text("Reality", exact=True)).to_be_visible()
    assert page.evaluate("() => window.untouched")


@pytest.mark.release
def test_repetitions_stand_behind_the_mean_and_reality_is_hidden_until_the_end(
    api: Any, written: Store, visit: Any
) -> None:
    submitted = submit_one(written, toy(repetitions=2))
    for claim in execution.claim(written, "tests", 2):
        steps(written, claim, some_log())
    page = visit(address(api, submitted.id))
    curve = page.locator(".figure-curves")
    expect(curve.locator(".point")).to_have_count(3)
    before = curve.locator(".js-line").count()
    curve.get_by_role("checkbox", name="Each repetition").check()
    expect(curve).to_contain_text("Faint lines: single repetitions")
    assert curve.locator(".js-line").count() > before
    curve.get_by_label("Band").select_option("interval")
    expect(curve).to_contain_text("95 % interval of the mean")
    simulators = page.locator(".figure-simulators")
    simulators.scroll_into_view_if_needed()
    expect(simulators.locator(".legendtext")).to_have_text(["Best simulator of a repetition"])
    expect(simulators).to_contain_text("Reality is shown once")


@pytest.mark.release
def test_it_says_that_the_service_is_away_and_catches_up_by_itself(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(repetitions=1))
    (claim,) = execution.claim(written, "tests", 1)
    log = some_log()
    steps(written, claim, islice(log, 3))
    visit.forgive("ERR_", "net::")
    page = visit(address(api, submitted.id))
    expect(page.locator(".figure-curves .point")).to_have_count(1)
    api.kill()
    expect(page.locator("#connection")).not_to_be_empty()
    expect(page.locator(".figure-curves .point")).to_have_count(1)
    steps(written, claim, log)
    assert execution.complete(written, claim)
    api.start()
    expect(page.locator(".figure-curves .point")).to_have_count(3)
    expect(page.locator(".state-now")).to_contain_text("completed")
    expect(page.locator("#connection")).to_be_empty()


def test_what_failed_is_said_with_its_reason_and_attempts(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(repetitions=1))
    (claim,) = execution.claim(written, "tests", 1)
    assert execution.fail(written, claim, Failure("a foot fell off"))
    page = visit(address(api, submitted.id))
    expect(page.locator(".state-now")).to_contain_text("failed")
    expect(page.locator(".remark.broken")).to_contain_text("a foot fell off")
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    page.get_by_role("button", name="Attempts at repetition 0: 1").click()
    attempts = page.get_by_role("region", name="Attempts at repetition 0")
    expect(attempts).to_contain_text("a foot fell off")


@pytest.mark.release
def test_there_is_nothing_yet_or_no_such_experiment(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy())
    page = visit(address(api, submitted.id, tab="samples"))
    expect(page.locator(".figure-curves")).to_contain_text("Nothing to draw yet.")
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    expect(page.get_by_role("tabpanel")).to_contain_text("Nothing was tried in reality yet.")
    axe(page)
    visit.forgive("404")
    page.goto(f"{api.url}/#/experiments/nowhere")
    expect(page.get_by_role("alert")).to_contain_text("nowhere")


@pytest.mark.release
def test_predictions_are_drawn_once_all_are_computed(archive: Any, ended: Any, visit: Any) -> None:
    computed = f"/experiments/{ended['id']}/predictions"
    wait_until(lambda: archive.http.get(computed).is_success)  # a busy machine starts physics slowly
    page = visit(address(archive, ended["id"]))
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url) if "/predictions" in request.url else None)
    page.reload()
    figure = page.locator(".figure-predictions")
    figure.scroll_into_view_if_needed()

    expect(figure).to_contain_text("400 samples of 40 repetitions")  # 800 rollouts of low priority
    expect(figure).not_to_contain_text("still being computed")
    assert [url.split("?")[0].endswith("/figures/predictions") for url in asked][:2] == [False, True]


@pytest.mark.release
def test_details_are_reached_by_keyboard_and_are_in_the_address(api: Any, known: Any, visit: Any) -> None:
    page = visit(address(api, known.ids[0], tab="samples"))
    panel = page.get_by_role("tabpanel")
    panel.scroll_into_view_if_needed()
    expect(panel.locator("tbody tr")).to_have_count(25)
    first = panel.locator("tbody tr").first.inner_text()
    step = panel.get_by_role("link", name="Step").first.get_attribute("href")
    assert step == f"#/toy?experiment={known.ids[0]}&repetition=0&iteration=0"
    panel.get_by_role("button", name="Next").click()
    expect(page.get_by_text("Page 2")).to_be_visible()
    assert panel.locator("tbody tr").first.inner_text() != first
    panel.get_by_label("Show").select_option("sample")
    expect(panel.locator("tbody")).not_to_contain_text("probe")

    page.get_by_role("tab", name="Real-world samples").press("ArrowRight")
    expect(page.get_by_role("tab", name="Misfit")).to_be_focused()
    expect(panel.get_by_role("table", name="Misfit by iteration").get_by_role("row")).to_have_count(12)
    expect(panel.get_by_role("table", name="Which tunables are identified").get_by_role("row")).to_have_count(4)
    assert page.evaluate("() => location.hash").endswith("?tab=misfit")
    page.get_by_role("tab", name="Misfit").press("End")
    expect(panel.locator("code")).to_contain_text('"seed": 7')
    panel.get_by_role("button", name="Copy the spec").click()
    expect(panel.get_by_role("button", name="Copied")).to_be_visible()
    assert (
        json.loads(page.evaluate("() => navigator.clipboard.readText()"))
        == api.get(f"/experiments/{known.ids[0]}")["spec"]
    )


def test_its_files_are_saved(api: Any, known: Any, visit: Any) -> None:
    page = visit(address(api, known.ids[0]))
    with page.expect_download() as archived:
        page.get_by_role("link", name="Archive of everything").click()
    assert archived.value.suggested_filename.endswith(".zip")
    with page.expect_download() as saved:
        page.locator(".figure-curves").get_by_role("link", name="CSV").click()
    assert saved.value.path().read_text().startswith("experiment,name,strategy,repetition")
    for figure in page.locator(".figures > section").all():
        figure.scroll_into_view_if_needed()
    links = page.locator(".figures .files a, .figure-curves .files a")
    expect(links).to_have_count(4 * 3 + 4)
    drawn = httpx2.get(f"{api.url}/{links.first.get_attribute('href')}", timeout=LONGEST_S)
    assert drawn.status_code == 200


@pytest.mark.release
@pytest.mark.parametrize("dark", [False, True])
def test_it_is_accessible_and_fits_a_phone(archive: Any, ended: Any, visit: Any, dark: Any) -> None:
    shade = "dark" if dark else "light"
    for width in (1280, 375):
        page = visit(address(archive, ended["id"]), dark=dark, width=width)
        expect(page.locator(".figure-curves .point")).to_have_count(11)
        for figure in page.locator(".figures > section").all():
            figure.scroll_into_view_if_needed()
            expect(figure.locator(".plot .main-svg").first).to_be_visible()
        expect(page.get_by_role("tabpanel").locator("tbody tr")).to_have_count(40)
        axe(page)
        fits(page)
        screenshot(page, f"experiment-{shade}-{width}")
