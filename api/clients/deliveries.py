"""Answers of a driver: each is journalled, and sent until the service has it."""

import logging
import time
from typing import Any

from gaplab.api.clients.connection import Connection, segment
from gaplab.api.clients.errors import ServiceError, ServiceUnreachable, refuses_sender
from gaplab.api.clients.journal import Journal
from gaplab.schemas.measurements import AnswerRead

PAUSE_S = 2.0
"""Pause after a request that the service could not serve."""

INVALID = 422
"""Status of an answer with a mistake, like too few values: what was measured is still good."""

log = logging.getLogger("gaplab.driver")


class Deliveries:
    """The answers of a driver.

    Args:
        connection: to the service.
        journal: what was measured and perhaps not sent.
        operator: name of the driver.
    """

    def __init__(self, connection: Connection, journal: Journal, operator: str) -> None:
        self.journal = journal
        self._connection, self._operator = connection, operator

    def send(self, request: str, answer: dict[str, Any]) -> AnswerRead:
        """Journal an answer, and send it until the service has it.

        Args:
            request: id of the request.
            answer: JSON.

        Raises:
            ServiceError: the service refuses it.
        """
        return self._deliver(request, answer, self.journal.answer(request, answer))

    def send_leftovers(self) -> None:
        """Send the answers that an earlier run left in the journal; one that is refused does not stop the others.

        Raises:
            ServiceError: the service refuses the token of the driver; the answers stay in the journal.
        """
        for request, answer, key in self.journal.unsent():
            try:
                self._deliver(request, answer, key)
            except ServiceError as error:
                if refuses_sender(error):
                    raise
                log.error("the answer %s in the journal, to request %s, is refused: %s", answer, request, error)

    def _deliver(self, request: str, answer: dict[str, Any], key: str) -> AnswerRead:
        path = f"/requests/{segment(request)}/measurements"
        while True:
            try:
                given = self._connection.post(AnswerRead, path, answer | {"operator": self._operator}, key=key)
            except ServiceUnreachable as error:
                log.warning("not sent yet: %s", error)
                time.sleep(PAUSE_S)
            except ServiceError as error:
                if error.problem.status < 500 and error.problem.status != 429:
                    if error.problem.status == INVALID:
                        self.journal.refused(key)
                    elif not refuses_sender(error):
                        self.journal.sent(key)
                    raise
                log.warning("not taken yet: %s", error)
                time.sleep(PAUSE_S)
            else:
                self.journal.sent(key)
                return given
