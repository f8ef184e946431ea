"""The plug-ins that a spec may name."""

from fastapi import APIRouter

from api.problems import documented
from schemas.plugin import Catalogue
from services.catalogue import catalogue

router = APIRouter(tags=["catalogue"])


@router.get("/catalogue", summary="List the plug-ins", responses=documented())
def read_catalogue() -> Catalogue:
    """Every strategy, robot, engine, tunable and optimizer, with its source and the JSON Schema of its options."""
    return catalogue()
