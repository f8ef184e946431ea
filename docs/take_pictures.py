"""`python -m docs.take_pictures`, or `make pictures`: take the pictures of docs/pictures from the page as it is now.

A real service has the published studies and the toy; a real Chromium visits the views, and
reports any error on the page. Look at the pictures before you keep them.
"""

import json
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from PIL import Image, ImageDraw
from playwright.sync_api import Page

from gaplab import migrations
from gaplab.api.process.local_service import start_service
from gaplab.schemas.spec import ExperimentSpec, StudySpec
from gaplab.services.archives import import_archive
from gaplab.services.core.loop import repetition
from gaplab.services.experiments.stored_files import ROBOTS
from gaplab.services.experiments.submission import submit
from gaplab.services.figures.words import spoken
from gaplab.services.running.execution import claim, record_all
from gaplab.services.specs.assembly import setting
from gaplab.services.store.lease import Pulse
from gaplab.services.store.session import Store
from gaplab.workers.checkpoints import recorded
from tests import real_robots
from tests.e2e.browser import Chromium
from tests.experiments import run

ROOT = Path(__file__).parents[1]
FOLDER = Path(__file__).with_name("pictures")
STUDIES = ("quadruped-mujoco-paper", "figure-4-physx", "figure-4-mujoco")
"""The archives to import; the last one is shown."""

LONGEST_S = 600

TILE_PX = (426, 320)
"""Size of the picture of a robot from a file."""

DRAWN = """async (image) => {
  await image.decode();
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width: image.naturalWidth, height: image.naturalHeight });
  canvas.getContext("2d").drawImage(image, 0, 0);
  return canvas.toDataURL().split(",")[1];
}"""
"""Returns a picture of the page as PNG in Base64."""


class View(NamedTuple):
    """A view of the page.

    Attributes:
        name: name of the picture.
        address: its fragment, with the names of ids in braces.
        ready: what is visible once the view is complete.
        height: height of the picture in pixels.
        width: its width.
        fields: values to enter, by label.
        press: the button to press first, if any.
        dark: whether the picture is of the dark theme.
    """

    name: str
    address: str
    ready: str
    height: int = 900
    fields: tuple[tuple[str, str], ...] = ()
    press: str | None = None
    width: int = 1280
    dark: bool = False


JUDGED = "main:has(.conclusion p)"
"""The view of a study once its verdict is there."""

VIEWS = (
    View("list", "", ".list tbody tr >> nth=3", 560),
    View("new", "new", ".panel .big", press="Quadruped, quickly"),
    View("study", "studies/{study}", f"{JUDGED} .plot .scatterlayer .point >> nth=0", dark=True),
    View("experiment", "experiments/{experiment}", f"{JUDGED} .figure-predictions .scatterlayer .point >> nth=0", 1700),
    View("compare", "compare?experiments={all}", "table.matrix", 1130),
    View("replay", "replay?experiment={experiment}", ".gait .main-svg >> nth=0", fields=(("Time", "2"),), dark=True),
    View("bench", "bench?bench=table", ".gait, .motion, h2 >> nth=0", 844, width=390),
    View("toy", "toy?experiment={toy}&iteration=3", ".toy .main-svg >> nth=0"),
)


@contextmanager
def prepared() -> Iterator[tuple[str, dict[str, str]]]:
    """Serve the studies, and yield the address of the page and the ids in `VIEWS`."""
    with TemporaryDirectory(prefix="gaplab-pictures-") as folder:
        database_url = f"sqlite:///{Path(folder) / 'gaplab.db'}"
        migrations.upgrade(database_url)
        store = Store(database_url)
        for name in STUDIES:
            with (ROOT / "docs" / "studies" / f"{name}.zip").open("rb") as archive:
                shown = import_archive(store, archive)
        ids = {"study": shown.study, "experiment": shown.experiments[0], "all": ",".join(shown.experiments)}
        ids["toy"] = toy(store)
        ask_for_a_measurement(store)
        for name in real_robots.FILES:
            ROBOTS.add(store, real_robots.imported(name).robot.text)
        store.dispose()
        with start_service(database_url, Path(folder) / "api.log", workers=False) as client:
            yield client.url, ids


def toy(store: Store) -> str:
    """Compute the toy of the examples with two strategies, and return the first experiment."""
    spec = json.loads((ROOT / "examples" / "toy.json").read_text()) | {"strategies": ["simulated_fit", "random"]}
    study = submit(store, StudySpec.model_validate(spec))
    while claims := claim(store, "pictures", 1):
        for claimed in claims:
            run(store, claimed, repetition(setting(claimed.spec, claimed.number)))
    return study.experiments[0].id


def ask_for_a_measurement(store: Store) -> None:
    """Compute an experiment on a bench until it waits for its first measurement."""
    spec = {
        "name": "the robot on our table",
        "strategy": "simulated_fit_and_informative",
        "robot": "quadruped",
        "engine": "mujoco",
        "reality": {"kind": "physical", "bench": "table", "repeats": 3, "limits": {"torque": 7.0}},
        "iterations": 2,
        "repetitions": 1,
        "budget": "smoke",
    }
    submit(store, ExperimentSpec.model_validate(spec))
    for claimed in claim(store, "pictures", 1):
        for delivered in recorded(setting(claimed.spec, claimed.number), claimed.log, claimed.checkpoints):
            if not isinstance(delivered, Pulse):
                record_all(store, [(claimed, [delivered])])


def take(page: Page, view: View, path: Path) -> None:
    """Store the picture of a view, with 256 colours."""
    if view.press:
        page.get_by_role("button", name=view.press).click()
    page.locator(view.ready).wait_for(timeout=LONGEST_S * 1000)
    page.get_by_text("still being computed").wait_for(state="detached", timeout=LONGEST_S * 1000)
    for label, value in view.fields:
        page.get_by_label(label, exact=True).fill(value)
    page.wait_for_timeout(1000)  # figures are painted after they are loaded
    page.screenshot(path=path)
    with Image.open(path) as picture:
        picture.convert("RGB").quantize(256).save(path, optimize=True)


def take_robots(page: Page) -> None:
    """Store the pictures of robots, which the form for a new study draws."""
    drawn = {name: picture_of(page, name) for name in ("quadruped", *real_robots.FILES)}
    drawn.pop("quadruped").quantize(256).save(FOLDER / "quadruped-light.png", optimize=True)
    whole = Image.new("RGB", (3 * TILE_PX[0], -(-len(drawn) // 3) * TILE_PX[1]))
    for place, (name, picture) in enumerate(drawn.items()):
        tile = picture.resize(TILE_PX)
        ImageDraw.Draw(tile).text((12, 10), name, fill="black", font_size=20)
        whole.paste(tile, (place % 3 * TILE_PX[0], place // 3 * TILE_PX[1]))
    whole.quantize(256).save(FOLDER / "robots-light.png", optimize=True)


def picture_of(page: Page, robot: str) -> Image.Image:
    """Choose a robot in the form, and return its picture."""
    page.get_by_label("Robot", exact=True).select_option(robot)
    shown = page.locator(f".robot-picture[alt='The robot {spoken(robot)}'][src]")
    return Image.open(BytesIO(b64decode(shown.evaluate(DRAWN)))).convert("RGB")


def main() -> None:
    """Take every picture."""
    browser = Chromium()
    try:
        with prepared() as (url, ids):
            take_robots(browser.visit(f"{url}/#/new"))
            browser.end()
            for view in VIEWS:
                path = FOLDER / f"{view.name}-{'dark' if view.dark else 'light'}.png"
                address = f"{url}/#/{view.address.format(**ids)}"
                page = browser.visit(address, dark=view.dark, width=view.width, height=view.height)
                take(page, view, path)
                browser.end()
                print(f"Wrote {path}.")  # noqa: T201
    finally:
        browser.close()


if __name__ == "__main__":
    main()
