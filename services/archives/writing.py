"""Export of studies from a store into an archive."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from hashlib import file_digest
from importlib.metadata import version
from io import SEEK_END, BufferedIOBase, BytesIO
from shutil import copyfileobj
from tempfile import TemporaryFile
from typing import IO
from zipfile import ZipFile

from pydantic import TypeAdapter

from gaplab.schemas.archives import FORMAT, Manifest, Member
from gaplab.schemas.curves import Curve
from gaplab.services.archives.columns import EXPORTED, Row, columns_of
from gaplab.services.archives.members import CURVES, MANIFEST, SPEC, file_member_of, member_of, write
from gaplab.services.experiments import hiding
from gaplab.services.results import curves
from gaplab.services.results.files import entry_of
from gaplab.services.specs.shortening import shortest
from gaplab.services.store.models import REVISION
from gaplab.services.store.queries import archives, attachments, experiments
from gaplab.services.store.session import Session, Store
from gaplab.services.store.stored_specs import without_truth


@dataclass(frozen=True)
class Archive:
    """An archive in a temporary file, which is deleted when it is closed.

    Attributes:
        name: a suitable file name.
        size: size in bytes.
        file: open file, at its beginning.
    """

    name: str
    size: int
    file: IO[bytes]


def export(store: Store, id_: str) -> Archive:
    """Return an archive of a study at one moment, or of a study with one of its experiments alone.

    The parameters of reality are null until they may be shown. Memory does not grow with the number of results.

    Raises:
        NotFound: no such study or experiment.
    """
    with store.reading() as session:
        return _export(session, experiments.members(session, id_))


def _export(session: Session, found: experiments.Members) -> Archive:
    hidden = hiding.hidden(session, found.experiments)
    file = TemporaryFile()  # noqa: SIM115 - the sender closes it
    try:
        members: dict[str, Member] = {}
        with ZipFile(file, "w") as archive:
            for table in EXPORTED:
                with TemporaryFile() as part:
                    count = write(table, _rows(session, table, found, hidden), part)
                    members[member_of(table)] = _add(archive, member_of(table), part, count)
            members |= _add_files(session, archive, found.ids)
            points = TypeAdapter(tuple[Curve, ...]).dump_json(curves.curves_of(session, found.experiments))
            members[CURVES] = _add(archive, CURVES, BytesIO(points), len(found.ids))
            members[SPEC] = _add(archive, SPEC, BytesIO(_spec(found, hidden)), 0)
            manifest = Manifest(
                format=FORMAT, gaplab=version("gaplab"), revision=REVISION, id=found.study.id, members=members
            )
            archive.writestr(entry_of(MANIFEST), manifest.model_dump_json(indent=2))
        size = file.tell()
        file.seek(0)
    except BaseException:
        file.close()
        raise
    return Archive(name=f"gaplab-{found.named.id}.zip", size=size, file=file)


def _spec(found: experiments.Members, hidden: Collection[str]) -> bytes:
    """Return the spec to submit again, as JSON, with remarks on what it lacks."""
    specs = [without_truth(row.spec) if row.id in hidden else row.spec for row in found.experiments]
    shown = shortest(found.named.name, specs)
    return shown.model_dump_json(include={"spec", "remarks"}, indent=2).encode()


def _rows(session: Session, table: str, found: experiments.Members, hidden: Collection[str]) -> Iterator[Row]:
    """Yield the rows of a table as they are exported: without secrets."""
    owners = [found.study.id] if table == "study" else found.ids
    for row in archives.read_rows(session, table, [column.name for column in columns_of(table)], owners):
        if table == "experiment" and row["id"] in hidden:
            row |= {"spec": without_truth(row["spec"])}
        yield row


def _add_files(session: Session, archive: ZipFile, experiments: Sequence[str]) -> dict[str, Member]:
    """Add the files that answers name, one in memory at a time."""
    digests = [row["id"] for row in archives.read_rows(session, "attachment", ["id"], experiments)]
    return {
        file_member_of(digest): _add(
            archive, file_member_of(digest), BytesIO(attachments.content_of(session, digest)), 0
        )
        for digest in digests
    }


def _add(archive: ZipFile, name: str, content: BufferedIOBase, rows: int) -> Member:
    size = content.seek(0, SEEK_END)
    content.seek(0)
    digest = file_digest(content, "sha256").hexdigest()
    content.seek(0)
    with archive.open(entry_of(name), "w", force_zip64=True) as target:
        copyfileobj(content, target)
    return Member(sha256=digest, bytes=size, rows=rows)
