"""Archives in tests: exported to bytes, and imported without the subprocess that takes a second each time."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from gaplab.schemas.archives import ImportRead
from gaplab.services.archives import Archive, import_archive
from gaplab.services.archives.opening import json_lines_beside
from gaplab.services.archives.unpacking import convert
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.experiments.limits import FREELY, Admission
from gaplab.services.settings import Limits
from gaplab.services.store.session import Store


def exported(archive: Archive) -> bytes:
    with archive.file as file:
        return file.read()


def convert_here(files: Mapping[Path, int]) -> None:
    """Read Parquet as the subprocess does, without its limits."""
    for file, rows in files.items():
        if not convert(str(file), str(json_lines_beside(file)), rows):
            raise InvalidArchive(f"{file.name} is not readable")


def imported(store: Store, archive: bytes | bytearray, most_rows: int | None = None) -> ImportRead:
    """Import an archive; its Parquet is read in this process."""
    admitted = Admission(limits=Limits(imported_rows=most_rows)) if most_rows else FREELY
    return import_archive(store, BytesIO(archive), admitted, convert=convert_here)
