"""Webhooks of single studies and experiments, which are told when these have ended."""

from typing import Annotated

from fastapi import APIRouter, Body

from gaplab.api.http.dependencies import Id, StoreDep, of_app
from gaplab.api.http.problems import documented
from gaplab.schemas.notifications import WebhookRead, WebhookSpec
from gaplab.services.notifications import webhooks
from gaplab.services.settings import Notify

_experiment = APIRouter(prefix="/experiments/{id}/webhook", tags=["experiments"])
_study = APIRouter(prefix="/studies/{id}/webhook", tags=["studies"])


NotifyDep = Annotated[Notify, of_app("notify")]
Spec = Annotated[WebhookSpec, Body(openapi_examples=WebhookSpec.EXAMPLES)]


@_experiment.get("", summary="Read an experiment's webhook", responses=documented(404))
def read_experiment_webhook(id: Id, store: StoreDep) -> WebhookRead:
    """Return the host that is told when the experiment has ended, without the rest of the address."""
    return webhooks.read(store, "experiment", id)


@_experiment.put("", summary="Set an experiment's webhook", responses=documented(404, 409, 413, 415, 422))
def set_experiment_webhook(id: Id, spec: Spec, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Send a POST to this address when the experiment has ended; `GAPLAB_NOTIFY_HOSTS` lists the permitted hosts."""
    return webhooks.set_webhook(store, "experiment", id, spec, notify.permitted_hosts)


@_experiment.delete("", summary="Remove an experiment's webhook", responses=documented(404))
def drop_experiment_webhook(id: Id, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Tell no webhook of its own when the experiment has ended."""
    return webhooks.set_webhook(store, "experiment", id, None, notify.permitted_hosts)


@_study.get("", summary="Read a study's webhook", responses=documented(404))
def read_study_webhook(id: Id, store: StoreDep) -> WebhookRead:
    """Return the host that is told when all experiments of the study have ended, without the rest of the address."""
    return webhooks.read(store, "study", id)


@_study.put("", summary="Set a study's webhook", responses=documented(404, 409, 413, 415, 422))
def set_study_webhook(id: Id, spec: Spec, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Send a POST to this address when all experiments of the study have ended, as `GAPLAB_NOTIFY_HOSTS` permits."""
    return webhooks.set_webhook(store, "study", id, spec, notify.permitted_hosts)


@_study.delete("", summary="Remove a study's webhook", responses=documented(404))
def drop_study_webhook(id: Id, store: StoreDep, notify: NotifyDep) -> WebhookRead:
    """Tell no webhook of its own when the study has ended."""
    return webhooks.set_webhook(store, "study", id, None, notify.permitted_hosts)


router = APIRouter(routes=_experiment.routes + _study.routes)
