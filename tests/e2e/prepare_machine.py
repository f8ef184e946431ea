"""Get what the tests need and no wheel has: `make test` runs this once, after the installation.

These are a Chromium for the page, and the libraries that SAPIEN and Playwright expect on a machine. What is there is
taken. For a browser, Playwright's own comes next, then the distribution's; for root on Debian and its kin, apt gets it.
"""

import ctypes
import os
import shutil
import subprocess
import sys

from playwright.sync_api import Error

from tests.e2e.browser import VARIABLE, Chromium

LIBRARIES = {"libX11.so.6": "libx11-6", "libatomic.so.1": "libatomic1"}
"""The libraries of SAPIEN and of Playwright, and their packages in Debian."""

DOWNLOAD_S = 600
"""Time that a download may take on a slow line."""

NO_CHROMIUM = f"""\
The tests of the page need a Chromium, and none could be downloaded: install one (on Debian: apt-get install chromium),
or set {VARIABLE} to the path of one, and run `make test` again."""


def main() -> str | None:
    """Get what is missing; return a sentence that says what to install, or None if all is there."""
    if lacking := missing_libraries():
        from_apt(*(LIBRARIES[name] for name in lacking))
    if lacking := missing_libraries():
        packages = " ".join(LIBRARIES[name] for name in lacking)
        return f"The tests need {' and '.join(lacking)}: install them (on Debian: apt-get install {packages})."
    if starts():
        return None
    if named := os.environ.get(VARIABLE):
        return f"{VARIABLE} names {named}, which does not start as a Chromium does"
    return None if browser_from_playwright() or browser_from_apt() else NO_CHROMIUM


def missing_libraries() -> list[str]:
    """Return the names of the libraries that this machine lacks."""
    lacking = []
    for name in LIBRARIES:
        try:
            ctypes.CDLL(name)
        except OSError:
            lacking.append(name)
    return lacking


def starts() -> bool:
    """Return whether there is a browser, with all the libraries that it needs."""
    try:
        Chromium().close()
    except Error:
        return False
    return True


def browser_from_playwright() -> bool:
    """Download Playwright's own browser, and, as root, its libraries; return whether it starts."""
    sys.stdout.write("There is no Chromium: downloading Playwright's\n")
    playwright = [sys.executable, "-m", "playwright"]
    if not succeeds(*playwright, "install", "chromium-headless-shell"):
        return False
    return starts() or (
        os.geteuid() == 0 and succeeds(*playwright, "install-deps", "chromium-headless-shell") and starts()
    )


def browser_from_apt() -> bool:
    """Install the distribution's browser; return whether it starts."""
    return from_apt("chromium") and starts()


def from_apt(*packages: str) -> bool:
    """Install packages of Debian, where one may; return whether that succeeded."""
    if os.geteuid() != 0 or not shutil.which("apt-get"):
        return False
    sys.stdout.write(f"Installing {' '.join(packages)} with apt-get\n")
    install = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
    return succeeds("apt-get", "update") and succeeds(*install)


def succeeds(*command: str) -> bool:
    """Run a command silently, and return whether it succeeded: if all fails, one sentence says enough."""
    path = os.pathsep.join([os.environ["PATH"], "/usr/sbin", "/sbin"])  # dpkg fails without them
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive", "PATH": path}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, timeout=DOWNLOAD_S, check=False)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


if __name__ == "__main__":
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    sys.exit(main())
