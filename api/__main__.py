"""The API alone, as a container runs it: `python -m api`. It neither migrates the database nor runs experiments."""

import sys

from gaplab.api.process.errors import CommandError
from gaplab.api.process.server import listen, serve_api
from gaplab.services import logs
from gaplab.services.core.errors import GaplabError
from gaplab.services.settings import Settings


def main() -> None:
    """Serve the API with the settings in the environment variables."""
    try:
        settings = Settings.from_environment()
        logs.configure()
        serve_api(settings, listen(settings.host, settings.port))
    except (CommandError, GaplabError, ValueError) as error:
        sys.exit(f"gaplab: {error}")


if __name__ == "__main__":
    main()
