"""The courier: a thread of the API that finds and delivers notifications, one after another.

Of several processes on one database one at a time has its turn; if it dies, another continues two minutes later.
"""

import logging
import os
import secrets
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from gaplab.schemas.notifications import Channel
from gaplab.services.notifications import outbox
from gaplab.services.notifications.delivery import deliver
from gaplab.services.settings import Notify
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store

EVERY_S = 2.0
"""Interval between two looks at the events."""

log = logging.getLogger("gaplab.notifications")


class Courier:
    """Delivers notifications in the background, from `start` to `stop`; without settings it does nothing.

    It does not close the store. Links in messages lead to `page`, the address of the service's page.
    """

    def __init__(self, store: Store, notify: Notify, page: str = "") -> None:
        self._store = store
        self._notify = notify
        self._page = page.rstrip("/")
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(4)}"
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notifications", daemon=True)

    def start(self) -> None:
        """Begin, if the owner of the service has set anything to tell."""
        if self._notify.is_on:
            self._thread.start()

    def stop(self) -> None:
        """End after the delivery under way; what is left is sent by the next courier."""
        self._stopped.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)

    def work(self) -> bool:
        """Deliver what is due, and return whether it was this process's turn."""
        settings = {Channel.WEBHOOK: self._notify.url, Channel.COMMAND: self._notify.command}
        channels = [channel for channel, setting in settings.items() if setting]
        while has_turn := outbox.collect(self._store, self._owner, channels):
            letter = outbox.next_letter(self._store)
            if letter is None or self._stopped.is_set():
                break
            url = f"{self._page}/#/studies/{letter.message.subject}" if self._page else None
            outcome = deliver(
                letter.message.model_copy(update={"url": url}), letter.channel, letter.webhook, self._notify
            )
            if outcome.failure:
                log.warning("notification %s by %s: %s", letter.message.id, letter.channel, outcome.failure)
            outbox.settle(self._store, letter, outcome.failure, hopeless=outcome.hopeless)
        return has_turn

    def _run(self) -> None:
        while not self._stopped.wait(EVERY_S):
            try:
                self.work()
            except StoreUnavailable as error:
                log.warning("notifications wait for the database: %s", error)
            except Exception:  # a courier that ends would tell nobody anything again
                log.exception("a notification failed")


@contextmanager
def courier(store: Store, notify: Notify, page: str) -> Iterator[Courier]:
    """Deliver notifications for as long as the context lasts."""
    made = Courier(store, notify, page)
    made.start()
    try:
        yield made
    finally:
        made.stop()
