"""Whether one program moved a robot at a time, by the journal of the commands that robots got."""

import socket
from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import inf
from typing import Any

from tests.soak.driver_faults import LEASE_S
from tests.soak.hardware_faults import Command

PAUSED_S = 1.0
"""Between two commands of one drive: it stood still."""

REACTION_S = 0.3
"""For how long a drive that wakes may give commands before it stops: it looks ten times a second, on a busy machine."""


def drives(commands: Sequence[Command]) -> Iterator[str]:
    """Once a drive has begun, no earlier one moves the same robot, but for what it does in the moment that it wakes."""
    now, ended, late = dict[str, str](), set[str](), dict[tuple[str, str], list[float]]()
    last, woke = dict[str, float](), dict[str, float]()
    for at, robot, drive, what in commands:
        if what != "moves":
            continue
        if drive in ended:
            woke[drive] = at if at - last[drive] >= PAUSED_S else woke.get(drive, -inf)
            if at - woke[drive] > REACTION_S:
                late.setdefault((robot, drive), []).append(at)
        elif now.get(robot, drive) != drive:
            ended.add(now[robot])
        if drive not in ended:
            now[robot] = drive
        last[drive] = at
    for (robot, drive), when in late.items():
        yield f"{drive} moved {robot} {len(when)} times from {when[0]} to {when[-1]}, after another had begun"


def held(evidence: Any) -> Iterator[str]:
    """An answer of a driver that counts is the fitness of a run that never stood still for as long as its lease."""
    given = dict[tuple[str, str], list[float]]()
    measured = set[tuple[str, str]]()
    for at, robot, drive, what in evidence.commands:
        moves = given.setdefault((robot, drive), [])
        if what == "moves":
            moves.append(at)
        elif what != "stop" and all(after - before < LEASE_S for before, after in pairwise(moves)):
            measured.add((robot, what))
    for id_, answer in evidence.answers.items():
        of_driver = answer.state == "counted" and answer.operator == socket.gethostname()
        if of_driver and not all((answer.bench, repr(value)) in measured for value in answer.values):
            yield f"answer {id_} of a driver counts, and no run of it had its take throughout"
