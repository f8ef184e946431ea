"""Webhooks of single studies: only to hosts that the owner of the service permits.

Use cases raise NotFound if nothing has the id.
"""

from collections.abc import Collection
from urllib.parse import SplitResult, urlsplit

from gaplab.schemas.notifications import WebhookRead, WebhookSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.store.queries.experiments import lock, whole
from gaplab.services.store.session import Session, snapshot, transaction

_USUAL = {"http": 80, "https": 443}

NONE_PERMITTED = "this service permits no webhooks of studies: its owner lists hosts in GAPLAB_NOTIFY_HOSTS"


@transaction
def set_webhook(session: Session, id_: str, spec: WebhookSpec | None, hosts: Collection[str]) -> WebhookRead:
    """Tell a webhook when all experiments of a study have ended; None tells none any more.

    Raises:
        InvalidSpec: the address is not permitted.
        Conflict: they have ended, so nothing would be sent; or the id is that of one of them.
    """
    found, url = whole(session, id_), spec.url if spec else None
    if url is not None and (why := refusal(url, hosts)):
        raise InvalidSpec([Violation("/url", None, why, sorted(hosts))])  # without the address, which may be secret
    if url is not None and all(state.ended for state in lock(session, found.ids).values()):
        raise Conflict(f"{found.study.name!r} ({id_}) has ended, so nothing would be sent: extend it first")
    found.study.webhook = url
    return _view(url)


@snapshot
def read(session: Session, id_: str) -> WebhookRead:
    """Return the host of the webhook of a study.

    Raises:
        Conflict: the id is that of one of its experiments.
    """
    return _view(whole(session, id_).study.webhook)


def refusal(url: str, hosts: Collection[str]) -> str | None:
    """Return why a user's webhook is not permitted; None if it is.

    Only the exact host permits, with its port, which may be left out if it is the usual one: no wildcards, and no
    redirects are followed.
    """
    try:
        parts = urlsplit(url)
        host, with_port = _host(parts), _host_with_port(parts)
    except ValueError:
        return "it is not an address, like https://hooks.example.org/…"
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        return "it is not an address, like https://hooks.example.org/…"
    if parts.username is not None or parts.password is not None or parts.fragment:
        return "it has a user, a password or a fragment, which webhooks do not have"
    if not hosts:
        return NONE_PERMITTED
    if not {host, with_port} & set(hosts):
        return f"the host {host!r} is not permitted; permitted: {', '.join(sorted(hosts))} (GAPLAB_NOTIFY_HOSTS)"
    return None


def _view(url: str | None) -> WebhookRead:
    return WebhookRead(host=_host(urlsplit(url)) if url else None)


def _host(parts: SplitResult) -> str:
    """Return the host in lower case, with its port unless it is the usual one."""
    return _name(parts) if parts.port in (None, _USUAL.get(parts.scheme)) else _host_with_port(parts)


def _host_with_port(parts: SplitResult) -> str:
    return f"{_name(parts)}:{_USUAL.get(parts.scheme) if parts.port is None else parts.port}"


def _name(parts: SplitResult) -> str:
    name = (parts.hostname or "").lower()
    return f"[{name}]" if ":" in name else name
