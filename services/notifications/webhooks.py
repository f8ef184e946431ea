"""Webhooks of single studies and experiments: only to hosts that the owner of the service permits."""

from collections.abc import Collection
from urllib.parse import SplitResult, urlsplit

from sqlalchemy import update

from gaplab.schemas.notifications import WebhookRead, WebhookSpec
from gaplab.services.core.errors import InvalidSpec, Violation
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.experiments import get_experiment, get_study
from gaplab.services.store.session import Session, snapshot, transaction

NONE_PERMITTED = (
    "this service permits no webhooks of studies and experiments: its owner lists hosts in GAPLAB_NOTIFY_HOSTS"
)


@transaction
def set_experiment_webhook(
    session: Session, experiment_id: str, spec: WebhookSpec | None, hosts: Collection[str]
) -> WebhookRead:
    """Tell a webhook when an experiment has ended; None tells none any more.

    Raises:
        NotFound: no such experiment.
        InvalidSpec: the address is not permitted.
    """
    return _set(session, get_experiment(session, experiment_id), spec, hosts)


@transaction
def set_study_webhook(session: Session, study_id: str, spec: WebhookSpec | None, hosts: Collection[str]) -> WebhookRead:
    """Tell a webhook when all experiments of a study have ended; None tells none any more.

    Raises:
        NotFound: no such study.
        InvalidSpec: the address is not permitted.
    """
    return _set(session, get_study(session, study_id), spec, hosts)


@snapshot
def experiment_webhook(session: Session, experiment_id: str) -> WebhookRead:
    """Return the host of an experiment's webhook.

    Raises:
        NotFound: no such experiment.
    """
    return _view(get_experiment(session, experiment_id).webhook)


@snapshot
def study_webhook(session: Session, study_id: str) -> WebhookRead:
    """Return the host of a study's webhook.

    Raises:
        NotFound: no such study.
    """
    return _view(get_study(session, study_id).webhook)


def refusal(url: str, hosts: Collection[str]) -> str | None:
    """Return why a user's webhook is not permitted; None if it is.

    Only the exact host, with its port unless it is the usual one, permits: no wildcards, and no redirects are followed.
    """
    try:
        parts = urlsplit(url)
        host = _host(parts)
    except ValueError:
        return "it is not an address, like https://hooks.example.org/…"
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        return "it is not an address, like https://hooks.example.org/…"
    if parts.username is not None or parts.password is not None or parts.fragment:
        return "it has a user, a password or a fragment, which webhooks do not have"
    if not hosts:
        return NONE_PERMITTED
    if host not in hosts:
        return f"the host {host!r} is not permitted; permitted: {', '.join(sorted(hosts))} (GAPLAB_NOTIFY_HOSTS)"
    return None


def _set(
    session: Session, row: ExperimentRow | StudyRow, spec: WebhookSpec | None, hosts: Collection[str]
) -> WebhookRead:
    url = spec.url if spec else None
    if url is not None and (why := refusal(url, hosts)):
        raise InvalidSpec([Violation("/url", None, why, sorted(hosts))])  # without the address, which may be secret
    table = type(row)
    session.execute(update(table).where(table.id == row.id).values(webhook=url))
    return _view(url)


def _view(url: str | None) -> WebhookRead:
    return WebhookRead(host=_host(urlsplit(url)) if url else None)


def _host(parts: SplitResult) -> str:
    """Return the host in lower case, with its port unless it is the usual one."""
    usual = {"http": 80, "https": 443}.get(parts.scheme)
    name = (parts.hostname or "").lower()
    shown = f"[{name}]" if ":" in name else name
    return shown if parts.port in (None, usual) else f"{shown}:{parts.port}"
