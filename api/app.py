"""The application: routes, problems, limits and the pages that document them, put together."""

from importlib.metadata import version

from fastapi import FastAPI

from api import documentation, problems
from api.limits import BodyLimit
from api.routes import archives, catalogue, curves, experiments, figures, health, life_cycle, sensitivity, studies
from services.store.session import Store

DESCRIPTION = """
Closes the *reality gap*: tunes a robot simulator from a handful of real-world evaluations, and compares the strategies
that choose them.

Submit a **study** (`POST /studies`), watch it (`GET /studies/{id}`), read its **curves** (`GET /studies/{id}/curves`).
Whatever a spec leaves out is the paper's. Errors are problem details (RFC 9457); those about a spec say where, what is
permitted, and the nearest name.
"""

TAGS = [
    {"name": "studies", "description": "experiments that belong together to be compared"},
    {"name": "experiments", "description": "one strategy under one setting, repeated"},
    {"name": "curves", "description": "recorded fitness against the number of real-world evaluations"},
    {"name": "archives", "description": "everything of an experiment or a study as one file, and back"},
    {"name": "sensitivity", "description": "what tunables do to fitness, checked before anything is tuned"},
    {"name": "catalogue", "description": "the plug-ins that a spec may name"},
    {"name": "health", "description": "for whoever keeps the service alive"},
]


def create_app(store: Store) -> FastAPI:
    """The application over a database, which it neither migrates nor closes.

    It never touches Ray: it inserts what is asked for and reads what there is.
    """
    app = FastAPI(
        title="gaplab",
        version=version("gaplab"),
        description=DESCRIPTION,
        openapi_tags=TAGS,
        docs_url=None,
        redoc_url=None,
        generate_unique_id_function=lambda route: route.name,
        license_info={"name": "MIT", "identifier": "MIT"},
    )
    app.state.store = store
    app.add_middleware(BodyLimit)
    problems.install(app)
    for module in (studies, experiments, life_cycle, curves, figures, archives, sensitivity, catalogue, health):
        app.include_router(module.router)
    documentation.install(app)
    return app
