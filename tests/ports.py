"""Ports of loopback for servers that a test starts, and starts again."""

import socket
from random import SystemRandom


def free_port() -> int:
    """A port that nobody serves, outside the ranges from which the system and Ray's workers take theirs.

    A port of those may be taken before the server starts, and again while it restarts.
    """
    while True:
        port = SystemRandom().randrange(20_000, 32_000)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
