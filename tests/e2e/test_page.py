"""The page on a real service: a study from the form to its end, called off, and in sight while the service dies.

For a release: the page knows only the API, and other tests have both it on the API and the API with workers.
"""

from typing import Any

import pytest

from tests.e2e.browser import axe, screenshot
from tests.waiting import wait_until

pytestmark = pytest.mark.release

LONG_MS = 240_000
AWAY = ("ERR_CONNECTION_REFUSED", "ERR_CONNECTION_RESET", "ERR_EMPTY_RESPONSE", "ERR_INCOMPLETE_CHUNKED_ENCODING")

SLOW = {
    "name": "slow",
    "robot": "toy_function",
    "strategies": ["simulated_fit_and_informative", "known_fit", "direct"],
    "budget": {"controller_evaluations": 600, "selection_evaluations": 100, "simulator_evaluations": 100},
    "iterations": 2,
    "repetitions": 4,
    "seed": 5,
}


def test_a_study_is_submitted_by_the_form_and_finishes_while_one_watches(visit: Any, shared_service: Any) -> None:
    page = visit(f"{shared_service.url}/#/new")
    page.get_by_role("button", name="Toy function, quickly").click()
    page.get_by_label("Name", exact=True).fill("by the form")
    page.get_by_label("Iterations").fill("3")
    page.get_by_text("rollouts at most").wait_for()

    page.get_by_role("button", name="Submit the study").click()

    page.get_by_role("heading", name="by the form").wait_for()
    page.locator(".state-now .completed").wait_for(timeout=LONG_MS)
    page.locator(".plot .scatterlayer .trace").first.wait_for(state="attached")
    page.locator("table .percent", has_text="100 %").nth(6).wait_for()
    axe(page)
    screenshot(page, "study-live")
    visit.forgive("409")  # the direct baseline is as large already
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Extend…").click()
    page.get_by_label("Iterations in all").fill("4")
    page.get_by_role("button", name="Extend it").click()
    page.locator("dialog").wait_for(state="detached")
    (study,) = shared_service.get("/studies", text="by the form")["items"]
    assert [each["spec"]["iterations"] for each in study["experiments"]] == [4] * 6 + [3]


def test_a_running_study_is_cancelled_after_a_question(visit: Any, shared_service: Any) -> None:
    study = shared_service.post("/studies", SLOW | {"name": "to be cancelled"})["id"]
    page = visit(f"{shared_service.url}/#/studies/{study}")
    page.locator(".state-now .running").wait_for(timeout=LONG_MS)

    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Cancel…").click()
    page.get_by_role("button", name="Back").click()
    assert shared_service.get(f"/studies/{study}")["state"] == "RUNNING"
    page.get_by_role("button", name="Cancel…").click()
    axe(page)
    page.get_by_role("button", name="Cancel it").click()

    page.locator(".state-now .cancelled").wait_for()
    assert shared_service.get(f"/studies/{study}")["state"] == "CANCELLED"
    page.get_by_role("button", name="Pause").press("Enter")
    page.get_by_text("None of its experiments can be paused now").wait_for()


def test_killed_and_started_again_the_service_is_followed_by_pages_that_stayed_open(
    visit: Any, shared_service: Any
) -> None:
    visit.forgive(*AWAY)
    study = shared_service.post("/studies", SLOW | {"name": "outlives its service"})["id"]
    one, all_of_them = visit(f"{shared_service.url}/#/studies/{study}"), visit(shared_service.url)
    row = all_of_them.locator("tr.study", has_text="outlives its service")
    one.locator(".state-now .running").wait_for(timeout=LONG_MS)
    row.locator(".running").wait_for()

    shared_service.kill()
    wait_until(lambda: not shared_service.processes(), otherwise=shared_service.processes)
    for page in (one, all_of_them):
        page.get_by_text("The service is away").wait_for()
    screenshot(one, "away")
    axe(one)
    shared_service.start()

    for page in (one, all_of_them):
        page.wait_for_function("() => document.getElementById('connection').textContent === ''")
    one.locator(".state-now .completed").wait_for(timeout=LONG_MS)
    row.locator(".completed").wait_for()
    one.locator(".plot .scatterlayer .trace").first.wait_for(state="attached")


def test_a_page_that_is_opened_before_its_service_answers_comes_by_itself(visit: Any, shared_service: Any) -> None:
    visit.forgive(*AWAY)
    page = visit(shared_service.url)
    page.get_by_role("heading", name="Studies", exact=True).wait_for()
    shared_service.stop()
    page.get_by_role("link", name="New study").first.click()
    page.get_by_role("heading", name="The service does not answer").wait_for()
    axe(page)

    shared_service.start()

    page.get_by_role("button", name="Submit the study").wait_for()
