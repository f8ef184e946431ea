"""A robot with every shape, a slide and a slope in a real browser: its replay, as a video too, and its picture."""

from base64 import b64encode
from io import BytesIO
from typing import Any
from urllib.request import urlopen

import numpy as np
import pytest
from PIL import Image

from gaplab.services.world import robot_library
from gaplab.services.world.robots.robot_file import Imported
from tests.e2e.browser import axe, fits, screenshot
from tests.e2e.test_page_replay import FLAT, eventually, time_of

FRAMES = """async (video) => {
  const [shown, canvas] = [document.createElement("video"), document.createElement("canvas")];
  const pen = canvas.getContext("2d", { willReadFrequently: true });
  const seen = () => { pen.drawImage(shown, 0, 0); return canvas.toDataURL(); };
  shown.muted = true;
  shown.src = URL.createObjectURL(await (await fetch(video)).blob());
  await new Promise((resume, fail) => Object.assign(shown, { onloadeddata: resume, onerror: fail }));
  Object.assign(canvas, { width: shown.videoWidth, height: shown.videoHeight });
  const ended = new Promise((resume) => { shown.onended = resume; });
  await new Promise((resume) => { shown.requestVideoFrameCallback(resume); shown.play(); });
  const first = seen();
  await ended;
  return [first, seen()];
}"""
"""Returns the first and the last frame of a video as pictures."""


def seen(page: Any, place: Any = ".stage-canvas") -> Any:
    """The first world as pixels."""
    return pixels(page.locator(place).first.screenshot())


def pixels(png: bytes) -> Any:
    return np.asarray(Image.open(BytesIO(png)).convert("RGB"), dtype=int)


def share(picture: Any, colour: tuple[int, int, int]) -> float:
    """The share of pixels with the hue of a colour, in light or in shade."""
    lit = picture.sum(axis=-1) / sum(colour)
    near = np.abs(picture - lit[..., None] * np.array(colour)).max(axis=-1) < 25
    return float((near & (lit > 0.2) & (lit < 1.2)).mean())


def replay(visit: Any, api: Any, known: Any, **how: Any) -> Any:
    page = visit(f"{api.url}/#/replay?experiment={known.strider}&repetition=0&iteration=0", **how)
    page.wait_for_selector(".stage-canvas[data-time]")
    return page


@pytest.mark.release
def test_every_part_is_drawn_in_the_colour_of_its_role_in_the_middle_of_the_picture(
    visit: Any, api: Any, known: Any
) -> None:
    page = replay(visit, api, known)
    page.get_by_label("Time", exact=True).fill("0.8")
    picture = seen(page)

    assert [each.get_attribute("data-drawn") for each in page.locator(".stage-canvas").all()] == ["webgl", "webgl"]
    assert share(picture, (123, 135, 148)) > 0.03  # torso and legs
    assert share(picture, (0, 114, 178)) > 0.005  # the observed head
    assert share(picture, (213, 94, 0)) > 0.003  # feet on the ground
    rows, columns = np.nonzero(np.abs(np.diff(picture[..., :3], axis=-1)).max(axis=-1) > 40)  # head and feet
    height, width = picture.shape[:2]
    assert rows.min() > 0.05 * height
    assert rows.max() < 0.97 * height
    assert rows.max() - rows.min() > 0.35 * height
    assert abs(columns.mean() / width - 0.5) < 0.2


def test_a_replay_is_played_seen_from_elsewhere_and_changed(visit: Any, api: Any, known: Any) -> None:
    page = replay(visit, api, known)
    canvas, main = page.locator(".stage-canvas").first, page.locator("main")
    assert [each.split(" 0.")[0] for each in page.locator(".world h2").all_inner_texts()] == [
        "In the simulator of iteration 0",
        "In reality",
    ]
    first = seen(page)
    canvas.press("ArrowLeft")
    assert time_of(page) == 0  # the arrows are the camera's
    assert (first != seen(page)).any()

    main.press("Shift+ArrowRight")
    eventually(page, lambda: time_of(page) == 0.2)
    main.press("ArrowLeft")
    eventually(page, lambda: time_of(page) == 0.18)
    page.get_by_label("Speed", exact=True).select_option("2")
    main.press("Space")
    eventually(page, lambda: time_of(page) > 0.3)
    page.get_by_role("button", name="Pause").click()
    assert page.get_by_role("button", name="Play", exact=True).is_visible()

    page.get_by_label("Iteration", exact=True).select_option("1")
    page.wait_for_selector("text=In the simulator of iteration 1")
    page.get_by_label("Controller", exact=True).select_option("sample")
    page.get_by_label("Simulator", exact=True).select_option("0")
    page.wait_for_selector("text=In the simulator of iteration 0")
    assert page.url.endswith("repetition=0&iteration=1&kind=sample&simulator=0")


def test_a_replay_is_saved_as_a_video_of_both_worlds(visit: Any, api: Any, known: Any) -> None:
    page = replay(visit, api, known)
    width = page.locator(".stage-canvas").first.evaluate("({ width }) => width")
    page.get_by_label("Speed", exact=True).select_option("2")

    with page.expect_download() as download:
        page.get_by_role("button", name="Record a video").click()
    name, content = download.value.suggested_filename, download.value.path().read_bytes()

    assert name in {f"gaplab-{known.strider}-0-0.{ending}" for ending in ("webm", "mp4")}
    assert page.get_by_role("button", name="Record a video").is_enabled()
    video = f"data:video/{name.rpartition('.')[2]};base64,{b64encode(content).decode()}"
    blank = page.context.new_page()
    first, last = blank.evaluate(FRAMES, video)
    blank.close()
    frames = [np.asarray(Image.open(urlopen(each)).convert("RGB"), dtype=int) for each in (first, last)]
    assert abs(frames[0].shape[1] - 2 * width) <= 4
    for half in (slice(None, width), slice(width, None)):
        assert all(share(frame[:, half], (123, 135, 148)) > 0.02 for frame in frames)  # torso and legs
        assert (np.abs(frames[0] - frames[1])[:, half].max(axis=-1) > 40).mean() > 0.005


@pytest.mark.release
def test_without_webgl_the_ground_rises_in_the_picture_too(visit: Any, api: Any, known: Any) -> None:
    page = visit(f"{api.url}/#/toy")
    page.add_init_script(FLAT)
    page.goto(f"{api.url}/#/replay?experiment={known.strider}&iteration=0")
    page.reload()
    page.wait_for_selector(".stage-canvas[data-drawn=flat]")
    page.get_by_label("Time", exact=True).fill("0.8")
    picture = seen(page)

    floor = np.abs(picture - np.array([238, 241, 244])).max(axis=-1) < 4
    begins = [int(np.flatnonzero(floor[:, column])[0]) for column in (20, picture.shape[1] - 20)]

    rise = (begins[0] - begins[1]) / (picture.shape[1] - 40)
    assert rise == pytest.approx(np.tan(0.12 * np.sin(1.0)), rel=0.1)  # seen from 1 rad off the direction of x


@pytest.mark.release
def test_the_form_shows_the_chosen_robot_and_tunes_what_is_usual_for_it_until_the_reader_chooses(
    visit: Any, api: Any
) -> None:
    example = robot_library.robot_file(Imported.example().options.sha256)
    assert example is not None
    api.http.post("/robots", json=example.content | {"name": "walker"}).raise_for_status()
    page = visit(f"{api.url}/#/new")
    chosen, picture = page.get_by_label("Robot", exact=True), page.locator(".robot-picture")
    ticked = ".tunable:has(input:checked)"

    chosen.select_option("walker")
    page.wait_for_selector(f"{ticked}:has-text('Mass of bodies')")
    assert page.locator(ticked).count() == 4

    chosen.select_option("strider")
    page.wait_for_selector(f"{ticked}:has-text('Restitution')")
    page.wait_for_selector(".robot-picture[alt='The robot Strider'][src]")
    assert picture.evaluate("(image) => image.decode().then(() => image.naturalWidth)") == 640
    assert share(seen(page, ".robot-picture"), (123, 135, 148)) > 0.03  # torso and legs
    assert share(seen(page, ".robot-picture"), (0, 114, 178)) > 0.003  # the head
    light = picture.get_attribute("src")
    page.emulate_media(color_scheme="dark")
    page.wait_for_function("(before) => document.querySelector('.robot-picture').src !== before", arg=light)
    page.locator(".tunable").filter(has_text="Restitution").get_by_role("checkbox").uncheck()
    chosen.select_option("walker")
    page.wait_for_selector(".robot-picture[alt='The robot Walker'][src]")
    assert page.locator(ticked).count() == 2
    chosen.select_option("toy_function")
    page.wait_for_selector(".robot-picture", state="detached")


@pytest.mark.release
def test_it_can_be_seen_by_all(visit: Any, api: Any, known: Any) -> None:
    for dark in (False, True):
        for width in (1280, 390):
            page = replay(visit, api, known, dark=dark, width=width)
            page.wait_for_selector(".gait .main-svg")
            axe(page)
            fits(page)
            screenshot(page, f"any-robot-{'dark' if dark else 'light'}-{width}")
            page = visit(f"{api.url}/#/new", dark=dark, width=width)
            page.get_by_label("Robot", exact=True).select_option("strider")
            page.wait_for_selector(".robot-picture[src]")
            axe(page)
            fits(page)
