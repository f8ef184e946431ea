"""A client of the service in this process: it answers over no network, from a store."""

import asyncio
from threading import Thread

import httpx2

from gaplab.api.app import create_app
from gaplab.api.clients.client import Client
from gaplab.api.process.local_service import token_of
from gaplab.services.store.session import Store


class InProcess(httpx2.BaseTransport):
    """Sends requests to an application of this process, in a thread of its own: a notebook has a loop already."""

    def __init__(self, store: Store) -> None:
        self._app = httpx2.ASGITransport(create_app(store), raise_app_exceptions=False)
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever, name="service", daemon=True)
        self._thread.start()

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Return the answer to a request, once all of it is there."""
        return asyncio.run_coroutine_threadsafe(self._answer(request, request.read()), self._loop).result()

    def close(self) -> None:
        """End the thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _answer(self, request: httpx2.Request, content: bytes) -> httpx2.Response:
        asked = httpx2.Request(request.method, request.url, headers=request.headers, content=content)
        answer = await self._app.handle_async_request(asked)
        raw = b"".join([chunk async for chunk in answer.aiter_raw()])
        return httpx2.Response(answer.status_code, headers=answer.headers, stream=httpx2.ByteStream(raw))


def client_of(store: Store, database_url: str) -> Client:
    """Return a client of the service over a store, with all its methods."""
    return Client("http://gaplab.invalid", token=token_of(database_url), transport=InProcess(store))
