"""Files of whole studies: reports and what is taken home, and archives, sent and received in parts of bounded size."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO

from gaplab.api.clients.connection import CONFIRMED, Connected, Of, segment
from gaplab.schemas.archives import ImportRead
from gaplab.schemas.reports import VerdictRead

_CHUNK = 2**16


class Files(Connected):
    """Documents on studies, and everything that is stored about them."""

    def verdict(self, of: Of, *, margin: float | None = None, margin_of_direct: float | None = None) -> VerdictRead:
        """Return the verdict on a study: what its curves and tests say, in words.

        Args:
            of: the study, or one experiment of it.
            margin: difference in the unit of fitness within which strategies are equivalent; left out: not tested.
            margin_of_direct: the same margin as a share of the direct baseline's mean fitness, like 0.03.
        """
        query = {"margin": margin, "margin_of_direct": margin_of_direct}
        return self._connection.get(VerdictRead, f"/studies/{segment(of)}/report", format="json", **query)

    def report(
        self, of: Of, file: str | Path, *, margin: float | None = None, margin_of_direct: float | None = None
    ) -> Path:
        """Write the report on a study into a file with the suffix .html, to read and to print.

        The margins are those of `verdict`. Missing folders are created.
        """
        query = {"margin": margin, "margin_of_direct": margin_of_direct}
        return self._connection.save(file, f"/studies/{segment(of)}/report", ("html",), **query)

    def take_home(self, of: Of, file: str | Path) -> Path:
        """Write what an experiment found into a file with the suffix .zip.

        It has the best measured controller with its motion, the tuned simulator with its intervals, the verdict,
        samples, spec, provenance and the report. Missing folders are created.
        """
        return self._connection.save(file, f"/experiments/{segment(of)}/takehome", ("zip",))

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
