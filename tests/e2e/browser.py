"""A real Chromium that looks at the page, found on this machine and strict about errors; and axe."""

import os
import re
import shutil
from pathlib import Path
from typing import Any

import axe_playwright_python
from playwright.sync_api import expect, sync_playwright

VARIABLE = "GAPLAB_CHROMIUM"
"""Of the environment: the browser to use, for one that is not on the path."""

SCREENSHOTS = "GAPLAB_SCREENSHOTS"
"""Of the environment: the folder that screenshots are kept in; without it they are not taken."""

LONGEST_MS = 600_000
"""How long a test waits for the page: a machine may be busy, and no test fails because it is slow."""

expect.set_options(timeout=LONGEST_MS)

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--disable-gpu-rasterization",
]

AXE = Path(axe_playwright_python.__file__).with_name("axe.min.js")
SERIOUS = {"serious", "critical"}
CONTRAST = "color-contrast"
"""The rule of axe that depends on the theme."""

BUSY = (r"^429 ", r"^console: .* status of 429 ")
"""Troubles of a slow machine: the page then asks again."""


def chromium() -> Any:
    """The path of the machine's Chromium; None: Playwright's own, which `make test` installs where there is none."""
    return os.environ.get(VARIABLE) or next(filter(None, map(shutil.which, NAMES)), None)


class Chromium:
    """One browser, whose tabs share what it has loaded; what goes wrong in them is kept until `end`."""

    def __init__(self) -> None:
        self._playwright = sync_playwright().start()
        try:
            self._browser = self._playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
        except BaseException:
            self._playwright.stop()
            raise
        self._window = self._browser.new_context()
        self._window.grant_permissions(["clipboard-read", "clipboard-write"])
        self._window.set_default_timeout(LONGEST_MS)
        self._blank = self._window.new_page()
        self._storage = self._window.new_cdp_session(self._blank)
        self._troubles: list[str] = []
        self._forgiven: list[str] = [*BUSY]

    def visit(self, url: Any, *, dark: Any = False, width: Any = 1280, height: Any = 900) -> Any:
        """A tab at the address, in light or dark, as wide as a screen or a phone."""
        page: Any = self._window.new_page()
        page.emulate_media(color_scheme="dark" if dark else "light", reduced_motion="reduce")
        page.set_viewport_size({"width": width, "height": height})
        page.on("console", lambda said: said.type == "error" and self._note(f"console: {said.text}"))  # type: ignore[func-returns-value]
        page.on("pageerror", lambda error: self._note(f"error: {error}"))
        page.on("requestfailed", self._failed)
        page.on("response", lambda answer: answer.status >= 400 and self._note(f"{answer.status} {answer.url}"))  # type: ignore[func-returns-value]
        page.goto(url)
        return page

    def forgive(self, *patterns: Any) -> None:
        """What a test causes on purpose: troubles that match one of these do not fail it."""
        self._forgiven += patterns

    def end(self) -> None:
        """Close what the test opened, and forget what the pages kept; fail the test if anything went wrong there."""
        opened = [page for page in self._window.pages if page is not self._blank]
        origins = {"/".join(page.url.split("/")[:3]) for page in opened}
        for page in opened:
            page.close()
        for origin in origins:
            self._storage.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": "local_storage"})
        self._window.unroute_all(behavior="ignoreErrors")
        self._window.set_offline(False)
        troubles = [each for each in self._troubles if not any(re.search(one, each) for one in self._forgiven)]
        self._troubles, self._forgiven = [], [*BUSY]
        assert not troubles, "\n".join(troubles)

    def close(self) -> None:
        self._browser.close()
        self._playwright.stop()

    def _failed(self, request: Any) -> None:
        if request.failure != "net::ERR_ABORTED":  # a view that is left stops what it asked for
            self._note(f"{request.failure} {request.url}")

    def _note(self, trouble: Any) -> None:
        self._troubles.append(trouble)


def axe(page: Any, *rules: Any) -> None:
    """Assert that axe, or these rules of it, find nothing serious or critical in what the page shows."""
    if not page.evaluate("() => 'axe' in globalThis"):
        page.evaluate(AXE.read_text(encoding="utf-8"))
    only = {"runOnly": list(rules)} if rules else {}
    found = page.evaluate("(how) => axe.run(document, how)", {"resultTypes": ["violations"], **only})
    serious = [
        f"{each['id']}: {node['html']} ({node.get('failureSummary', '')})"
        for each in found["violations"]
        if each["impact"] in SERIOUS
        for node in each["nodes"]
    ]
    assert not serious, "\n".join(serious)


def screenshot(page: Any, name: Any) -> None:
    """Keep what the page looks like, if a folder for that is named."""
    if folder := os.environ.get(SCREENSHOTS):
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=Path(folder) / f"{name}.png", full_page=True)


def fits(page: Any) -> None:
    """Assert that nothing is wider than the window, once figures have followed it: no phone scrolls sideways."""
    for _ in range(100):
        wide = page.evaluate("() => document.documentElement.scrollWidth - document.documentElement.clientWidth")
        if wide <= 0:
            return
        page.wait_for_timeout(100)
    beyond = page.evaluate("""() => [...document.querySelectorAll("body *")]
        .filter((each) => each.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
        .filter((each) => !each.closest(".framed"))
        .slice(0, 8).map((each) => `${each.tagName}.${each.getAttribute("class") ?? ""}`)""")
    msg = f"{wide} px wider than the window: {', '.join(beyond)}"
    raise AssertionError(msg)
