"""The revision of a database's schema, compared with the one that this version of gaplab needs."""

from collections.abc import Sequence

from gaplab.services.store.models import REVISION


def is_later(found: Sequence[str]) -> bool:
    """Return whether a database at these revisions is of a later version of gaplab."""
    return bool(found) and all(revision > REVISION for revision in found)


def other_schema(found: Sequence[str]) -> str:
    """Return the sentence about a database at other revisions than this version's, with what to do."""
    what = "use the version of gaplab that it is of" if is_later(found) else "run `python -m migrations`"
    return f"the database is at revision {', '.join(found) or 'none'}, this version needs {REVISION}: {what}"
