"""Archives of studies and experiments, sent and received in parts of bounded size."""

from functools import partial
from typing import IO

from gaplab.api.clients.connection import Connection
from gaplab.api.clients.records import Records, path_of
from gaplab.schemas.archives import ImportRead

_CHUNK = 2**16


class Archives:
    """Export and import of everything stored about a study or an experiment."""

    def __init__(self, connection: Connection, records: Records) -> None:
        self._connection = connection
        self._records = records

    def export(self, id: str, file: IO[bytes]) -> None:
        """Write a study or an experiment into an open file, as one archive."""
        with self._connection.stream("GET", f"{path_of(self._records.find(id))}/export") as answer:
            for chunk in answer.iter_bytes():
                file.write(chunk)

    def import_(self, file: IO[bytes]) -> ImportRead:
        """Store the content of an archive; the answer has its ids."""
        headers, content = {"Content-Type": "application/zip"}, iter(partial(file.read, _CHUNK), b"")
        return self._connection.change(ImportRead, "POST", "/import", content=content, headers=headers)
