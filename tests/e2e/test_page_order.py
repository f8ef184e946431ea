"""Answers that come late, twice, or not at all: what the page shows is of what was asked last, and all of it."""

import json
import re
from typing import Any

import pytest

QUIET = "#/toy"  # a view that asks for nothing
QUEUED = {"robot": "toy_function", "strategies": ["random"], "budget": "smoke"}


def test_an_address_that_cannot_be_an_id_is_no_page(visit: Any, api: Any) -> None:
    page = visit(f"{api.url}/{QUIET}")

    for view in (
        "experiments/%",
        "experiments/..%2F..",
        "studies/%E0%A4%A",
        "replay?experiment=../studies",
        "toy?experiment=..%2Fcatalogue%3F",
    ):
        page.get_by_role("heading", name="The toy function").wait_for()
        page.goto(f"{api.url}/#/{view}")
        page.get_by_role("heading", name="There is no such page").wait_for()
        page.goto(f"{api.url}/{QUIET}")


@pytest.mark.release
def test_what_was_typed_just_before_one_left_does_not_change_the_address_of_another_view(
    visit: Any, archive: Any
) -> None:
    page = visit(archive.url)
    page.locator("tr.study").first.wait_for()

    page.get_by_label("Search by words or a query").fill("mujoco")
    page.evaluate(f"() => {{ location.hash = '{QUIET}'; }}")
    page.get_by_role("heading", name="The toy function").wait_for()
    page.wait_for_timeout(500)

    assert page.url.endswith(QUIET)


@pytest.mark.release
def test_more_of_a_list_that_another_has_replaced_is_not_added_to_it(visit: Any, archive: Any) -> None:
    page = visit(archive.url)
    page.locator("tr.study").nth(19).wait_for()
    late = []
    page.route("**/studies?*cursor=*", lambda route: late.append(route))

    page.get_by_role("button", name="Show more").click()
    page.get_by_label("Search by words or a query").fill("nothing is called so")
    page.get_by_text("Nothing fits these filters.").wait_for()
    (asked,) = late
    with page.expect_response("**/studies?*cursor=*"):
        asked.continue_()
    page.wait_for_timeout(200)

    assert page.locator("tr.study").count() == 0


@pytest.mark.release
def test_earlier_events_and_the_next_page_of_samples_come_once_however_fast_one_presses(
    visit: Any, archive: Any
) -> None:
    (study,) = archive.get("/studies", q="robot = quadruped and strategy = simulated_fit")["items"]
    ended = next(each["id"] for each in study["experiments"] if each["strategy"] == "simulated_fit")
    page = visit(f"{archive.url}/#/experiments/{ended}?tab=samples")
    more, events = page.get_by_role("button", name="Earlier"), page.locator(".events li")
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    page.get_by_text("Page 1", exact=True).wait_for()
    events.first.wait_for()

    if more.is_visible():
        more.evaluate("(button) => { button.click(); button.click(); }")
        page.wait_for_load_state("networkidle")
    numbers = events.evaluate_all("(all) => all.map((each) => each.dataset.number)")
    page.get_by_role("button", name="Next").evaluate("(button) => { button.click(); button.click(); }")

    page.get_by_text("Page 2", exact=True).wait_for()
    assert len(set(numbers)) == len(numbers)


def test_a_number_is_submitted_as_it_was_typed_or_not_at_all(visit: Any, api: Any) -> None:
    visit.forgive("422")
    page = visit(f"{api.url}/#/new")
    page.locator(".panel .big").wait_for()
    seed = 2**64 - 1

    page.get_by_label("Seed").fill(str(seed))
    page.get_by_text("Advanced").last.click()
    with page.expect_request(lambda asked: "1e999" in (asked.post_data or "")) as sent:
        page.get_by_label("Repetitions at once").fill("1e999")

    page.locator(".trouble", has_text="integer").or_(page.locator(".trouble", has_text="whole number")).wait_for()
    typed = json.loads(sent.value.post_data)
    assert (typed["seed"], typed["max_parallel"]) == (seed, "1e999")
    spec = {"robot": "toy_function", "strategy": "random", "budget": "smoke", "seed": seed}
    made = api.http.post("/experiments", json=spec).json()["id"]
    page.goto(f"{api.url}/#/experiments/{made}?tab=spec")
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    page.get_by_text(f'"seed": {seed}').wait_for()
    api.http.post(f"/studies/{made}/cancel")


@pytest.mark.release
def test_a_figure_that_the_service_did_not_answer_with_is_asked_for_again_and_none_stands_for_another(
    visit: Any, archive: Any
) -> None:
    visit.forgive("ERR_FAILED")
    made = archive.http.post("/experiments", json={"robot": "toy_function", "strategy": "random", "budget": "smoke"})
    page = visit(f"{archive.url}/#/toy?experiment={made.json()['id']}")
    page.get_by_text("Nothing to draw yet.").wait_for()

    page.route("**/figures/toy*", lambda route: route.abort())
    page.get_by_label("Iteration", exact=True).press("ArrowRight")
    page.get_by_role("heading", name="The service does not answer").wait_for()
    page.unroute("**/figures/toy*")

    page.get_by_text("Nothing to draw yet.").wait_for()
    archive.http.post(f"/studies/{made.json()['id']}/cancel")


@pytest.mark.release
def test_a_stream_that_is_refused_is_not_a_service_that_is_away(visit: Any, archive: Any) -> None:
    visit.forgive("429")
    page = visit(f"{archive.url}/{QUIET}")
    refusal = {"status": 429, "title": "Too many", "detail": "20 streams are open."}
    page.route(re.compile("/events(\\?|$)"), lambda route: route.fulfill(status=429, json=refusal))

    page.evaluate("() => { location.hash = '#/'; }")

    page.get_by_text("Live updates are refused: 20 streams are open; trying again…").wait_for()


@pytest.mark.parametrize("status", [pytest.param(401, marks=pytest.mark.release), 409])
def test_a_page_that_no_longer_holds_is_loaded_again(visit: Any, api: Any, status: int) -> None:
    visit.forgive("40")
    page = visit(f"{api.url}/{QUIET}")
    refusals = iter([{"status": status, "title": "Over", "detail": "The database was replaced."}])

    def refuse_once(route: Any) -> None:
        if (refusal := next(refusals, None)) is None:
            route.continue_()
        else:
            route.fulfill(status=status, json=refusal)

    page.route(re.compile("/events(\\?|$)"), refuse_once)
    with page.expect_event("load"):
        page.evaluate("() => { location.hash = '#/'; }")

    page.locator("tr.study").first.wait_for()


@pytest.mark.release
def test_a_list_that_did_not_come_is_not_said_to_be_empty_and_comes_by_itself(visit: Any, archive: Any) -> None:
    visit.forgive("ERR_FAILED")
    page = visit(archive.url)
    page.locator("tr.study").nth(19).wait_for()

    page.route("**/studies?*", lambda route: route.abort())
    page.get_by_label("State").select_option("CANCELLED")
    page.get_by_role("heading", name="The service does not answer").wait_for()
    assert page.locator("tr.study").count() == 0
    assert page.get_by_text("Nothing fits these filters").count() == 0
    page.unroute("**/studies?*")

    page.locator("tr.study").first.wait_for()
    page.get_by_role("heading", name="The service does not answer").wait_for(state="detached")


@pytest.mark.release
def test_more_of_a_list_that_does_not_come_is_said_and_asked_for_again(visit: Any, archive: Any) -> None:
    visit.forgive("500")
    page = visit(archive.url)
    page.locator("tr.study").nth(19).wait_for()

    busy = {"status": 500, "title": "Busy"}
    page.route("**/studies?*cursor=*", lambda route: route.fulfill(status=500, json=busy))
    page.get_by_role("button", name="Show more").click()
    page.get_by_role("heading", name="Busy").wait_for()
    assert page.locator("tr.study").count() == 20
    page.unroute("**/studies?*cursor=*")
    page.get_by_role("button", name="Try again").click()

    page.locator("tr.study").nth(29).wait_for()
    page.get_by_role("heading", name="Busy").wait_for(state="detached")


@pytest.mark.release
def test_a_part_that_could_not_be_had_for_a_while_is_not_left_as_it_was(visit: Any, archive: Any) -> None:
    visit.forgive("500", "console: ")
    made = archive.http.post("/experiments", json={"robot": "toy_function", "strategy": "random", "budget": "smoke"})
    page = visit(f"{archive.url}/#/experiments/{made.json()['id']}?tab=repetitions")
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    page.locator("tbody .state-badge.queued").first.wait_for()

    page.route("**/repetitions", lambda route: route.fulfill(status=500, json={"status": 500, "title": "Busy"}))
    archive.http.post(f"/studies/{made.json()['id']}/cancel")
    page.locator(".state-now .state-badge.cancelled").wait_for()
    page.wait_for_timeout(3000)
    page.unroute("**/repetitions")

    page.locator("tbody .state-badge.cancelled").first.wait_for()


@pytest.mark.release
def test_what_was_saved_is_shown_though_nothing_can_be_looked_at_any_more(visit: Any, archive: Any) -> None:
    visit.forgive("ERR_FAILED")
    study = archive.http.post("/studies", json=QUEUED | {"name": "first name"}).json()["id"]
    page = visit(f"{archive.url}/#/studies/{study}")
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Edit name, notes and tags").click()
    page.get_by_label("Name", exact=True).fill("second name")

    page.route("**/*", lambda route: route.abort() if route.request.method == "GET" else route.continue_())
    page.get_by_role("button", name="Save").click()

    page.get_by_role("heading", name="second name").wait_for()
    page.locator("dialog").wait_for(state="detached")
    page.unroute("**/*")
    archive.http.post(f"/studies/{study}/cancel")


def test_a_change_whose_answer_was_lost_is_not_taken_for_somebody_elses(visit: Any, api: Any) -> None:
    visit.forgive("ERR_FAILED", "412")
    study = api.http.post("/studies", json=QUEUED | {"name": "first name"}).json()["id"]
    page = visit(f"{api.url}/#/studies/{study}")
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Edit name, notes and tags").click()
    page.get_by_label("Name", exact=True).fill("second name")

    page.route(f"**/studies/{study}", lambda route: (route.fetch(), route.abort()))
    page.get_by_role("button", name="Save").click()
    page.locator("dialog").get_by_text("It may be down").wait_for()
    page.unroute(f"**/studies/{study}")
    page.get_by_role("button", name="Save").click()

    page.get_by_role("heading", name="second name").wait_for()
    page.locator("dialog").wait_for(state="detached")
    api.http.post(f"/studies/{study}/cancel")


@pytest.mark.release
def test_an_estimate_that_comes_late_does_not_wipe_away_why_the_study_was_refused(visit: Any, archive: Any) -> None:
    visit.forgive("429")
    page = visit(f"{archive.url}/#/new")
    page.locator(".panel .big").wait_for()
    late = []
    page.route("**/studies/estimate", lambda route: late.append(route))
    page.route("**/studies", lambda route: route.fulfill(status=429, json={"status": 429, "title": "Too many"}))

    page.get_by_label("Name", exact=True).fill("one too many")
    with page.expect_request("**/studies/estimate"):
        page.get_by_role("button", name="Submit the study").click()
    refusal = page.get_by_role("alert").get_by_text("Too many").first
    refusal.wait_for()
    with page.expect_response("**/studies/estimate"):
        late[-1].continue_()
    page.wait_for_timeout(200)
    assert refusal.is_visible()
    page.unroute("**/studies/estimate")
    page.get_by_label("Name", exact=True).fill("another")

    refusal.wait_for(state="detached")
