"""Unpacking of archives, within limits, and comparison with their manifest.

Nothing in them is trusted: members with unknown names are refused, sizes are counted while unpacking, and a subprocess
reads Parquet.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from errno import EINVAL
from hashlib import sha256
from pathlib import Path
from subprocess import DEVNULL
from typing import IO, TypeAlias
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo
from zlib import error as ZlibError  # noqa: N812 - it is an error

from pydantic import ValidationError

from gaplab.schemas.archives import FORMAT, Manifest, Member
from gaplab.services.archives.checking import checked, first_error
from gaplab.services.archives.columns import EXPORTED, Row
from gaplab.services.archives.members import CURVES, MANIFEST, SPEC, digest_of, member_of
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.settings import variable_of
from gaplab.services.store.queries import attachments

MOST_BYTES = 512 * 2**20
"""Size of all members, unpacked, without files; a study of the paper's size has about ten million bytes."""

MOST_BYTES_OF_FILES = 2**30
"""Size of all files beside measurements, unpacked."""

MOST_FILES = 10_000
"""Files beside measurements."""

MOST_BYTES_OF_MANIFEST = 4_000_000
MOST_BYTES_OF_DIRECTORY = 4 * 2**20
_MEMBERS = {MANIFEST, CURVES, SPEC, *map(member_of, EXPORTED)}
_UNPACKING = Path(__file__).with_name("unpacking.py")
_CHUNK = 2**16

ParquetConverter: TypeAlias = Callable[[Mapping[Path, int]], None]
"""Writes the rows of each Parquet file, which has as many as stated, as JSON Lines into a file beside it."""


@dataclass(frozen=True)
class OpenedArchive:
    """An archive that was unpacked.

    Attributes:
        manifest: manifest of the archive.
        files: files of the tables' rows, as JSON Lines.
        attachments: files beside measurements, by their hashes.
    """

    manifest: Manifest
    files: Mapping[str, Path]
    attachments: Mapping[str, Path]

    def rows(self, table: str) -> Iterator[Row]:
        """Yield the rows of a table, checked.

        Raises:
            InvalidArchive: a row is invalid.
        """
        yield from checked(table, self.files[table], self.manifest.members[member_of(table)].rows)


def open_archive(file: IO[bytes], folder: Path, most_rows: int, convert: ParquetConverter) -> OpenedArchive:
    """Unpack an archive into an empty folder; its tables have at most `most_rows` together.

    Raises:
        InvalidArchive: the file is damaged, harmful, not an archive, or written by a later version.
    """
    (folder / "attachments").mkdir()
    with readable_zip(file) as archive:
        members = _members(archive)
        manifest = _manifest(archive, members)
        _refuse_too_many_rows(manifest, most_rows)
        files = {
            name: _unpack(archive, info, manifest.members[name], folder / name)
            for name, info in members.items()
            if name != MANIFEST
        }
    convert({file: manifest.members[name].rows for name, file in files.items() if name.endswith(".parquet")})
    tables = {table: json_lines_beside(files[member_of(table)]) for table in EXPORTED}
    return OpenedArchive(manifest, tables, {hash_: file for name, file in files.items() if (hash_ := digest_of(name))})


class _Bounded:
    """A file whose parts are read with a limit: `zipfile` reads the directory of a zip at once, and keeps it."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.seek, self.tell, self.seekable = file.seek, file.tell, file.seekable

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes.

        Raises:
            InvalidArchive: too many are asked for.
        """
        if size > MOST_BYTES_OF_DIRECTORY:
            raise InvalidArchive(f"its directory has {size:,} bytes; {MOST_BYTES_OF_DIRECTORY:,} are permitted")
        return self._file.read(size)


@contextmanager
def readable_zip(file: IO[bytes] | Path) -> Iterator[ZipFile]:
    """Yield a zip that is open for reading.

    Raises:
        InvalidArchive: it, or what is read of it meanwhile, is damaged, encrypted or no zip.
        OSError: the file cannot be read.
    """
    try:
        with ZipFile(file if isinstance(file, Path) else _Bounded(file)) as archive:
            yield archive
    except (BadZipFile, ZlibError, EOFError, NotImplementedError, RuntimeError, ValueError, OverflowError) as error:
        raise InvalidArchive(f"it is not a readable zip: {type(error).__name__}") from error
    except OSError as error:
        if error.errno != EINVAL:  # a place before the file's beginning
            raise
        raise InvalidArchive("it is not a readable zip: its directory points outside of it") from error


def _members(archive: ZipFile) -> dict[str, ZipInfo]:
    found: dict[str, ZipInfo] = {}
    for info in archive.infolist():
        if info.filename not in _MEMBERS and digest_of(info.filename) is None:
            raise InvalidArchive(
                f"unknown member {info.filename[:64]!r}; permitted: {', '.join(sorted(_MEMBERS))}, attachments/SHA-256"
            )
        if info.filename in found:
            raise InvalidArchive(f"it has {info.filename} twice")
        if info.compress_type not in {ZIP_STORED, ZIP_DEFLATED} or info.flag_bits & 1:
            raise InvalidArchive(f"{info.filename} is encrypted, or compressed by another method than deflate")
        found[info.filename] = info
    _refuse_too_large(found)
    return found


def _refuse_too_large(members: Mapping[str, ZipInfo]) -> None:
    sizes = {name: info.file_size for name, info in members.items()}
    files = {name: size for name, size in sizes.items() if digest_of(name)}
    if (size := sum(sizes.values()) - sum(files.values())) > MOST_BYTES:
        raise InvalidArchive(f"unpacked it has {size:,} bytes; {MOST_BYTES:,} are permitted")
    less = "export its experiments one by one"
    if len(files) > MOST_FILES:
        raise InvalidArchive(f"it has {len(files):,} attachments; {MOST_FILES:,} are permitted: {less}")
    if (size := sum(files.values())) > MOST_BYTES_OF_FILES:
        raise InvalidArchive(f"its attachments have {size:,} bytes; {MOST_BYTES_OF_FILES:,} are permitted: {less}")
    for name, size in files.items():
        if not 0 < size <= attachments.MOST_BYTES:
            raise InvalidArchive(f"{name} has {size:,} bytes; 1 to {attachments.MOST_BYTES:,} are permitted")


def _manifest(archive: ZipFile, members: dict[str, ZipInfo]) -> Manifest:
    if MANIFEST not in members or members[MANIFEST].file_size > MOST_BYTES_OF_MANIFEST:
        raise InvalidArchive(f"it has no {MANIFEST}, or one that is too long: it is not an archive of gaplab")
    with archive.open(members[MANIFEST]) as opened:
        text = opened.read(MOST_BYTES_OF_MANIFEST + 1)
    try:
        manifest = Manifest.model_validate(json.loads(text))
    except (ValidationError, ValueError, RecursionError) as error:
        msg = f"{MANIFEST} is invalid: {first_error(error) if isinstance(error, ValidationError) else 'it is not JSON'}"
        raise InvalidArchive(msg) from error
    if manifest.format > FORMAT:
        raise InvalidArchive(f"its format is {manifest.format}; this version of gaplab reads up to {FORMAT}")
    if missing := set(manifest.members) ^ (set(members) - {MANIFEST}):
        msg = f"{', '.join(sorted(missing)[:5])!r} is in the manifest or in the archive, but not in both"
        raise InvalidArchive(msg)
    if missing := _MEMBERS - members.keys():
        raise InvalidArchive(f"it has no {', '.join(sorted(missing)[:5])}")
    return manifest


def _refuse_too_many_rows(manifest: Manifest, most: int) -> None:
    rows = sum(member.rows for name, member in manifest.members.items() if name not in {CURVES, SPEC})
    if rows > most:
        permitted = f"{most:,} are permitted ({variable_of('imported_rows')})"
        raise InvalidArchive(f"it has {rows:,} rows; {permitted}: export its experiments one by one")


def _unpack(archive: ZipFile, info: ZipInfo, promised: Member, target: Path) -> Path:
    """Unpack a member into a file, and check its size and digest against the manifest."""
    hashed, size = sha256(), 0
    with archive.open(info) as opened, target.open("xb") as file:
        while (chunk := opened.read(_CHUNK)) and (size := size + len(chunk)) <= promised.bytes:
            hashed.update(chunk)
            file.write(chunk)
    if size != promised.bytes or hashed.hexdigest() != promised.sha256:
        raise InvalidArchive(f"{info.filename} differs from the manifest: it was damaged or changed")
    if digest_of(info.filename) not in (None, hashed.hexdigest()):
        raise InvalidArchive(f"the content of {info.filename} has another hash than its name: it was changed")
    return target


def convert_apart(files: Mapping[Path, int], program: Path = _UNPACKING) -> None:
    """Convert Parquet in a subprocess, which has limits; each file must have its number of rows.

    Raises:
        InvalidArchive: a file is not readable, or has other rows.
    """
    arguments = [str(each) for file, rows in files.items() for each in (file, json_lines_beside(file), rows)]
    command = [sys.executable, "-I", str(program), *arguments]
    ended = subprocess.run(command, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, check=False)  # noqa: S603 - ours
    if ended.returncode != 0:
        which = [*files][ended.returncode - 1].name if 0 < ended.returncode <= len(files) else "a member"
        msg = f"{which} is not readable Parquet, has other rows than the manifest states, or values that JSON has not"
        raise InvalidArchive(msg)


def json_lines_beside(file: Path) -> Path:
    """Return the file that receives the rows of a Parquet file, in its folder."""
    return file.with_suffix(".jsonl")
