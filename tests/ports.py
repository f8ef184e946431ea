"""Ports of loopback for servers that a test starts, and starts again."""

import os
import socket
from random import SystemRandom

WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
"""Number of the process of the tests: each has ports of its own, for a server that restarts leaves its port free."""

COUNT = 1_000
_given = set[int]()


def free_port() -> int:
    """A port that nobody serves and no test was given, outside the ranges of the system and of Ray's workers.

    A port of those may be taken before the server starts, and again while it restarts.
    """
    first = 20_000 + COUNT * (WORKER % 12)
    while True:
        port: int = SystemRandom().choice([*{*range(first, first + COUNT)} - _given])
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            _given.add(port)
            return port
