"""Archives of studies, sent and received in parts of bounded size."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO

from gaplab.api.clients.connection import CONFIRMED, Connection, Of, segment
from gaplab.schemas.archives import ImportRead

_CHUNK = 2**16


class Archives:
    """Export and import of everything stored about a study."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def export(self, of: Of, file: str | Path | IO[bytes]) -> None:
        """Write a study, or it with one of its experiments alone, into a new file or an open one, as one archive.

        Raises:
            OSError: the file exists already, or cannot be written.
        """
        if isinstance(file, str | Path):
            with _new(Path(file)) as target:
                self.export(of, target)
            return
        with self._connection.stream("GET", f"/studies/{segment(of)}/export") as answer:
            for chunk in answer.iter_bytes():
                file.write(chunk)

    def import_(self, file: str | Path | IO[bytes], *, yes: bool = False) -> ImportRead:
        """Store the content of an archive, a file or an open one, whatever its work costs if `yes`; return its ids."""
        if isinstance(file, str | Path):
            with Path(file).open("rb") as source:
                return self.import_(source, yes=yes)
        path, parts = f"/import{CONFIRMED if yes else ''}", iter(partial(file.read, _CHUNK), b"")
        return self._connection.upload(ImportRead, path, parts, "application/zip")


@contextmanager
def _new(path: Path) -> Iterator[IO[bytes]]:
    """Open a new file to write into, which its owner alone may read; remove it if that fails."""
    path.touch(0o600, exist_ok=False)
    with path.open("wb") as file:
        try:
            yield file
        except BaseException:
            path.unlink()
            raise
