"""The fault of two drivers: a worker moves the robot, and its supervisor stands still for longer than its lease."""

import signal
import time
from collections import namedtuple
from pathlib import Path
from typing import Any

from tests.soak.plugin_faults import submitted
from tests.soak.stage import PAST_THE_LEASE, send, until

SPEC = {"strategy": "simulated_fit", "reality": {"engine": "rig"}}


Command = namedtuple("Command", "at robot drive what", defaults=("moves",))
"""A line of the journal: seconds, robot, drive, and what happened: it moves, it stops, or the fitness of a run."""


def two_drivers(stage: Any) -> bool:
    """Submit an experiment whose reality is the robot, wait until it moves, and stop the supervisor that lets it."""
    before = len(commands(stage.journal, "rig"))
    if submitted(stage, SPEC, "on the robot") is None:
        return False
    driving: list[int] = []
    until(lambda: driving.extend(_driving(stage, before)) or driving, 60)  # type: ignore[func-returns-value]
    if not driving or not send(driving[0], signal.SIGSTOP):
        return False
    try:
        time.sleep(PAST_THE_LEASE * stage.lease_s)
    finally:
        send(driving[0], signal.SIGCONT)
    return True


def commands(journal: Path, robot: str | None = None) -> Any:
    """The motor commands of a journal, in the order in which they were given, and what else is in it; of one robot."""
    lines = journal.read_text().splitlines() if journal.exists() else []
    found = (Command(float(at), *others) for at, *others in map(str.split, lines))
    return sorted(each for each in found if robot in {None, each.robot})


def _driving(stage: Any, before: Any) -> Any:
    """The supervisor whose worker gave the latest command, in a list; an empty one if nothing has moved."""
    given = commands(stage.journal, "rig")[before:]
    pid = int(given[-1].drive.partition(".")[0]) if given else 0
    supervisors = set(stage.of("supervisor"))
    while pid > 1 and pid not in supervisors:
        pid = _parent(pid)
    return [pid] if pid in supervisors else []


def _parent(pid: Any) -> Any:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:  # it has ended
        return 0
