"""A robot with every shape, a slide and a slope in a real browser: its replay, and its picture in the form."""

import shutil
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from gaplab.services.core import external_plugins, robot_library
from gaplab.services.core.robots.robot_file import Imported
from gaplab.services.plugins.folders import VARIABLE
from gaplab.services.store.session import Store
from tests.drawn_robot import FILES, strode
from tests.e2e.api_alone import Api
from tests.e2e.browser import axe, fits, screenshot
from tests.e2e.test_page_replay import FLAT


@pytest.fixture(scope="module")
def strider(sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The API with the plug-ins, and the id of an experiment of theirs."""
    folder = tmp_path_factory.mktemp("strider")
    home, file = folder / "plugins", folder / "strider.db"
    home.mkdir()
    for name, text in FILES.items():
        (home / f"{name}.py").write_text(text)
    before = external_plugins.folders()
    external_plugins.set_folders((*before, home))
    shutil.copy(sqlite_template, file)
    store = Store(f"sqlite:///{file}")
    experiment = strode(store)
    store.dispose()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(home))
        api = Api(f"sqlite:///{file}", folder / "strider.log")
    yield api.start(), experiment
    api.close()
    external_plugins.set_folders(before)


def seen(page: Any) -> Any:
    """The first world as pixels."""
    return np.asarray(Image.open(BytesIO(page.locator(".stage-canvas").first.screenshot())).convert("RGB"), dtype=int)


def share(picture: Any, colour: tuple[int, int, int]) -> float:
    """The share of pixels with the hue of a colour, in light or in shade."""
    lit = picture.sum(axis=-1) / sum(colour)
    near = np.abs(picture - lit[..., None] * np.array(colour)).max(axis=-1) < 25
    return float((near & (lit > 0.2) & (lit < 1.2)).mean())


def replay(visit: Any, strider: Any, **how: Any) -> Any:
    api, experiment = strider
    page = visit(f"{api.url}/#/replay?experiment={experiment}&iteration=0", **how)
    page.wait_for_selector(".stage-canvas[data-time]", timeout=120_000)
    page.get_by_label("Time", exact=True).fill("0.8")
    return page


def test_every_part_is_drawn_in_the_colour_of_its_role(visit: Any, strider: Any) -> None:
    picture = seen(replay(visit, strider))

    assert share(picture, (123, 135, 148)) > 0.03  # torso and legs
    assert share(picture, (0, 114, 178)) > 0.005  # the observed head
    assert share(picture, (213, 94, 0)) > 0.003  # feet on the ground


def test_it_is_in_the_middle_of_the_picture_and_fits_into_it(visit: Any, strider: Any) -> None:
    picture = seen(replay(visit, strider))
    rows, columns = np.nonzero(np.abs(np.diff(picture[..., :3], axis=-1)).max(axis=-1) > 40)  # head and feet

    height, width = picture.shape[:2]
    assert rows.min() > 0.05 * height
    assert rows.max() < 0.97 * height
    assert rows.max() - rows.min() > 0.35 * height
    assert abs(columns.mean() / width - 0.5) < 0.2


def test_the_ground_rises_in_the_picture(visit: Any, strider: Any) -> None:
    page = replay(visit, strider)
    page.add_init_script(FLAT)
    page.reload()
    page.wait_for_selector(".stage-canvas[data-drawn=flat]", timeout=120_000)
    picture = seen(page)

    floor = np.abs(picture - np.array([238, 241, 244])).max(axis=-1) < 4
    begins = [int(np.flatnonzero(floor[:, column])[0]) for column in (20, picture.shape[1] - 20)]

    rise = (begins[0] - begins[1]) / (picture.shape[1] - 40)
    assert rise == pytest.approx(np.tan(0.12 * np.sin(1.0)), rel=0.1)  # seen from 1 rad off the direction of x


def test_the_form_shows_the_chosen_robot(visit: Any, strider: Any) -> None:
    page = visit(f"{strider[0].url}/#/new")
    picture = page.locator(".robot-picture")
    page.get_by_label("Robot", exact=True).select_option("strider")
    page.wait_for_selector(".robot-picture[alt='The robot Strider'][src]")
    assert picture.evaluate("(image) => image.decode().then(() => image.naturalWidth)") == 640
    light = picture.get_attribute("src")

    page.emulate_media(color_scheme="dark")
    page.wait_for_function("(before) => document.querySelector('.robot-picture').src !== before", arg=light)
    page.get_by_label("Robot", exact=True).select_option("toy_function")
    page.wait_for_selector(".robot-picture", state="detached")


def test_the_form_tunes_what_is_usual_for_the_robot_until_the_reader_chooses(visit: Any, strider: Any) -> None:
    example = robot_library.robot_file(Imported.example().options.sha256)
    assert example is not None
    strider[0].http.post("/robots", json=example.content | {"name": "walker"}).raise_for_status()
    page = visit(f"{strider[0].url}/#/new")
    chosen = page.get_by_label("Robot", exact=True)
    ticked = ".tunable:has(input:checked)"

    chosen.select_option("walker")
    page.wait_for_selector(f"{ticked}:has-text('Mass of bodies')")
    assert page.locator(ticked).count() == 4

    chosen.select_option("strider")
    page.wait_for_selector(f"{ticked}:has-text('Restitution')")
    page.locator(".tunable").filter(has_text="Restitution").get_by_role("checkbox").uncheck()
    chosen.select_option("walker")
    page.wait_for_selector(".robot-picture[alt='The robot Walker'][src]")
    assert page.locator(ticked).count() == 2


def test_it_can_be_seen_by_all(visit: Any, strider: Any) -> None:
    for dark in (False, True):
        for width in (1280, 390):
            page = replay(visit, strider, dark=dark, width=width)
            page.wait_for_selector(".gait .main-svg")
            axe(page)
            fits(page)
            screenshot(page, f"any-robot-{'dark' if dark else 'light'}-{width}")
            page = visit(f"{strider[0].url}/#/new", dark=dark, width=width)
            page.get_by_label("Robot", exact=True).select_option("strider")
            page.wait_for_selector(".robot-picture[src]")
            axe(page)
            fits(page)
