"""Replays and the toy in a real browser: two worlds on one timeline, and Fig. 3 stepped through.

For a release, but for the toy: `test_page_any_robot` has a replay of a robot with every shape.
"""

from io import BytesIO
from itertools import islice
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gaplab.schemas.spec import ExperimentSpec
from gaplab.services.running import execution
from gaplab.services.store.session import Store
from tests.e2e.browser import axe, fits, screenshot
from tests.experiments import some_log, submit_one
from tests.waiting import wait_until

FLAT = "HTMLCanvasElement.prototype.getContext = ((get) => function (kind, ...options) \
{ return kind === 'webgl2' ? null : get.call(this, kind, ...options); })(HTMLCanvasElement.prototype.getContext)"

LATE = "() => { const react = Plotly.react; const late = () => new Promise((resume) => setTimeout(resume, 500)); \
Plotly.react = (...given) => late().then(() => react(...given)); }"


@pytest.fixture(scope="module")
def walker(archive: Any) -> Any:
    """The id of an experiment with robots that walk."""
    return of_the_study(archive, "simulated_fit_and_unique")


@pytest.fixture(scope="module")
def function(archive: Any) -> Any:
    """The id of an experiment on the toy function."""
    (study,) = archive.get("/studies", q="robot = toy_function and experiment_state = COMPLETED", limit=1)["items"]
    return study["experiments"][0]["id"]


def of_the_study(archive: Any, strategy: Any) -> Any:
    """The experiment of the walking robot, whatever other tests have stored beside it."""
    (study,) = archive.get("/studies", q=f"robot = quadruped and strategy = {strategy}")["items"]
    return next(each["id"] for each in study["experiments"] if each["strategy"] == strategy)


def replay(
    visit: Any, archive: Any, walker: Any, query: Any = "repetition=0&iteration=1&kind=sample", **how: Any
) -> Any:
    page = visit(f"{archive.url}/#/replay?experiment={walker}&{query}", **how)
    page.wait_for_selector(".stage-canvas[data-time]")
    return page


def time_of(page: Any) -> Any:
    return float(page.locator(".stage-canvas").first.get_attribute("data-time"))


def eventually(page: Any, holds: Any) -> None:
    """Wait until it does; the page's policy forbids to wait for an expression of its own."""
    wait_until(holds, meanwhile=lambda: page.wait_for_timeout(50))


def picture(canvas: Any) -> Any:
    return np.asarray(Image.open(BytesIO(canvas.screenshot())).convert("RGB"), dtype=int)


@pytest.mark.release
def test_a_controller_walks_in_both_worlds_on_one_timeline(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)
    canvases = page.locator(".stage-canvas")
    assert [each.get_attribute("data-drawn") for each in canvases.all()] == ["webgl", "webgl"]
    assert [each.split(" 0.")[0] for each in page.locator(".world h2").all_inner_texts()] == [
        "In the simulator of iteration 0",
        "In reality",
    ]
    assert page.get_by_role("button", name="Play", exact=True).is_visible()  # less motion is asked for
    before = [picture(each) for each in canvases.all()]

    page.locator("main").press("Shift+ArrowRight")
    eventually(page, lambda: time_of(page) == 0.2)
    page.locator("main").press("ArrowLeft")
    eventually(page, lambda: time_of(page) == 0.18)
    page.get_by_label("Time", exact=True).fill("1.5")

    assert time_of(page) == 1.5
    for canvas, first in zip(canvases.all(), before, strict=True):
        now = picture(canvas)
        assert len(np.unique(now.reshape(-1, 3), axis=0)) > 100  # shaded bodies, not a flat ground
        assert (np.abs(now - first).sum(axis=-1) > 60).mean() > 0.005


@pytest.mark.release
def test_it_plays_at_the_speed_that_is_chosen_and_stands_when_told(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)

    page.get_by_label("Speed", exact=True).select_option("2")
    page.locator("main").press("Space")
    eventually(page, lambda: time_of(page) > 0.3)
    page.get_by_role("button", name="Pause").click()

    stood = time_of(page)
    page.wait_for_timeout(300)
    assert time_of(page) == stood
    assert page.get_by_role("button", name="Play", exact=True).is_visible()

    page.emulate_media(reduced_motion="no-preference")
    page.reload()
    page.wait_for_selector(".stage-canvas[data-time]")
    eventually(page, lambda: time_of(page) > 0.1)


@pytest.mark.release
def test_the_camera_goes_round_by_keys_and_by_dragging(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)
    canvas = page.locator(".stage-canvas").first
    first = picture(canvas)

    for _ in range(4):
        canvas.press("ArrowLeft")
    turned = picture(canvas)
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 300, box["y"] + 100, steps=4)
    page.mouse.up()
    dragged = picture(canvas)

    assert (first != turned).any()
    assert (turned != dragged).any()
    assert time_of(page) == 0  # the arrows are the camera's


@pytest.mark.release
def test_the_cursor_of_the_gait_follows_the_time_and_a_click_moves_it(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)
    page.wait_for_selector(".gait .main-svg")
    page.get_by_label("Time", exact=True).fill("1")
    page.locator(".gait .cursor").wait_for(state="visible")
    page.locator(".gait figcaption").scroll_into_view_if_needed()
    at = page.locator(".gait .cursor").bounding_box()["x"]
    page.get_by_label("Time", exact=True).fill("2")
    page.locator(".gait figcaption").scroll_into_view_if_needed()
    then = page.locator(".gait .cursor").bounding_box()

    page.mouse.click(at + 1, then["y"] + then["height"] / 2)

    assert then["x"] > at + 20
    eventually(page, lambda: abs(time_of(page) - 1) < 0.03)


@pytest.mark.release
def test_the_cursor_follows_a_gait_that_is_painted_late_at_another_width(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)
    page.wait_for_selector(".gait .main-svg")
    page.get_by_label("Time", exact=True).fill("1.5")
    page.locator(".gait .cursor").wait_for(state="visible")
    page.evaluate(LATE)

    page.set_viewport_size({"width": 400, "height": 900})

    def on_the_time() -> Any:
        cursor, plotted = page.locator(".gait .cursor").bounding_box(), page.locator(".gait .bglayer").bounding_box()
        return plotted["width"] < 400 and abs(cursor["x"] - plotted["x"] - plotted["width"] / 2) < 20

    eventually(page, on_the_time)


@pytest.mark.release
def test_another_controller_or_simulator_is_chosen_and_is_in_the_address(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)

    page.get_by_label("Controller", exact=True).select_option("transfer")
    page.wait_for_selector("text=In the simulator of iteration 1")
    page.get_by_label("Iteration", exact=True).select_option("3")
    page.wait_for_selector("text=In the simulator of iteration 3")
    page.get_by_label("Simulator", exact=True).select_option("0")
    page.wait_for_selector("text=In the simulator of iteration 0")
    page.wait_for_selector(".stage-canvas[data-time]")

    assert page.url.endswith("repetition=0&iteration=3&kind=transfer&simulator=0")
    page.reload()
    page.wait_for_selector("text=In the simulator of iteration 0")
    assert page.get_by_label("Iteration", exact=True).input_value() == "3"


@pytest.mark.release
def test_what_is_not_there_says_so_and_another_may_be_chosen(visit: Any, archive: Any, walker: Any) -> None:
    visit.forgive("404")
    page = visit(f"{archive.url}/#/replay?experiment={walker}&repetition=99&iteration=1")

    page.wait_for_selector("text=no repetition 99; permitted: from 0 to 39")
    page.get_by_label("Repetition", exact=True).fill("3")
    page.get_by_label("Repetition", exact=True).press("Enter")

    page.wait_for_selector(".stage-canvas[data-time]")


@pytest.mark.release
def test_what_is_not_yet_there_may_be_looked_for_again(visit: Any, api: Any, written: Store) -> None:
    visit.forgive("409")
    spec = {"strategy": "random", "robot": "quadruped", "repetitions": 1, "budget": "smoke"}
    begun = submit_one(written, ExperimentSpec.model_validate(spec)).id
    (claim,) = execution.claim(written, "tests", 1)
    for step in islice(some_log(), 2):
        assert execution.record(written, claim, step)

    page = visit(f"{api.url}/#/replay?experiment={begun}&repetition=0&iteration=0")

    page.wait_for_selector("text=The transferred controller of iteration 0 of repetition 0 has not been measured")
    assert page.get_by_role("button", name="Try again").is_visible()


@pytest.mark.release
def test_the_page_of_an_experiment_leads_to_its_replays(visit: Any, archive: Any, walker: Any) -> None:
    page = visit(f"{archive.url}/#/experiments/{walker}")

    page.get_by_role("link", name="Replay a controller").click()

    page.wait_for_selector(".stage-canvas[data-time]")
    assert page.get_by_label("Iteration", exact=True).input_value() == "10"  # the last


@pytest.mark.release
def test_the_direct_baseline_is_seen_in_reality_alone(visit: Any, archive: Any) -> None:
    direct = of_the_study(archive, "direct")

    page = replay(visit, archive, direct, query="")

    assert page.locator(".stage-canvas").count() == 1
    assert page.get_by_text("This controller evolved in reality itself.").is_visible()


@pytest.mark.release
def test_without_webgl_it_is_seen_from_the_side(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)
    page.add_init_script(FLAT)
    page.reload()
    page.wait_for_selector(".stage-canvas[data-drawn=flat]")

    assert len(np.unique(picture(page.locator(".stage-canvas").first).reshape(-1, 3), axis=0)) > 5


@pytest.mark.release
def test_the_toy_is_stepped_through(visit: Any, api: Any, known: Any) -> None:
    page = visit(f"{api.url}/#/toy?experiment={known.ids[0]}")
    page.wait_for_selector(".toy .main-svg")
    page.wait_for_selector("text=Iteration 0: after 0 samples")

    page.get_by_label("Iteration", exact=True).fill("2")
    page.wait_for_selector("text=Iteration 2: after 2 samples")
    page.locator("main").press("ArrowRight")
    page.wait_for_selector("text=Iteration 3: after 3 samples")
    assert page.url.endswith("repetition=0&iteration=3")

    page.get_by_role("button", name="Play").click()
    page.wait_for_selector("text=Iteration 5: after 5 samples")
    page.get_by_role("button", name="Pause").click()
    page.get_by_label("Repetition", exact=True).fill("1")
    page.get_by_label("Repetition", exact=True).press("Enter")
    eventually(page, lambda: "repetition=1" in page.url)


def seen_by_all(page: Any, name: Any) -> None:
    """Light, dark and on a phone, one after the other."""
    axe(page)
    screenshot(page, f"{name}-light")
    page.emulate_media(color_scheme="dark")
    axe(page)
    screenshot(page, f"{name}-dark")
    page.emulate_media(color_scheme="light")
    page.set_viewport_size({"width": 400, "height": 900})
    page.wait_for_timeout(300)
    fits(page)
    screenshot(page, f"{name}-phone")


@pytest.mark.release
def test_a_replay_can_be_seen_by_all(visit: Any, archive: Any, walker: Any) -> None:
    page = replay(visit, archive, walker)
    page.get_by_label("Time", exact=True).fill("1.2")
    page.wait_for_selector(".gait .main-svg")

    seen_by_all(page, "replay")


@pytest.mark.release
def test_the_toy_can_be_seen_by_all(visit: Any, archive: Any, function: Any) -> None:
    page = visit(f"{archive.url}/#/toy?experiment={function}&iteration=4")
    page.wait_for_selector(".toy .main-svg")

    seen_by_all(page, "toy")
