"""Entries of zips: the same bytes for the same content."""

from zipfile import ZIP_DEFLATED, ZipInfo

_EARLIEST = (1980, 1, 1, 0, 0, 0)
_UNIX, _FILE = 3, 0o644 << 16


def entry_of(name: str) -> ZipInfo:
    """Return the entry of a file, with the earliest date of the format."""
    entry = ZipInfo(name, _EARLIEST)
    entry.compress_type = ZIP_DEFLATED
    entry.create_system, entry.external_attr = _UNIX, _FILE
    return entry
