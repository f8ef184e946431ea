"""Delivery of notifications, one after another: a POST to a webhook, or a command of the service's owner.

The courier is a thread of the API. Of several processes on one database one at a time has its turn; if it dies, another
continues two minutes later.
"""

import asyncio
import hmac
import logging
import os
import secrets
import shlex
import socket
import subprocess
import threading
import time
from dataclasses import dataclass
from hashlib import sha256
from typing import Self

import httpx2

from gaplab.schemas.notifications import Channel, Notification
from gaplab.services.notifications import outbox
from gaplab.services.notifications.webhooks import refusal
from gaplab.services.settings import Notify
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.session import Store

WEBHOOK_S = 10.0
COMMAND_S = 60.0
"""Longest times of a delivery, from its beginning to its end."""

_GONE = {400, 401, 403, 404, 405, 410, 422}
"""Statuses of an address that refuses the message itself."""


@dataclass(frozen=True)
class Attempt:
    """How an attempt ended.

    Attributes:
        failure: why the message was not delivered, without the address, which may hold a secret; None if it was.
        hopeless: whether a further attempt would fail the same way.
    """

    failure: str | None = None
    hopeless: bool = False


def deliver(message: Notification, channel: Channel, webhook: str | None, notify: Notify) -> Attempt:
    """Send a notification once; `webhook` is the address that its study has of its own."""
    if channel is Channel.COMMAND:
        return run(notify.command, message) if notify.command else _no_longer("the command")
    if channel is Channel.WEBHOOK:
        return post(notify.url, message, notify.secret) if notify.url else _no_longer("the webhook of the service")
    if webhook is None:
        return _no_longer("its webhook")
    if why := refusal(webhook, notify.permitted_hosts):
        return Attempt(why, hopeless=True)
    return post(webhook, message, notify.secret)


def post(url: str, message: Notification, secret: str | None = None, *, within_s: float = WEBHOOK_S) -> Attempt:
    """POST the message as JSON, and wait `within_s` for an answer.

    Redirects are not followed, and the body of the answer is not read.
    """
    body = message.model_dump_json().encode()
    headers = {"Content-Type": "application/json", "User-Agent": "gaplab", "Gaplab-Notification": message.id}
    if secret:
        headers["Gaplab-Signature"] = signature(secret, body, int(time.time()))
    try:
        status = _status(url, body, headers, within_s)
    except TimeoutError:
        return Attempt(f"it did not answer within {within_s:g} s")
    except (httpx2.HTTPError, httpx2.InvalidURL, UnicodeError) as error:
        return Attempt(f"it cannot be reached ({type(error).__name__})")
    if 200 <= status < 300:
        return Attempt()
    return Attempt(f"it answered {status}", hopeless=status in _GONE or 300 <= status < 400)


def _status(url: str, body: bytes, headers: dict[str, str], within_s: float) -> int:
    """POST, and return the status of the answer.

    Raises:
        TimeoutError: there is no answer after `within_s`, even if each of its bytes came soon after the one before.
    """

    async def answered() -> int:
        async with (
            asyncio.timeout(within_s),
            httpx2.AsyncClient(timeout=None, follow_redirects=False) as client,
            client.stream("POST", url, content=body, headers=headers) as answer,
        ):
            return answer.status_code

    loop = asyncio.new_event_loop()
    try:
        return loop.run_until_complete(answered())
    finally:
        loop.close()  # unlike asyncio.run, it does not wait for a thread that still looks up the host


def signature(secret: str, body: bytes, at: int) -> str:
    """Return the signature of a body: `t=SECONDS,v1=HEX`, an HMAC-SHA256 of `SECONDS.BODY`."""
    digest = hmac.new(secret.encode(), f"{at}.".encode() + body, sha256).hexdigest()
    return f"t={at},v1={digest}"


def run(command: str, message: Notification) -> Attempt:
    """Run the owner's command without a shell; it reads the message as JSON from its standard input.

    Nothing that users write is an argument of it. Its environment has no secrets of gaplab.
    """
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("GAPLAB_") and name != "PGPASSWORD"
    }
    environment |= {
        "GAPLAB_NOTIFICATION": message.id,
        "GAPLAB_STATE": message.state.value,
        "GAPLAB_ID": message.subject,
    }
    try:
        ended = subprocess.run(  # noqa: S603 - the owner of the service has set it
            shlex.split(command),
            input=message.model_dump_json().encode(),
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=COMMAND_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Attempt(f"the command did not end within {COMMAND_S:g} s")
    except (OSError, ValueError) as error:
        return Attempt(f"the command cannot be run: {getattr(error, 'strerror', None) or 'it is not a command line'}")
    return Attempt(f"the command ended with code {ended.returncode}" if ended.returncode else None)


def _no_longer(what: str) -> Attempt:
    return Attempt(f"{what} was removed before it was told", hopeless=True)


EVERY_S = 2.0
"""Interval between two looks at the events."""

log = logging.getLogger("gaplab.notifications")


class Courier:
    """Delivers notifications in the background for as long as its context lasts; without settings it does nothing.

    What is left is sent by the next courier. Links in messages lead to `page`, the address of the service's page.
    """

    def __init__(self, store: Store, notify: Notify, page: str = "") -> None:
        self._store = store
        self._notify = notify
        self._page = page.rstrip("/")
        self._owner = f"{socket.gethostname()}:{os.getpid()}:{secrets.token_hex(4)}"
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="notifications", daemon=True)

    def __enter__(self) -> Self:
        if self._notify.is_on:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
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
