"""The loop of a driver, which is an operator: requests are taken one after the other, and answered once.

A take is kept by signs of life, and known to be lost before others may move the robot.
"""

import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from threading import Event, Thread
from typing import Any

from gaplab.api.clients.bodies import json_of, numbers_of, readings_of
from gaplab.api.clients.connection import Connection, Of, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, is_final, is_of_gaplab, refuses_sender
from gaplab.api.clients.journal import PAUSE_S, Journal, log
from gaplab.api.clients.studies import Studies
from gaplab.schemas.measurements import AnswerRead, AnswerState, RequestRead, RequestState
from gaplab.schemas.records import Page, SensorsRead

LEASE_SHARE = 0.8
"""Part of a lease after which a take without a heartbeat is lost: the robot stops before others may move it."""

WAIT_S = 20.0
"""Longest wait of the service for a request; the driver then asks again."""

_NOT_THIS_ONE = {404, 409, 429}
"""Statuses after which a driver tries the next request: it is deleted, somebody else was faster, or too many ask."""

INVALID = 422
"""Status of an answer with a mistake, like too few values: what was measured is still good."""

ENDED = 409
"""Status of an answer to a request that is no longer needed. Any other refusal may come from a service without it."""


@dataclass(frozen=True)
class DriverMotion:
    """Targets of actuators over time, constant between changes.

    Attributes:
        actuators: their names.
        units: unit of the targets of each: rad, rad/s or N·m for a hinge, m, m/s or N for a slide.
        times_s: times at which targets change.
        targets: a row of targets for each time, with a column for each actuator.
        observe_s: times of observation; the last one ends the run.
        start: angle of each joint before the motion, rad or m.
    """

    actuators: tuple[str, ...]
    units: tuple[str, ...]
    times_s: tuple[float, ...]
    targets: tuple[tuple[float, ...], ...]
    observe_s: tuple[float, ...]
    start: Mapping[str, float] = field(default_factory=dict)


def _now() -> float:
    """Return seconds of a clock that nobody sets, and that goes on while a laptop sleeps."""
    return time.clock_gettime(getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))


class TakeLost(Exception):
    """Others may move the robot, now or soon: it must stand still, and nothing is measured."""


class Take:
    """The right to measure a request: its constructor takes it, and heartbeats keep it.

    Attributes:
        request: what was taken.
        refused: why the service has ended the take; None if it has not.
        over: is set once it is answered, released, or left to its lease, so that no heartbeat is due.

    Raises:
        ServiceError: somebody else was faster, or the request is no longer needed.
    """

    def __init__(self, connection: Connection, request: str, operator: str, lease_s: float) -> None:
        self._connection, self._path = connection, f"/requests/{segment(request)}"
        self._operator, self._lease_s, self._shown = operator, lease_s, _now()
        body = {"operator": operator, "lease_s": lease_s}
        self.request = connection.post(RequestRead, f"{self._path}/take", body)
        self.refused: str | None = None
        self.over = Event()

    @property
    def lost(self) -> str | None:
        """Why others may move the robot, now or soon; None if they may not."""
        silence_s = LEASE_SHARE * self._lease_s
        if self.refused is None and _now() - self._shown > silence_s:
            return f"no heartbeat has reached the service for {silence_s:g} s"
        return self.refused

    def ask(self) -> None:
        """Send a heartbeat before the robot moves; raise TakeLost if others may move it, now or soon."""
        if not self.lost:
            self._show()
        if self.lost:
            raise TakeLost(self.lost)

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Send heartbeats from another thread, until the take is over or lost; then release what is not over."""
        thread = Thread(target=self._beat, name="heartbeat", daemon=True)
        thread.start()
        try:
            yield
        finally:
            if not self.over.is_set():
                self.release()
            thread.join()

    def release(self) -> None:
        """End the take. If others may have had the robot already, the service is told until it has heard."""
        self.over.set()
        while True:
            try:
                self._let_go()
                return
            except (ServiceError, ServiceUnreachable) as error:
                if is_final(error) or not self._may_overlap:
                    return
                log.warning("not told yet that others may have had the robot: %s", error)
                time.sleep(PAUSE_S)

    def leave(self) -> None:
        """Leave the take of a robot that may still move to its lease; if others may have it already, tell so."""
        self.over.set()
        if self._may_overlap:
            with suppress(ServiceError, ServiceUnreachable):
                self._let_go()

    @property
    def _may_overlap(self) -> bool:
        return self.refused is not None or _now() - self._shown > self._lease_s

    def _let_go(self) -> None:
        self._send("release", moved_s=_now() - self._shown, operator=self._operator)

    def _beat(self) -> None:
        while not self.over.wait(self._lease_s / 3) and not self.lost:
            self._show()

    def _show(self) -> None:
        now = _now()
        try:
            self._send("heartbeat")
        except (ServiceError, ServiceUnreachable) as error:
            log.warning("no heartbeat: %s", error)
            if is_of_gaplab(error) and is_final(error):
                self.refused = str(error)
        else:
            self._shown = now

    def _send(self, verb: str, **told: object) -> None:
        body, timeout_s = {"take": self.request.takes, **told}, max(1.0, self._lease_s / 3)
        self._connection.change(RequestRead, "POST", f"{self._path}/{verb}", json=body, timeout=timeout_s)


class TakenRequest:
    """A request that this driver has taken, so that nobody else measures it; it is answered once.

    Attributes:
        request: the request, as it was taken.
        take: the right to measure it; stop the robot if that is `lost`, and `ask` before the robot moves again.
    """

    def __init__(self, driving: "Driving", take: Take) -> None:
        self.request, self.take = take.request, take
        self._driving = driving

    @cached_property
    def motion(self) -> DriverMotion:
        """The motion to run.

        Raises:
            ServiceError: the controller observes while it acts, or the robot has no actuators: run the genome.
        """
        path = f"/requests/{segment(self.id)}/motion"
        return self._driving.connection.get(DriverMotion, path, format="json")

    @cached_property
    def sensors(self) -> SensorsRead | None:
        """The sensors of the robot; None if the service does not know them.

        Raises:
            ServiceError: the experiment was deleted.
        """
        return self._driving.studies.experiment(self.request.experiment).sensors

    @property
    def id(self) -> str:
        """Id of the request."""
        return self.request.id

    @property
    def genome(self) -> tuple[float, ...]:
        """Genome of the controller."""
        return self.request.genome

    @property
    def repeats(self) -> int:
        """Number of values that are asked for."""
        return self.request.repeats

    @property
    def known(self) -> list[tuple[float, Any]]:
        """Repeats that an earlier run of the driver measured and journalled, with their readings."""
        return self._driving.journal.repeats(self.id, self._void)[: self.repeats]

    def note(self, value: float, readings: Any = None) -> None:  # noqa: ANN401 - JSON
        """Journal one repeat, so that a power cut before the last one loses nothing; its errors are those of `tell`."""
        (number,) = numbers_of([value], "/values")
        noted = json_of(readings_of(readings), "/readings")
        self._driving.journal.repeat(self.id, number, noted, self._void)

    @property
    def _void(self) -> list[str]:
        """Answers that counted once: what was measured before their correction or void is invalid."""
        return [each.id for each in self.request.answers if each.state in {AnswerState.REPLACED, AnswerState.VOID}]

    def forget(self) -> None:
        """Forget the repeats that were noted: others may have had the robot meanwhile."""
        self._driving.journal.forget(self.id)

    def tell(self, values: float | Sequence[float], readings: Any = None, note: str | None = None) -> AnswerRead:  # noqa: ANN401 - JSON
        """Answer with the value, or the values of all repeats.

        Args:
            values: fitness of each repeat; a single one may be a number.
            readings: of each repeat, a row for each time and a column for each sensor; None or NaN where it failed.
            note: what to keep beside it.

        Raises:
            ValueError: a value is not finite, or a reading is infinite; nothing is journalled.
            TypeError: a value is not a number, or JSON cannot hold a reading; nothing is journalled.
            ServiceError: the service refuses the answer; repeats that were noted stay `known`.
        """
        told = {"values": numbers_of(values, "/values"), "readings": json_of(readings_of(readings), "/readings")}
        return self._answer(told | {"note": note})

    def fail(self, reason: str | Exception) -> AnswerRead:
        """Answer that the measurement failed: the controller counts as tried, but simulators are not tuned on it."""
        return self._answer({"failed": str(reason) or type(reason).__name__})

    def _answer(self, answer: dict[str, Any]) -> AnswerRead:
        given = {name: value for name, value in answer.items() if value is not None} | {"take": self.request.takes}
        key = self._driving.journal.answer(self.id, given)
        if self.take.lost:
            self.take.release()
        answered = self._driving.deliver(self.id, given, key)
        self.take.over.set()
        return answered


class Driving:
    """The requests of a driver; see `Requests.requests`."""

    def __init__(
        self, connection: Connection, studies: Studies, journal: Journal, lease_s: float, operator: str | None
    ) -> None:
        self.connection, self.studies, self.journal = connection, studies, journal
        self._lease_s, self._operator = lease_s, operator or socket.gethostname()

    def tasks(self, experiment: Of | None, bench: str | None) -> Iterator[TakenRequest]:
        """Yield taken requests until the experiment has ended; send first what an earlier run left in the journal."""
        self._send_leftovers()
        while True:
            task = self._next(experiment, bench)
            if task is None:
                if experiment is not None and self._ended(experiment):
                    return
                continue
            with task.take.kept():
                yield task

    def _next(self, experiment: Of | None, bench: str | None) -> TakenRequest | None:
        """Take the oldest open request; None if there is none, or others have the bench.

        Raises:
            ServiceError: the service refuses the token of the driver, or what it asks for.
            UnknownService: what answers is not gaplab of this version.
        """
        parameters: dict[str, Any] = {"experiment": experiment, "bench": bench, "wait_s": WAIT_S}
        pause_s = 0.0
        try:
            for request in self.connection.items(Page[RequestRead], "/requests", **parameters):
                pause_s = PAUSE_S
                is_free = request.state is RequestState.OPEN and not request.busy
                if is_free and (taken := self._take(request)):
                    return taken
        except (ServiceUnreachable, ServiceError) as error:
            if is_final(error):
                raise
            log.warning("no answer: %s", error)
            pause_s = PAUSE_S
        time.sleep(pause_s)
        return None

    def _take(self, request: RequestRead) -> TakenRequest | None:
        """Take a request; None if somebody else was faster, or it is no longer needed."""
        try:
            return TakenRequest(self, Take(self.connection, request.id, self._operator, self._lease_s))
        except ServiceError as error:
            if error.problem.status not in _NOT_THIS_ONE:
                raise
            log.info("not taken: %s", error)
            return None

    def _ended(self, experiment: Of) -> bool:
        try:
            return self.studies.experiment(experiment).state.ended
        except (ServiceError, ServiceUnreachable):
            return False

    def _send_leftovers(self) -> None:
        """Send the answers that an earlier run left in the journal; one that is refused does not stop the others.

        Raises:
            ServiceError: the service refuses the token of the driver; the answers stay in the journal.
        """
        for request, answer, key in self.journal.unsent():
            try:
                self.deliver(request, answer, key)
            except ServiceError as error:
                if refuses_sender(error):
                    raise
                log.error("the answer %s in the journal, to request %s, is refused: %s", answer, request, error)

    def deliver(self, request: str, answer: dict[str, Any], key: str) -> AnswerRead:
        """Send a journalled answer until the service has it; it stays in the journal if the service never saw it.

        Raises:
            ServiceError: the service refuses it.
        """
        path = f"/requests/{segment(request)}/measurements"
        while True:
            try:
                given = self.connection.post(AnswerRead, path, answer | {"operator": self._operator}, key=key)
            except ServiceUnreachable as error:
                log.warning("not sent yet: %s", error)
            except ServiceError as error:
                if is_final(error):
                    status = error.problem.status
                    if is_of_gaplab(error) and status in {INVALID, ENDED}:
                        self.journal.sent(key, refused=status == INVALID)
                    raise
                log.warning("not taken yet: %s", error)
            else:
                self.journal.sent(key)
                return given
            time.sleep(PAUSE_S)
