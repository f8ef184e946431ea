"""`python -m migrations`: bring the database of `GAPLAB_DATABASE_URL` to the latest revision."""

import sys

from gaplab.migrations import upgrade
from gaplab.services.settings import Settings
from gaplab.services.store.database_errors import StoreUnavailable


def main() -> None:
    """Migrate; on failure, print the reason and exit with 1."""
    try:
        upgrade(Settings.from_environment().database_url)
    except (StoreUnavailable, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
