"""A TCP proxy before a server, whose connections can die silently, as behind a firewall that forgets them."""

import select
import socket
from contextlib import suppress
from threading import Event, Thread


class Proxy:
    """Forwards TCP connections of loopback to a Unix socket, or to a port of loopback.

    Attributes:
        port: that it listens on.
    """

    def __init__(self, target: str | int) -> None:
        self._target, self._listener = target, socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._hung = Event()
        Thread(target=self._accept, daemon=True).start()

    def hang(self, *, for_good: bool = False) -> None:
        """Forward nothing of the present connections; later ones are forwarded, unless it is for good."""
        self._hung.set()
        if not for_good:
            self._hung = Event()

    def close(self) -> None:
        """Accept no more."""
        self._listener.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            Thread(target=self._forward, args=(client, self._hung), daemon=True).start()

    def _forward(self, client: socket.socket, hung: Event) -> None:
        family = socket.AF_UNIX if isinstance(self._target, str) else socket.AF_INET
        with client, socket.socket(family) as server, suppress(OSError):
            server.connect(self._target if isinstance(self._target, str) else ("127.0.0.1", self._target))
            while True:
                for ready in select.select([client, server], [], [], 0.1)[0]:
                    data = ready.recv(65536)
                    if hung.is_set():
                        if ready is client and not data:
                            return
                        continue
                    if not data:
                        return
                    (server if ready is client else client).sendall(data)
