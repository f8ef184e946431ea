"""The bench on a phone: what to measure next, answers that outlive the network, and what is taken back."""

import re
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Error, expect

from gaplab.schemas.lifecycle import Verb
from gaplab.schemas.measurements import MeasurementSpec, TakeSpec
from gaplab.services.experiments import lifecycle
from gaplab.services.experiments.limits import FREELY
from gaplab.services.measuring import answering, attachments, taking
from gaplab.services.measuring.taking import RequestFilter
from gaplab.services.store.session import Store
from tests.e2e.browser import axe, fits, screenshot
from tests.experiments import submit_one
from tests.integration.test_bench import bench, compute, fall_silent, finish
from tests.integration.test_bench_http import traces_of

PHONE = {"width": 390, "height": 844}
MODES: dict[str, dict[str, Any]] = {"light": {}, "dark": {"dark": True}, "phone": PHONE}
CUT = ("ERR_", "net::")
KEYS = "() => Object.keys(localStorage).filter((key) => key.includes(' answer '))"


def asked(store: Store, name: str, **changes: Any) -> Any:
    """An experiment on a bench of this name, and what it waits for."""
    reality = {"bench": name, "repeats": 3} | changes.pop("reality", {})
    experiment = submit_one(store, bench(name=name, reality=reality, **changes))
    compute(store)
    return experiment, *waiting(store, experiment)


def waiting(store: Store, experiment: Any) -> Any:
    return taking.list_requests(store, RequestFilter(experiment=experiment.id)).items


def answers_of(store: Store, request: Any) -> Any:
    return taking.read_request(store, request.id).answers


def fill(page: Any, *values: str) -> None:
    for repeat, value in enumerate(values, start=1):
        page.get_by_label(f"Repeat {repeat} (m/s)", exact=True).fill(value)


def take(page: Any, operator: str = "Ada") -> None:
    page.get_by_label("Your name").fill(operator)
    page.get_by_role("button", name="Take it").click()
    page.get_by_text(f"You have it, as {operator}.").wait_for()


def test_an_operator_takes_measures_and_sends(visit: Any, api: Any, written: Store) -> None:
    experiment, request = asked(written, "table")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    expect(page.get_by_role("heading", name="Toy function: probe of iteration 0")).to_be_visible()
    expect(page.get_by_text("3 repeats")).to_be_visible()
    expect(page.get_by_role("navigation", name="Pages").get_by_role("link", name="Bench")).to_be_visible()

    take(page)
    page.get_by_role("button", name="Give it back").click()
    page.get_by_role("button", name="Take it").wait_for()
    assert waiting(written, experiment)[0].state == "open"
    take(page)
    assert taking.read_request(written, request.id).taken_by == "Ada"
    page.reload()
    page.get_by_text("You have it, as Ada.").wait_for()
    fill(page, "0,41", "x", "")
    page.get_by_role("button", name="Send 3 values").click()
    expect(page.get_by_text("“x” is not a number")).to_be_visible()
    expect(page.get_by_text("a number is missing")).to_be_visible()
    page.reload()
    expect(page.get_by_label("Repeat 1 (m/s)", exact=True)).to_have_value("0,41")
    fill(page, "0,41", "0.44", "0.4")
    page.get_by_label("Note", exact=True).fill("wet floor")
    page.get_by_label("Photos and other files").set_input_files(
        {"name": "run.csv", "mimeType": "text/csv", "buffer": b"0,1"}
    )
    page.get_by_text("✓ run.csv").wait_for()
    page.get_by_role("button", name="Send 3 values").click()

    expect(page.get_by_text("All of them are stored by the service.")).to_be_visible()
    (answer,) = answers_of(written, request)
    assert answer.attachments == (sha256(b"0,1").hexdigest(),)
    assert (answer.values, answer.operator, answer.note, answer.state) == (
        (0.41, 0.44, 0.4),
        "Ada",
        "wet floor",
        "counted",
    )
    compute(written)
    expect(page.get_by_role("heading", name="Toy function: sample of iteration 1")).to_be_visible()


@pytest.mark.release
def test_a_phone_is_told_that_readings_are_needed_and_sends_traces(
    visit: Any, api: Any, written: Store, tmp_path: Path
) -> None:
    walker = {"robot": "quadruped", "discrepancy": "readings"}
    experiment, request = asked(written, "camera", **walker, reality={"repeats": 2})
    taking.take(written, request.id, TakeSpec(operator="Eve", lease_s=600.0), FREELY)
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    page.get_by_role("button", name="Show Quadruped").click()
    expect(page.get_by_text("send a trace for each repeat")).to_be_visible()
    expect(page.get_by_text("move the joints slowly to the start pose")).to_be_visible()

    page.get_by_role("button", name="End that take…").click()
    page.get_by_label("Your name").last.fill("Ada")
    page.get_by_label("Why?").last.fill("her phone is dead")
    page.get_by_role("button", name="End it").click()
    expect(page.get_by_label("Your name")).to_have_value("Ada")
    page.get_by_role("button", name="Take it").click()
    page.get_by_text("You have it, as Ada.").wait_for()
    page.get_by_label("Traces (CSV) in place of values").set_input_files([*traces_of(request.genome, tmp_path)])
    page.get_by_text("✓").nth(1).wait_for()
    send = page.get_by_role("button", name="Send 2 values")
    send.click()
    expect(page.get_by_text("Send the traces?")).to_contain_text("m/s")
    send.click()

    expect(page.get_by_text("All of them are stored by the service.")).to_be_visible()
    (answer,) = answers_of(written, request)
    assert (len(answer.traces), answer.operator) == (2, "Ada")
    assert answer.readings


@pytest.mark.release
def test_an_operator_is_asked_once_about_an_unlikely_number(visit: Any, api: Any, written: Store) -> None:
    experiment, request = asked(written, "slip")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    take(page)
    fill(page, "0.41", "44", "0.4")
    send = page.get_by_role("button", name="Send 3 values")
    send.click()
    expect(page.get_by_text("44 is 1.1e+02 times the other repeats")).to_be_visible()
    assert answers_of(written, request) == ()
    send.click()

    expect(page.get_by_text("All of them are stored by the service.")).to_be_visible()
    assert [(answer.values[1], answer.doubts) for answer in answers_of(written, request)] == [(44.0, ())]


@pytest.mark.release
def test_an_operator_keeps_the_form_when_the_experiment_is_paused(visit: Any, api: Any, written: Store) -> None:
    experiment, _ = asked(written, "stairs")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", height=4000)  # so that all is in sight
    take(page)
    fill(page, "0.41", "0.44")
    lifecycle.ask(written, experiment.id, Verb.PAUSE)
    page.reload()
    expect(page.get_by_label("Repeat 2 (m/s)", exact=True)).to_have_value("0.44")
    page.get_by_role("button", name="Give it back").click()
    expect(page.get_by_text("Nothing is to be measured now.")).to_be_visible()

    visit.forgive(*CUT)
    page.route(re.compile("/events(\\?|$)"), lambda route: route.abort())  # it learns of the state from a reload alone
    page.goto(f"{api.url}/#/experiments/{experiment.id}?tab=samples")
    panel = page.get_by_role("tabpanel")
    expect(panel.get_by_text("○ open, but the experiment is paused")).to_be_visible()
    expect(panel.get_by_role("link", name="To the bench")).to_have_count(0)
    lifecycle.ask(written, experiment.id, Verb.RESUME)
    expect(panel.get_by_role("link", name="To the bench")).to_have_count(1)


@pytest.mark.parametrize(
    "moment", [pytest.param("before the service has it", marks=pytest.mark.release), "before it is acknowledged"]
)
def test_an_answer_in_a_cut_network_waits_and_is_stored_once(visit: Any, api: Any, written: Store, moment: str) -> None:
    visit.forgive(*CUT)
    experiment, request = asked(written, "cable")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    other = visit(f"{api.url}/#/toy")  # a second tab, with another view
    keys = []

    def cut(route: Any) -> None:
        keys.append(route.request.headers["idempotency-key"])
        if moment == "before it is acknowledged":
            route.fetch()
        with suppress(Error):  # on a slow machine the page has been loaded again meanwhile
            route.abort("connectionreset")

    page.context.route("**/measurements", cut)
    take(page)
    fill(page, "0.5", "0.6", "0.7")
    page.get_by_role("button", name="Send 3 values").click()
    expect(page.get_by_text("1 answer waits in this browser until the service has it.")).to_be_visible()
    expect(other.get_by_role("link", name="1 answer waits to be sent")).to_be_visible()
    axe(page)
    screenshot(page, "bench-waits")
    page.reload()
    expect(page.get_by_text("1 answer waits in this browser until the service has it.")).to_be_visible()
    assert len(page.evaluate(KEYS)) == 1
    page.context.unroute("**/measurements")

    page.evaluate("() => dispatchEvent(new Event('online'))")
    expect(page.get_by_text("All of them are stored by the service.")).to_be_visible()
    expect(other.locator("#unsent")).to_be_empty()
    (answer,) = answers_of(written, request)
    assert answer.values == (0.5, 0.6, 0.7)
    assert len(set(keys)) == 1


@pytest.mark.release
def test_without_a_network_the_page_says_so_and_keeps_what_is_entered(visit: Any, api: Any, written: Store) -> None:
    visit.forgive(*CUT)
    experiment, request = asked(written, "shed")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    take(page)
    page.context.set_offline(True)
    expect(page.get_by_text("The service does not answer")).to_be_visible()
    fill(page, "1", "2", "3")
    page.get_by_role("button", name="Send 3 values").click()
    expect(page.get_by_text("Nothing else is asked until your answer is stored.")).to_be_visible()
    page.context.set_offline(False)
    expect(page.get_by_text("All of them are stored by the service.")).to_be_visible()
    expect(page.get_by_text("The service does not answer")).to_be_hidden()
    assert [each.values for each in answers_of(written, request)] == [(1.0, 2.0, 3.0)]


@pytest.mark.release
def test_a_take_whose_answer_is_lost_is_this_browsers_all_the_same(visit: Any, api: Any, written: Store) -> None:
    visit.forgive(*CUT)
    experiment, _ = asked(written, "attic")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    page.get_by_label("Your name").fill("Ada")
    lost: list[int] = []

    def cut(route: Any) -> None:
        if not lost:
            lost.append(route.fetch().status)
            route.abort("connectionreset")
        else:
            route.continue_()

    page.context.route("**/take", cut)
    page.get_by_role("button", name="Take it").click()
    page.get_by_text("You have it, as Ada.").wait_for()
    (request,) = waiting(written, experiment)
    assert (request.state, request.takes) == ("taken", 1)


@pytest.mark.release
def test_what_was_sent_is_corrected_and_voided_after_what_follows_is_said(visit: Any, api: Any, written: Store) -> None:
    experiment, request = asked(written, "bay")
    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    page.get_by_label("Repeat 1 (m/s)", exact=True).wait_for()
    fill(page, "1.4", "0.44", "0.4")
    page.get_by_role("button", name="Send 3 values").click()
    page.get_by_role("button", name=re.compile("Correct….*probe of iteration 0")).click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("If it is corrected: nothing follows from it.")
    axe(page)
    screenshot(page, "bench-correct")
    dialog.get_by_label("Repeat 1 (m/s)", exact=True).fill("0.44")
    dialog.get_by_label("Why?").fill("a slip")
    dialog.get_by_role("button", name="Correct it").click()
    dialog.wait_for(state="detached")
    assert [(each.values, each.state) for each in answers_of(written, request)] == [
        ((1.4, 0.44, 0.4), "replaced"),
        ((0.44, 0.44, 0.4), "counted"),
    ]

    compute(written)
    (sample,) = waiting(written, experiment)
    page.get_by_role("heading", name="Toy function: sample of iteration 1").wait_for()
    page.get_by_text("It failed…").click()
    page.get_by_label("Why?").fill("a leg slipped off")
    page.get_by_role("button", name="Send that it failed").click()
    page.get_by_role("button", name=re.compile("Void….*sample of iteration 1")).click()
    expect(dialog).to_contain_text("the controller is requested again")
    dialog.get_by_label("Why?").fill("it was the wrong leg")
    dialog.get_by_role("button", name="Void it").click()
    dialog.wait_for(state="detached")
    expect(page.get_by_role("heading", name="Toy function: sample of iteration 1")).to_be_visible()
    assert waiting(written, experiment)[0].id == sample.id


@pytest.mark.release
def test_conflicts_are_decided_stuck_requests_opened_and_refusals_shown(visit: Any, api: Any, written: Store) -> None:
    visit.forgive("422", "409")
    experiment, request = asked(written, "yard", reality={"repeats": 1})
    trace = attachments.store_attachment(written, b"seen", "trace.csv", "text/csv").id
    for value, files in ((0.3, ()), (0.4, (trace,))):
        answer = MeasurementSpec(values=(value,), operator=f"of {value}", attachments=files)
        answering.answer(written, request.id, answer, FREELY)
    compute(written)
    (stuck,) = waiting(written, experiment)
    for _ in range(5):
        taking.take(written, stuck.id, TakeSpec(operator="robot 7", lease_s=1.0), FREELY)
        fall_silent(written)

    page = visit(f"{api.url}/#/bench?experiment={experiment.id}", **PHONE)
    page.get_by_role("heading", name="Conflicts to decide").wait_for()
    expect(page.get_by_text("by of 0.4, ")).to_contain_text(", with 1 file")
    axe(page)
    screenshot(page, "bench-conflict")
    page.get_by_role("button", name="This one counts…: 0.4").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("If it counts: ")
    dialog.get_by_label("Why?").fill("the first was misread")
    dialog.get_by_role("button", name="Let it count").click()
    page.get_by_role("heading", name="Conflicts to decide").wait_for(state="detached")
    assert [(each.values, each.state) for each in answers_of(written, request)] == [
        ((0.3,), "replaced"),
        ((0.4,), "counted"),
    ]

    page.get_by_role("button", name=re.compile("^Show ")).click()
    page.get_by_text("It was taken 5 times in a row without an answer.").wait_for()
    page.get_by_role("button", name="Open it again").click()
    page.get_by_role("button", name="Take it").wait_for()
    assert waiting(written, experiment)[0].state == "open"


@pytest.mark.release
@pytest.mark.parametrize("mode", ["light", "dark", "phone"])
def test_the_bench_and_its_experiment_are_accessible(visit: Any, api: Any, written: Store, mode: str) -> None:
    experiment, *_ = asked(written, f"lab {mode}", repetitions=2)
    page = visit(f"{api.url}/#/bench", **MODES[mode])
    page.get_by_role("heading", name="Others that wait").wait_for()
    axe(page)
    fits(page)
    screenshot(page, f"bench-{mode}")

    page.goto(f"{api.url}/#/experiments/{experiment.id}?tab=samples")
    page.locator(".state-now .waiting").wait_for()
    page.get_by_text(f"It waits for a measurement on the bench “lab {mode}”").wait_for()
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    page.get_by_role("tabpanel").locator("tbody tr").first.wait_for()
    axe(page)
    fits(page)
    screenshot(page, f"bench-experiment-{mode}")


@pytest.mark.release
def test_an_experiment_shows_repeats_history_and_closed_branches(visit: Any, api: Any, written: Store) -> None:
    known = [{"genome": [0.3], "values": [0.31, 0.33]}]
    reality = {"bench": "told", "repeats": 2, "samples": known}
    experiment = submit_one(written, bench(name="told", reality=reality))
    finish(written, lambda genome: genome[0])
    page = visit(f"{api.url}/#/experiments/{experiment.id}?tab=samples")
    page.locator(".state-now .completed").wait_for()
    page.get_by_role("tabpanel").scroll_into_view_if_needed()
    expect(page.locator("dl.facts")).to_contain_text("after 2 real-world evaluations (and 1 from before)")
    earlier = page.get_by_role("tabpanel").locator("tbody tr").first
    expect(earlier).to_have_text("all–sample from before0.31, 0.330.32✓ measured––")
    page.get_by_role("button", name="Correct… sample of iteration 1, repetition 0").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("will be computed again")
    dialog.get_by_label("Repeat 1 (m/s)", exact=True).fill("0.123")
    dialog.get_by_label("Why?").fill("a slip of the keyboard")
    dialog.get_by_role("button", name="Correct it").click()
    dialog.wait_for(state="detached")

    expect(page.locator(".state-now")).to_contain_text("queued")
    panel = page.get_by_role("tabpanel")
    expect(panel.get_by_text("in closed branch 1").first).to_be_visible()
    panel.get_by_text("1 other answer").first.click()
    expect(panel.get_by_text("replaced (a slip of the keyboard)")).to_be_visible()
    screenshot(page, "bench-measurements")
    page.get_by_role("tab", name="Closed branches").click()
    page.get_by_text("Branch 1 of repetition 0").click()
    expect(page.get_by_text("Repetition 0, iteration 2: selected a controller").last).to_be_visible()
    axe(page)
    screenshot(page, "bench-branches")
    page.locator(".event-list").scroll_into_view_if_needed()  # what is out of sight is loaded once it is seen
    expect(page.locator(".event-list li").first).to_contain_text("was corrected: a slip of the keyboard")


@pytest.mark.release
@pytest.mark.parametrize("mode", ["light", "dark", "phone"])
def test_the_form_takes_a_bench_with_samples_from_a_table(visit: Any, api: Any, written: Store, mode: str) -> None:
    visit.forgive("422")
    page = visit(f"{api.url}/#/new", **MODES[mode])
    page.get_by_role("button", name="Toy function, quickly").click()
    page.get_by_label("Reality", exact=True).select_option("physical")
    page.get_by_label("Name of the bench").fill("leg 1")
    page.get_by_label("Repeats of each measurement").fill("3")
    page.get_by_text("Samples that were measured before").click()
    area = page.get_by_label("Table as CSV")
    area.fill("gene_0,value_1,value_2\n0.2,0.4,x\n7,0.4,0.5\n")
    page.get_by_role("button", name="Check and use the table").click()
    errors = page.get_by_role("table", name="Errors in the table")
    expect(errors.locator("tbody tr")).to_have_count(2)
    expect(errors).to_contain_text("value_2")
    axe(page)
    fits(page)
    screenshot(page, f"bench-form-{mode}")
    area.fill("gene_0,value_1,value_2\n0.2,0.4,0.5\n0.7,0.4,0.5\n")
    page.get_by_role("button", name="Check and use the table").click()
    expect(page.get_by_text("2 samples of 2 values each.")).to_be_visible()
    page.get_by_text("rollouts at most").wait_for()

    page.get_by_role("button", name="Submit the study").click()
    page.locator(".state-now").wait_for()
    study = page.url.rsplit("/", 1)[1]
    (spec,) = [each["spec"] for each in api.get(f"/studies/{study}")["experiments"]]  # one strategy: each needs runs
    assert (spec["reality"]["bench"], spec["reality"]["repeats"]) == ("leg 1", 3)
    assert [each["genome"] for each in spec["reality"]["samples"]] == [[0.2], [0.7]]
