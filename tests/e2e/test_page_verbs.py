"""What may be asked of an experiment on its page: the verbs, its turn, its name, and what a reader may not."""

import re
from typing import Any

import pytest
from playwright.sync_api import expect

from gaplab.schemas.spec import StudySpec
from gaplab.services.experiments import submission
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.experiments import run, some_log, submit_one, toy

TWO = {
    "robot": "toy_function",
    "budget": "smoke",
    "strategies": ["random", "direct"],
    "tunables": ["static_friction", "dynamic_friction"],
}


def address(api: Any, experiment: Any) -> str:
    return f"{api.url}/#/experiments/{experiment}"


def test_the_verbs_do_what_they_say_and_refuse_with_the_reason(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy())
    page = visit(address(api, submitted.id))
    verbs = page.get_by_role("group", name="Actions")
    state = page.locator(".state-now")
    expect(verbs.get_by_role("button")).to_have_text(["Pause", "More actions…"])
    verbs.get_by_role("button", name="More actions").click()
    verbs.get_by_role("button", name="Resume").press("Enter")
    expect(page.locator(".life-cycle .outcome").first).to_contain_text(
        "queued cannot be resumed, only one that is pausing or paused"
    )

    verbs.get_by_role("button", name="Pause").click()
    expect(state).to_contain_text("paused")
    verbs.get_by_role("button", name="Resume").click()
    expect(state).to_contain_text("queued")

    verbs.get_by_role("button", name="Change schedule").click()
    page.get_by_label("Priority").fill("7")
    page.get_by_label("Repetitions at once").fill("2")
    page.get_by_role("button", name="Change it", exact=True).click()
    expect(page.locator(".facts")).to_contain_text("at most 2")
    assert api.get(f"/experiments/{submitted.id}")["priority"] == 7

    verbs.get_by_role("button", name="Cancel").click()
    page.get_by_role("button", name="Back").click()
    assert api.get(f"/experiments/{submitted.id}")["state"] == "QUEUED"
    verbs.get_by_role("button", name="Cancel").press("Enter")
    page.get_by_role("button", name="Cancel it").press("Enter")
    expect(state).to_contain_text("cancelled")
    expect(verbs.get_by_role("button", name="Pause")).to_have_attribute("aria-disabled", "true")


@pytest.mark.release
def test_a_completed_experiment_is_extended_and_a_running_one_stopped(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(repetitions=1))
    (claim,) = execution.claim(written, "tests", 1)
    run(written, claim)
    page = visit(address(api, submitted.id))
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Extend").click()
    page.get_by_label("Repetitions in all").fill("2")
    page.get_by_role("button", name="Extend it").click()
    expect(page.locator(".state-now")).to_contain_text("queued")
    expect(page.locator(".facts")).to_contain_text("1 of 2")
    page.get_by_role("button", name="Stop").click()
    page.get_by_role("button", name="Stop it").click()
    expect(page.locator(".state-now")).to_contain_text("completed")


@pytest.mark.release
def test_the_direct_baseline_is_extended_by_repetitions_alone(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(strategy="direct", repetitions=1))
    (claim,) = execution.claim(written, "tests", 1)
    run(written, claim, some_log(0))
    page = visit(address(api, submitted.id))
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Extend").click()
    expect(page.get_by_label("Iterations in all")).to_have_count(0)
    page.get_by_label("Repetitions in all").fill("2")
    page.get_by_role("button", name="Extend it").click()
    expect(page.locator(".facts")).to_contain_text("1 of 2")


@pytest.mark.release
def test_a_study_is_extended(api: Any, written: Store, visit: Any) -> None:
    study = submission.submit(written, StudySpec.model_validate(TWO | {"iterations": 2, "repetitions": 1}))
    for claim in execution.claim(written, "tests", 2):
        run(written, claim, some_log(2 if claim.spec.strategy.name == "random" else 0))
    page = visit(f"{api.url}/#/studies/{study.id}")
    page.get_by_label("Band").select_option("sd")
    expect(page.get_by_role("link", name="SVG")).to_have_attribute("href", re.compile("band=sd"))
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Extend").click()
    expect(page.get_by_role("dialog")).to_contain_text("Now 2. Empty: unchanged.")
    page.get_by_label("Repetitions in all").fill("3")
    page.get_by_role("button", name="Extend it").click()
    expect(page.locator(".state-now").first).to_contain_text("queued")
    assert [each["spec"]["repetitions"] for each in api.get(f"/studies/{study.id}")["experiments"]] == [3, 3]


@pytest.mark.release
def test_a_study_gets_more_iterations_and_its_baseline_no_more_repetitions(
    api: Any, written: Store, visit: Any
) -> None:
    size = {"iterations": 2, "repetitions": 1, "direct_repetitions": 3}
    study = submission.submit(written, StudySpec.model_validate(TWO | size))
    for claim in execution.claim(written, "tests", 9):
        run(written, claim, some_log(2 if claim.spec.strategy.name == "random" else 0))
    page = visit(f"{api.url}/#/studies/{study.id}")
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Extend").click()
    expect(page.get_by_role("dialog")).to_contain_text("Now 1 to 3. Empty: unchanged.")
    page.get_by_label("Iterations in all").fill("3")
    page.get_by_role("button", name="Extend it").click()
    expect(page.locator(".state-now").first).to_contain_text("running")
    grown = {each["strategy"]: each["spec"] for each in api.get(f"/studies/{study.id}")["experiments"]}
    assert (grown["random"]["iterations"], grown["random"]["repetitions"]) == (3, 1)
    assert grown["direct"]["repetitions"] == 3


def test_nobody_writes_over_a_name_that_was_changed_meanwhile_unseen(api: Any, written: Store, visit: Any) -> None:
    submitted = submit_one(written, toy(name="mine"))
    visit.forgive("412")
    page = visit(address(api, submitted.id))
    page.get_by_role("button", name="More actions").click()
    page.get_by_role("button", name="Edit name, notes and tags").click()
    page.get_by_label("Notes", exact=True).fill("On the second robot")
    theirs = api.http.patch(f"/studies/{submitted.id}", json={"name": "theirs"}, headers={"If-Match": "*"})
    assert theirs.status_code == 200
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("dialog").get_by_role("alert")).to_contain_text("“theirs”")
    page.get_by_label("Name", exact=True).fill("<b>ours</b>")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("heading", level=1)).to_have_text("<b>ours</b>")
    expect(page.locator(".notes")).to_have_text("On the second robot")
