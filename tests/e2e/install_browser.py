"""Get a Chromium for the tests of the page: `make test` runs this once, after the installation.

A browser that is there is taken; else Playwright downloads its own; else, for root on Debian and its kin, apt does.
"""

import os
import shutil
import subprocess
import sys

from playwright.sync_api import Error

from tests.e2e.browser import VARIABLE, Chromium

DOWNLOAD_S = 600
"""Time that a download may take on a slow line."""

MISSING = f"""\
The tests of the page need a Chromium, and none could be downloaded: install one (on Debian: apt-get install chromium),
or set {VARIABLE} to the path of one, and run `make test` again."""


def starts() -> bool:
    """Return whether there is a browser, with all the libraries that it needs."""
    try:
        Chromium().close()
    except Error:
        return False
    return True


def from_playwright() -> None:
    """Download Playwright's own browser, and, as root, the libraries that it needs."""
    playwright = [sys.executable, "-m", "playwright"]
    if _succeeds(*playwright, "install", "chromium-headless-shell") and os.geteuid() == 0 and not starts():
        _succeeds(*playwright, "install-deps", "chromium-headless-shell")


def from_apt() -> None:
    """Install the distribution's browser, where apt is and where one may."""
    if os.geteuid() == 0 and shutil.which("apt-get"):
        _succeeds("apt-get", "update")
        _succeeds("apt-get", "install", "--yes", "--no-install-recommends", "chromium")


def main() -> str | None:
    """Try one source after the other; return the sentence that says what to do, or None if there is a browser."""
    if starts():
        return None
    if named := os.environ.get(VARIABLE):
        return f"{VARIABLE} names {named}, which does not start as a Chromium does"
    for name, source in (("Playwright", from_playwright), ("apt", from_apt)):
        sys.stdout.write(f"There is no Chromium on this machine; trying to get one from {name}\n")
        source()
        if starts():
            return None
    return MISSING


def _succeeds(*command: str) -> bool:
    """Run a command silently: if all sources fail, one sentence says enough."""
    path = os.pathsep.join([os.environ["PATH"], "/usr/sbin", "/sbin"])  # dpkg fails without them
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive", "PATH": path}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, timeout=DOWNLOAD_S, check=False)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


if __name__ == "__main__":
    sys.exit(main())
