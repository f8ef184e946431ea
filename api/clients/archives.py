"""Archives, as the client sends and receives them: piece by piece, whatever their size."""

from abc import abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager
from typing import IO, TypeVar

import httpx2

from schemas.archives import ImportRead
from schemas.records import ExperimentRead, StudyRead

T = TypeVar("T")

_CHUNK = 2**16


class Archives:
    """The part of a client that is about archives; the methods without a body are the client's own."""

    _http: httpx2.Client

    def export(self, id: str, file: IO[bytes]) -> None:  # noqa: A002 - as the API says
        """Write everything of a study or an experiment into the file, as one archive."""
        found = self.find(id)
        noun = "studies" if isinstance(found, StudyRead) else "experiments"
        with self._reached(), self._http.stream("GET", f"/{noun}/{found.id}/export") as answer:
            for chunk in self._successful(answer).iter_bytes():
                file.write(chunk)

    def import_(self, file: IO[bytes]) -> ImportRead:
        """Store what is in an archive; the answer has its ids."""
        with self._reached():
            answer = self._http.post("/import", content=_chunks(file), headers={"Content-Type": "application/zip"})
        return self._read(ImportRead, self._successful(answer))

    @abstractmethod
    def find(self, id: str) -> ExperimentRead | StudyRead:  # noqa: A002, D102 - as the API says
        ...

    @abstractmethod
    def _reached(self) -> AbstractContextManager[None]: ...

    @abstractmethod
    def _successful(self, answer: httpx2.Response) -> httpx2.Response: ...

    @abstractmethod
    def _read(self, kind: type[T], answer: httpx2.Response) -> T: ...


def _chunks(file: IO[bytes]) -> Iterator[bytes]:
    while chunk := file.read(_CHUNK):
        yield chunk
