"""The API as a process."""

import uvicorn

from api.app import create_app
from services.settings import Settings
from services.store.session import Store


def serve_api(settings: Settings) -> None:
    """Serve until told to stop (SIGINT, SIGTERM); requests under way are answered first."""
    store = Store(settings.database_url)
    try:
        uvicorn.run(create_app(store), host=settings.host, port=settings.port, log_level="warning", server_header=False)
    finally:
        store.dispose()
