"""`python -m tests.supervising URL`: a supervisor as a process of its own, which takes others for lost after 3 s."""

import sys
from typing import Any

from gaplab.services.running import execution
from gaplab.services.settings import Settings
from gaplab.workers import supervisor
from gaplab.workers.__main__ import serve

STALE_S = 3.0
HEARTBEATS = 60


def impatient(patch: Any = setattr) -> None:
    """Let the supervisors of this process be so."""
    requeue = execution.requeue_lost
    patch(execution, "requeue_lost", lambda store, **_: requeue(store, stale_after_s=STALE_S))
    patch(supervisor, "HEARTBEATS", HEARTBEATS)


if __name__ == "__main__":
    impatient()
    sys.exit(serve(Settings(database_url=sys.argv[1], workers=1)))
