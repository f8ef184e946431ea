"""The folder of a Ray that this process starts: private, and removed with it."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import time

from gaplab.services.core.errors import ClusterUnusable

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

PREFIX = "gaplab-ray-"

LONGEST_PARENT = 22
"""Characters of the parent's path: the path of a socket has at most 107, and Ray and the folders' names take 85.

Source: man 7 unix.
"""

STARTING_S = 60.0
"""Age before which a folder without a holder may be one that is just being made."""


@contextmanager
def ray_folder(wanted: Path | None = None) -> Iterator[Path]:
    """Yield a place for Ray in a new folder that only this user can enter, and remove both when the context ends.

    It is in the `wanted` one; left out: in RAY_TMPDIR, or the folder for temporary files. Ray lets all users of the
    machine write into the place itself, and so connect to its sockets. Folders of processes that were killed are
    removed at the next start.

    Raises:
        ClusterUnusable: this user cannot make one there.
    """
    try:
        parent = wanted or Path(os.environ.get("RAY_TMPDIR") or tempfile.gettempdir()).absolute()
        if len(str(parent)) > LONGEST_PARENT:  # too long for the sockets
            parent = Path("/tmp")  # noqa: S108 - the folder in it is private
        _sweep(parent)
        folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))  # with mode 0700
    except OSError as error:
        short = f"of at most {LONGEST_PARENT} characters"
        msg = f"Ray needs a folder for its files; let RAY_TMPDIR name one {short} that you may write: {error}"
        raise ClusterUnusable(msg) from error
    held = _hold(folder)
    try:
        yield folder / "r"
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        if held is not None:
            os.close(held)


def _sweep(parent: Path) -> None:
    """Remove the folders of this user whose process has ended."""
    for folder in parent.glob(f"{PREFIX}*"):
        with suppress(OSError):
            found = folder.lstat()
            if found.st_uid != os.geteuid() or time() - found.st_mtime < STARTING_S:
                continue
            if (held := _hold(folder)) is not None:
                shutil.rmtree(folder, ignore_errors=True)
                os.close(held)


def _hold(folder: Path) -> int | None:
    """Lock the folder for as long as this process lives, and return the descriptor; None if another holds it."""
    if fcntl is None:
        return None
    descriptor = os.open(folder / "lock", os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor
