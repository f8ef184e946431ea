"""`python -m migrations`: bring the database of `GAPLAB_DATABASE_URL` to the revision that this version needs."""

from migrations import upgrade
from services.settings import Settings

if __name__ == "__main__":
    upgrade(Settings.from_environment().database_url)
