"""The API alone, as a container runs it: `python -m api`. It neither migrates the database nor runs anything."""

from api.server import serve_api
from services.settings import Settings

if __name__ == "__main__":
    serve_api(Settings.from_environment())
