"""Files that appear under their name when complete."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex

PRIVATE = 0o600
"""Permissions of what holds results: the owner's alone."""


def private(path: str, flags: int) -> int:
    """Open a file as `open(…, opener=private)` does; if it is new, only its owner may read it."""
    return os.open(path, flags, PRIVATE)


def hand_over(descriptor: int, like: Path) -> None:
    """As root, give an open file to the owner of another one, or of its folder if that is absent; else do nothing.

    What root creates for a service must be open to the user that runs the service.

    Raises:
        OSError: root may not do it here.
    """
    if sys.platform == "win32" or os.geteuid() != 0:
        return
    owner, now = (like if like.exists() else like.parent).stat(), os.fstat(descriptor)
    if (owner.st_uid, owner.st_gid) != (now.st_uid, now.st_gid):
        os.fchown(descriptor, owner.st_uid, owner.st_gid)


@contextmanager
def appearing(file: Path) -> Iterator[Path]:
    """Yield a part file to write into. When the context ends without an error, it is synced and renamed to `file`.

    Only its owner may read it. A killed process leaves its part file; the name is random, so a later attempt is not
    blocked.

    Raises:
        OSError: the file exists already, or cannot be written.
    """
    if file.exists():
        raise _taken(file)
    with _written(file, _name) as part:
        yield part


@contextmanager
def replacing(file: Path) -> Iterator[Path]:
    """Yield a part file as `appearing` does; it takes the name, from another file too.

    If root writes it, it belongs to the owner of the replaced file, or else of the folder.

    Raises:
        OSError: it cannot be written.
    """
    with _written(file, Path.replace, like=file) as part:
        yield part


@contextmanager
def _written(file: Path, put: Callable[[Path, Path], object], *, like: Path | None = None) -> Iterator[Path]:
    part = file.with_name(f"{file.name}.{token_hex(4)}.part")
    descriptor = os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, PRIVATE)
    try:
        try:
            if like:
                hand_over(descriptor, like)
        finally:
            os.close(descriptor)
        yield part
        _sync(part)
        put(part, file)
    finally:
        part.unlink(missing_ok=True)
    _sync(file.parent)


def _name(part: Path, file: Path) -> None:
    """Rename the part file, unless another file has taken the name meanwhile."""
    try:
        os.link(part, file)
    except FileExistsError as error:
        raise _taken(file) from error
    except OSError:  # no file has two names there
        part.rename(file)


def _taken(file: Path) -> FileExistsError:
    return FileExistsError(None, "a file of this name is there already", str(file))


def _sync(place: Path) -> None:
    """Wait until the file or folder is on the disk, as far as its file system can tell."""
    descriptor = os.open(place, os.O_RDONLY)
    with suppress(OSError):
        os.fsync(descriptor)
    os.close(descriptor)
