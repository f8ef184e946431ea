"""Experiments and studies out of a store, into an archive."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from tempfile import TemporaryFile
from typing import IO, Literal
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

from pydantic import TypeAdapter

from gaplab.schemas.archives import FORMAT, Manifest, Member
from gaplab.schemas.curves import Curve
from gaplab.services.archives.members import CURVES, MANIFEST, Hashed, member_of, write
from gaplab.services.experiments import hiding
from gaplab.services.results import curves
from gaplab.services.store.archive_columns import EXPORTED
from gaplab.services.store.models import REVISION, ExperimentRow
from gaplab.services.store.queries import archives, experiments
from gaplab.services.store.session import Session, Store

_MOMENT = (1980, 1, 1, 0, 0, 0)
"""Of every member, the earliest that a zip knows: the same content gives the same bytes."""

_FILE = 0o644 << 16


@dataclass(frozen=True)
class Archive:
    """A whole archive in a file without a name, which is gone once it is closed.

    Attributes:
        name: what it might be called.
        size: in bytes.
        file: at its beginning.
    """

    name: str
    size: int
    file: IO[bytes]


def export_experiment(store: Store, experiment_id: str) -> Archive:
    """Everything of an experiment at one moment, on its own: whatever its study is, it is not in there.

    Memory does not grow with what there is. Reality's parameters are null until they may be shown.

    Raises:
        NotFound: no such experiment.
    """
    with store.reading() as session:
        row = experiments.get_experiment(session, experiment_id)
        return _export(session, "experiment", row.id, [row])


def export_study(store: Store, study_id: str) -> Archive:
    """Everything of a study and its experiments, as `export_experiment` does.

    Raises:
        NotFound: no such study.
    """
    with store.reading() as session:
        study = experiments.get_study(session, study_id)
        return _export(session, "study", study.id, experiments.experiments_of(session, [study.id]))


def _export(
    session: Session, kind: Literal["study", "experiment"], id_: str, owners: Sequence[ExperimentRow]
) -> Archive:
    ids, hidden = [each.id for each in owners], hiding.hidden(session, owners)
    study = id_ if kind == "study" else None
    file = TemporaryFile()  # noqa: SIM115 - whoever sends it closes it
    try:
        members: dict[str, Member] = {}
        with ZipFile(file, "w") as archive:
            for table in EXPORTED:
                rows = archives.rows(session, table, study=study, experiments=ids, hidden=hidden)
                _add(archive, members, member_of(table), lambda into, table=table, rows=rows: write(table, rows, into))  # type: ignore[misc]
            points = TypeAdapter(tuple[Curve, ...]).dump_json(curves.curves_of(session, ids))
            _add(archive, members, CURVES, lambda into: into.write(points) and len(ids))
            manifest = Manifest(
                format=FORMAT, gaplab=version("gaplab"), revision=REVISION, kind=kind, id=id_, members=members
            )
            archive.writestr(_info(MANIFEST), manifest.model_dump_json(indent=2))
        size = file.tell()
        file.seek(0)
    except BaseException:
        file.close()
        raise
    return Archive(name=f"gaplab-{id_}.zip", size=size, file=file)


def _add(archive: ZipFile, members: dict[str, Member], name: str, fill: Callable[[Hashed], int]) -> None:
    with archive.open(_info(name), "w", force_zip64=True) as target:
        hashed = Hashed(target)
        rows = fill(hashed)
    members[name] = Member(sha256=hashed.digest, bytes=hashed.bytes, rows=rows)


def _info(name: str) -> ZipInfo:
    """Parquet is compressed by itself."""
    info = ZipInfo(name, _MOMENT)
    info.compress_type = ZIP_STORED if name.endswith(".parquet") else ZIP_DEFLATED
    info.external_attr = _FILE
    return info
