"""Webhooks of single studies and experiments: only to hosts that the owner of the service permits."""

from collections.abc import Collection
from urllib.parse import SplitResult, urlsplit

from sqlalchemy import update

from gaplab.schemas.notifications import WebhookRead, WebhookSpec
from gaplab.services.core.errors import Conflict, InvalidSpec, Violation
from gaplab.services.store.models import ExperimentRow, StudyRow
from gaplab.services.store.queries.experiments import experiments_of, get_experiment, get_study, lock
from gaplab.services.store.session import Session, snapshot, transaction

_USUAL = {"http": 80, "https": 443}

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
        Conflict: the experiment has ended, so nothing would be sent.
    """
    return _set(session, get_experiment(session, experiment_id), spec, hosts)


@transaction
def set_study_webhook(session: Session, study_id: str, spec: WebhookSpec | None, hosts: Collection[str]) -> WebhookRead:
    """Tell a webhook when all experiments of a study have ended; None tells none any more.

    Raises:
        NotFound: no such study.
        InvalidSpec: the address is not permitted.
        Conflict: all of its experiments have ended, so nothing would be sent.
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


def _set(
    session: Session, row: ExperimentRow | StudyRow, spec: WebhookSpec | None, hosts: Collection[str]
) -> WebhookRead:
    url = spec.url if spec else None
    if url is not None and (why := refusal(url, hosts)):
        raise InvalidSpec([Violation("/url", None, why, sorted(hosts))])  # without the address, which may be secret
    if url is not None and _has_ended(session, row):
        raise Conflict(f"{row.name!r} ({row.id}) has ended, so nothing would be sent: extend it first")
    table = type(row)
    session.execute(update(table).where(table.id == row.id).values(webhook=url))
    return _view(url)


def _has_ended(session: Session, row: ExperimentRow | StudyRow) -> bool:
    experiments = [row] if isinstance(row, ExperimentRow) else experiments_of(session, [row.id])
    states = lock(session, [experiment.id for experiment in experiments])
    return all(state.ended for state in states.values())


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
