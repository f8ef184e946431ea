"""An archive that somebody sent: unpacked with limits, and checked to be what its manifest says.

Nothing of it is trusted: names are ours or refused and never become paths, sizes are counted as they are unpacked, and
Parquet is read by a process of its own.
"""

import json
import subprocess
import sys
from collections.abc import Sequence
from errno import EINVAL
from hashlib import sha256
from pathlib import Path
from subprocess import DEVNULL
from typing import IO
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile, ZipInfo
from zlib import error as ZlibError  # noqa: N812 - it is an error

from pydantic import ValidationError

from gaplab.schemas.archives import FORMAT, Manifest, Member
from gaplab.services.archives.members import CURVES, MANIFEST, member_of
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.store.archive_columns import EXPORTED

MOST_BYTES = 512 * 2**20
"""Of all members together, unpacked: a study of the paper's size has about ten million."""

MOST_BYTES_OF_MANIFEST = 100_000
_UNPACKING = Path(__file__).with_name("unpacking.py")
_CHUNK = 2**16


def open_archive(file: IO[bytes], folder: Path) -> tuple[Manifest, dict[str, Path]]:
    """Unpack an archive into an empty folder: its manifest, and for each table the file of its rows as JSON Lines.

    Raises:
        InvalidArchive: it is none, it was damaged, it was made to harm, or a later version wrote it.
    """
    try:
        with ZipFile(file) as archive:
            members = _members(archive)
            manifest = _manifest(archive, members)
            files = {
                name: _unpack(archive, info, manifest.members[name], folder / name)
                for name, info in members.items()
                if name != MANIFEST
            }
    except (BadZipFile, ZlibError, EOFError, NotImplementedError, RuntimeError, ValueError, OverflowError) as error:
        msg = f"it is no zip that can be read: {type(error).__name__}"
        raise InvalidArchive(msg) from error
    except OSError as error:
        if error.errno != EINVAL:  # a place before the file's beginning
            raise
        msg = "it is no zip that can be read: its directory points outside of it"
        raise InvalidArchive(msg) from error
    _read_parquet([file for name, file in files.items() if name.endswith(".parquet")])
    tables = {table: _lines_of(files[member_of(table)]) for table in EXPORTED if member_of(table) in files}
    return manifest, tables


def _members(archive: ZipFile) -> dict[str, ZipInfo]:
    known = {MANIFEST, CURVES, *map(member_of, EXPORTED)}
    found: dict[str, ZipInfo] = {}
    for info in archive.infolist():
        if info.filename not in known:
            msg = f"a member is called {info.filename[:64]!r}; there may be {', '.join(sorted(known))}"
            raise InvalidArchive(msg)
        if info.filename in found:
            msg = f"{info.filename} is there twice"
            raise InvalidArchive(msg)
        if info.compress_type not in {ZIP_STORED, ZIP_DEFLATED} or info.flag_bits & 1:
            msg = f"{info.filename} is encrypted, or compressed in another way than a zip's usual one"
            raise InvalidArchive(msg)
        found[info.filename] = info
    if (size := sum(each.file_size for each in found.values())) > MOST_BYTES:
        msg = f"unpacked it has {size:,} bytes; {MOST_BYTES:,} are permitted"
        raise InvalidArchive(msg)
    return found


def _manifest(archive: ZipFile, members: dict[str, ZipInfo]) -> Manifest:
    if MANIFEST not in members or members[MANIFEST].file_size > MOST_BYTES_OF_MANIFEST:
        msg = f"it has no {MANIFEST}, or one that is too long: it is no archive of gaplab"
        raise InvalidArchive(msg)
    with archive.open(members[MANIFEST]) as opened:
        text = opened.read(MOST_BYTES_OF_MANIFEST + 1)
    try:
        manifest = Manifest.model_validate(json.loads(text))
    except (ValidationError, ValueError, RecursionError) as error:
        msg = f"{MANIFEST} is not what it should be: {_first(error)}"
        raise InvalidArchive(msg) from error
    if manifest.format > FORMAT:
        msg = f"its format is {manifest.format}; this version of gaplab reads up to {FORMAT}"
        raise InvalidArchive(msg)
    if missing := set(manifest.members) ^ (set(members) - {MANIFEST}):
        msg = f"{', '.join(sorted(missing)[:5])!r} is in the manifest or in the archive, but not in both"
        raise InvalidArchive(msg)
    return manifest


def _first(error: Exception) -> str:
    if isinstance(error, ValidationError):
        found = error.errors(include_url=False, include_input=False)[0]
        return f"{'/'.join(map(str, found['loc']))[:100]}: {found['msg']}"
    return "it is not JSON"


def _unpack(archive: ZipFile, info: ZipInfo, promised: Member, target: Path) -> Path:
    """The member as a file of ours, once it is known to be what the manifest says."""
    hashed, size = sha256(), 0
    with archive.open(info) as opened, target.open("xb") as file:
        while (chunk := opened.read(_CHUNK)) and (size := size + len(chunk)) <= promised.bytes:
            hashed.update(chunk)
            file.write(chunk)
    if size != promised.bytes or hashed.hexdigest() != promised.sha256:
        msg = f"{info.filename} is not what the manifest says: it was damaged or changed"
        raise InvalidArchive(msg)
    return target


def _read_parquet(files: Sequence[Path]) -> None:
    """Write the rows of each Parquet file beside it, as JSON Lines."""
    paths = [str(path) for file in files for path in (file, _lines_of(file))]
    command = [sys.executable, "-I", str(_UNPACKING), *paths]
    ended = subprocess.run(command, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, check=False)  # noqa: S603 - ours
    if ended.returncode != 0:
        which = files[ended.returncode - 1].name if 0 < ended.returncode <= len(files) else "a member"
        msg = f"{which} is no Parquet that can be read, or has what has no place in an archive"
        raise InvalidArchive(msg)


def _lines_of(file: Path) -> Path:
    return file.with_suffix(".jsonl")
