"""Saved views: queries with a name, shared by all users."""

from typing import Annotated

from fastapi import APIRouter, Body

from gaplab.api.http.dependencies import StoreDep
from gaplab.api.http.problems import documented
from gaplab.schemas.keeping import ViewName, ViewRead, ViewSpec
from gaplab.services.experiments import saved_views

router = APIRouter(prefix="/views", tags=["views"])


@router.get("", summary="List the saved views", response_description="By name", responses=documented())
def list_views(store: StoreDep) -> tuple[ViewRead, ...]:
    """List the saved views."""
    return saved_views.list_views(store)


@router.get("/{name}", summary="Read a saved view", responses=documented(404, 422))
def read_view(name: ViewName, store: StoreDep) -> ViewRead:
    """Return a saved view: pass its query as `q`, and its `sort`, to the list that it shows."""
    return saved_views.read_view(store, name)


@router.put(
    "/{name}",
    summary="Save a view",
    response_description="As it is saved",
    responses=documented(413, 415, 422, 429),
)
def save_view(
    name: ViewName, spec: Annotated[ViewSpec, Body(openapi_examples=ViewSpec.EXAMPLES)], store: StoreDep
) -> ViewRead:
    """Save a view under this name, in place of the one that has it. Every runner may replace and delete every view."""
    return saved_views.save_view(store, name, spec)


@router.delete(
    "/{name}", summary="Delete a saved view", response_description="What it was", responses=documented(404, 422)
)
def delete_view(name: ViewName, store: StoreDep) -> ViewRead:
    """Delete a saved view; nothing that it lists is touched."""
    return saved_views.delete_view(store, name)
