"""The application: routes, problems, limits and the pages that document them, put together."""

import os
from importlib.metadata import version

from fastapi import Depends, FastAPI
from fastapi.middleware.gzip import GZipMiddleware

from gaplab.api.http import documentation, problems
from gaplab.api.http.access import Access
from gaplab.api.http.dependencies import refuse_doubles
from gaplab.api.http.event_feed import Feed
from gaplab.api.http.limits import BodyLimit, Streams
from gaplab.api.http.metrics import Measured, Metrics
from gaplab.api.http.security_headers import Headers
from gaplab.api.routes import (
    archives,
    catalogue,
    curves,
    dashboard,
    estimates,
    events,
    experiments,
    figures,
    health,
    life_cycle,
    metrics,
    provenance,
    replay_figures,
    replays,
    sensitivity,
    studies,
)
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.settings import Limits, Settings
from gaplab.services.store.session import Store

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
    {"name": "replays", "description": "what controllers do, computed when it is asked for"},
    {"name": "figures", "description": "to look at, and to put into papers"},
    {"name": "events", "description": "what happens to experiments, as it happens"},
    {"name": "archives", "description": "everything of an experiment or a study as one file, and back"},
    {"name": "sensitivity", "description": "what tunables do to fitness, checked before anything is tuned"},
    {"name": "catalogue", "description": "the plug-ins that a spec may name"},
    {"name": "health", "description": "for whoever keeps the service alive"},
]

MODULES = (
    studies,
    estimates,
    experiments,
    life_cycle,
    provenance,
    events,
    curves,
    figures,
    replay_figures,
    archives,
    replays,
    sensitivity,
    catalogue,
    health,
    metrics,
)
"""In the order in which their routes are documented."""


def create_app(store: Store, settings: Settings | None = None, limits: Limits | None = None) -> FastAPI:
    """The application over a database, which it neither migrates nor closes.

    It never touches Ray: it inserts what is asked for and reads what there is.

    Args:
        store: the database.
        settings: of the process that serves; left out where the app is asked within this process.
        limits: left out: as they are by default.
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
    limits = limits or Limits()
    app.state.store, app.state.limits, app.state.streams = store, limits, Streams(limits)
    app.state.feed = Feed(store)
    app.state.rollout_process = RolloutProcess()
    app.state.cores = (settings.workers if settings else None) or os.cpu_count() or 1
    app.state.metrics = Metrics(store, app.state.feed)
    app.add_middleware(GZipMiddleware, minimum_size=20_000, compresslevel=4)
    app.add_middleware(BodyLimit, most_bytes=limits.body_bytes)
    app.add_middleware(Access, settings=settings)
    app.add_middleware(Headers)
    app.add_middleware(Measured, metrics=app.state.metrics)
    problems.install(app)
    for module in MODULES:
        app.include_router(module.router, dependencies=[Depends(refuse_doubles)])
    figures.install(app)
    dashboard.install(app)
    documentation.install(app)
    return app
