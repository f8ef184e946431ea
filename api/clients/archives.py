"""Archives, as the client sends and receives them: piece by piece, whatever their size."""

from collections.abc import Iterator
from typing import IO, TYPE_CHECKING

from gaplab.schemas.archives import ImportRead
from gaplab.schemas.records import StudyRead

if TYPE_CHECKING:
    from gaplab.api.clients.client import Client

_CHUNK = 2**16


class Archives:
    """A part of the client; its methods raise what the client's do."""

    def export(self: "Client", id: str, file: IO[bytes]) -> None:
        """Write everything of a study or an experiment into the file, as one archive."""
        found = self.find(id)
        noun = "studies" if isinstance(found, StudyRead) else "experiments"
        with self._reached(), self._http.stream("GET", f"/{noun}/{found.id}/export") as answer:
            for chunk in self._successful(answer).iter_bytes():
                file.write(chunk)

    def import_(self: "Client", file: IO[bytes]) -> ImportRead:
        """Store what is in an archive; the answer has its ids."""
        with self._reached():
            answer = self._http.post("/import", content=_chunks(file), headers={"Content-Type": "application/zip"})
        return self._read(ImportRead, self._successful(answer))


def _chunks(file: IO[bytes]) -> Iterator[bytes]:
    while chunk := file.read(_CHUNK):
        yield chunk
