"""The application: routes, problems, limits and documentation, put together."""

import asyncio
import os
from importlib.metadata import version

from fastapi import Depends, FastAPI
from fastapi.middleware.gzip import GZipMiddleware

from gaplab.api.http import documentation, problems
from gaplab.api.http.access import Access
from gaplab.api.http.dependencies import WRITERS, take_place
from gaplab.api.http.event_feed import EventFeed
from gaplab.api.http.limits import SPARE, BodyLimit, RequestLimit, Streams, most_requests
from gaplab.api.http.metrics import Metrics, RequestCounter
from gaplab.api.http.security_headers import SecurityHeaders
from gaplab.api.routes import (
    bench,
    catalogue,
    curves,
    dashboard,
    events,
    experiments,
    figures,
    health,
    keeping,
    replays,
    reports,
    studies,
)
from gaplab.services.replay.process import RolloutProcess
from gaplab.services.settings import Limits, Notify, Settings
from gaplab.services.store.session import Store
from gaplab.services.waiting_line import WaitingLine

DESCRIPTION = """
Closes the *reality gap*: tunes a robot simulator from a handful of real-world evaluations, and compares the strategies
that choose them.

Submit a **study** (`POST /studies`), follow it (`GET /studies/{id}`), read its **curves** (`GET /curves?study={id}`).
`POST /experiments` submits one experiment, which is a study of one. Where an id is that of a study, that of one of its
experiments means that one alone. Whatever a spec leaves out has the paper's value. Errors are problem details
(RFC 9457); for an invalid spec they name each place, what is permitted there, and the nearest valid name.
"""

TAGS = [
    {"name": "studies", "description": "experiments to be compared, or one alone"},
    {"name": "experiments", "description": "one strategy with one set of settings, repeated"},
    {"name": "bench", "description": "measurements of a robot on a bench: requests, takes, answers, corrections"},
    {"name": "views", "description": "saved queries of lists"},
    {"name": "curves", "description": "recorded fitness against the number of real-world evaluations"},
    {"name": "replays", "description": "the motion of controllers, computed on request"},
    {"name": "figures", "description": "for the browser, for notebooks and for papers"},
    {"name": "reports", "description": "one document with figures, tables, tests and a verdict in words"},
    {"name": "events", "description": "what happens to experiments, as it happens"},
    {"name": "archives", "description": "a study with everything in it as one file"},
    {"name": "sensitivity", "description": "the effect of each tunable on fitness, checked before tuning"},
    {"name": "catalogue", "description": "the plug-ins that a spec may name"},
    {"name": "health", "description": "for monitoring the service"},
]

ROUTERS = (
    *(studies.router, experiments.router, bench.router, keeping.router, keeping.view_router, events.router),
    *(curves.router, figures.router, reports.router, keeping.archive_router, replays.router),
    *(experiments.check_router, catalogue.router, health.router),
)
"""The parts of the API, in the order of the documentation."""


def create_app(
    store: Store, settings: Settings | None = None, limits: Limits | None = None, notify: Notify | None = None
) -> FastAPI:
    """Return the application over a database, which it neither migrates nor closes; it needs no Ray.

    A program that calls the app directly leaves out the settings.
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
    app.state.connections = most_requests(limits) + SPARE
    app.state.feed, app.state.notify = EventFeed(store), notify or Notify()
    app.state.rollout_process, app.state.exports = RolloutProcess(), WaitingLine("exports")
    app.state.writers = asyncio.Semaphore(WRITERS)
    app.state.cores = (settings.workers if settings else None) or os.cpu_count() or 1
    app.state.metrics = Metrics(store, app.state.feed)
    app.add_middleware(GZipMiddleware, minimum_size=20_000, compresslevel=4)
    app.add_middleware(BodyLimit, most_bytes=limits.body_bytes)
    app.add_middleware(Access, settings=settings)
    app.add_middleware(dashboard.BrowserRedirect)
    app.add_middleware(RequestLimit, most=most_requests(limits))
    app.add_middleware(SecurityHeaders)
    app.add_middleware(RequestCounter, metrics=app.state.metrics)
    problems.install(app)
    for router in ROUTERS:
        app.include_router(router, dependencies=[Depends(take_place)])
    figures.install(app)
    dashboard.install(app)
    documentation.install(app)
    return app
