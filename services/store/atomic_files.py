"""Files that have their name once they are whole, and take it from no other."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex


@contextmanager
def appearing(file: Path, mode: int = 0o666) -> Iterator[Path]:
    """A file beside it to write into, that gets its name when the context ends well, once it is on the disk.

    What somebody leaves there who is killed has a name that nobody else takes, so that it is in no one's way.

    Args:
        file: that must not be there yet.
        mode: who may read and write it, as far as the process lets anybody.

    Raises:
        OSError: the file is there already, or cannot be written.
    """
    if file.exists():
        raise _taken(file)
    part = file.with_name(f"{file.name}.{token_hex(4)}.part")
    os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
    try:
        yield part
        _sync(part)
        _name(part, file)
    finally:
        part.unlink(missing_ok=True)
    _sync(file.parent)


def _name(part: Path, file: Path) -> None:
    """Give it its name, but not in place of what has got that name meanwhile."""
    try:
        os.link(part, file)
    except FileExistsError as error:
        raise _taken(file) from error
    except OSError:  # no file has two names there
        part.rename(file)


def _taken(file: Path) -> FileExistsError:
    return FileExistsError(None, "a file of this name is there already", str(file))


def _sync(place: Path) -> None:
    """Wait until it is on the disk; not every kind of folder can be waited for."""
    descriptor = os.open(place, os.O_RDONLY)
    with suppress(OSError):
        os.fsync(descriptor)
    os.close(descriptor)
