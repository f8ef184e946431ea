"""A private database for the archives that a command reads."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from gaplab import migrations
from gaplab.schemas.archives import ImportRead
from gaplab.services.archives import import_archive
from gaplab.services.core.errors import InvalidArchive
from gaplab.services.store.session import Store


@contextmanager
def private_store() -> Iterator[Store]:
    """Yield an empty database at the latest revision, which is deleted afterwards."""
    with TemporaryDirectory(prefix="gaplab-archives-") as folder:
        url = f"sqlite:///{Path(folder) / 'gaplab.db'}"
        migrations.upgrade(url)
        store = Store(url)
        try:
            yield store
        finally:
            store.dispose()


def import_file(store: Store, path: Path) -> ImportRead:
    """Import an archive, and return the ids of its study and its experiments.

    Raises:
        SystemExit: the file cannot be read, or is not an archive.
    """
    try:
        with path.open("rb") as file:
            return import_archive(store, file)
    except (OSError, InvalidArchive) as error:
        raise SystemExit(f"{path}: {error}") from error
