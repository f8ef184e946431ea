"""What Prometheus reads at `/metrics`: requests as they are counted here, and what the database holds."""

from collections.abc import Iterator
from threading import Lock
from time import monotonic, perf_counter

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaplab.api.http.event_feed import Feed
from gaplab.schemas.lifecycle import State
from gaplab.services.core.errors import StoreUnavailable
from gaplab.services.results import totals
from gaplab.services.results.totals import Totals
from gaplab.services.store.session import Store

KEPT_S = 5.0
"""For which what was read from the database is shown again, however often it is asked for."""

BUCKETS_S = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


class Metrics:
    """The metrics of one application.

    Attributes:
        registry: of all of them; applications in one process each have their own.
        requests: by method, route and status.
        seconds: to the first byte of the answer, by method and route.
    """

    def __init__(self, store: Store, feed: Feed) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "gaplab_http_requests", "Answers", ["method", "route", "status"], registry=self.registry
        )
        self.seconds = Histogram(
            "gaplab_http_request_seconds",
            "Seconds to the first byte of an answer",
            ["method", "route"],
            registry=self.registry,
            buckets=BUCKETS_S,
        )
        self.registry.register(_OfTheProcess(store, feed))
        self.registry.register(_OfTheStore(store))


class Measured:
    """Counts each request under the route that answered it; what no route has is one of them, whatever was asked."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, and count it when its answer begins."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began = perf_counter()

        async def counted(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._count(scope, message["status"], perf_counter() - began)
            await send(message)

        await self._app(scope, receive, counted)

    def _count(self, scope: Scope, status: int, seconds: float) -> None:
        method = scope["method"] if scope["method"] in METHODS else "other"
        route = getattr(scope.get("route"), "path", "none")
        self._metrics.requests.labels(method, route, status).inc()
        self._metrics.seconds.labels(method, route).observe(seconds)


METHODS = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}


class _OfTheProcess(Collector):
    """What this process counts beside requests."""

    def __init__(self, store: Store, feed: Feed) -> None:
        self._store = store
        self._feed = feed

    def collect(self) -> Iterator[Metric]:
        """Now."""
        yield GaugeMetricFamily("gaplab_event_streams", "Event streams that are open", value=self._feed.open)
        yield CounterMetricFamily(
            "gaplab_database_errors", "Times that the database could not be used", value=self._store.errors
        )
        yield CounterMetricFamily(
            "gaplab_database_retries", "Transactions that were run anew", value=self._store.retries
        )


class _OfTheStore(Collector):
    """What the database holds; nothing of it while it cannot be used, which `gaplab_database_up` tells."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = Lock()
        self._found: Totals | None = None
        self._read_at = -KEPT_S

    def collect(self) -> Iterator[Metric]:
        """As of at most a few seconds ago."""
        found = self._totals()
        yield GaugeMetricFamily("gaplab_database_up", "Whether the database can be used", value=found is not None)
        if found is None:
            return
        for name, counts in (("experiments", found.experiments), ("repetitions", found.repetitions)):
            family = GaugeMetricFamily(f"gaplab_{name}", f"{name.capitalize()} by state", labels=["state"])
            for state in State:
                family.add_metric([state.value], counts.get(state, 0))
            yield family
        yield GaugeMetricFamily("gaplab_rollouts_queued", "Rollouts still to be done", value=found.rollouts_queued)
        yield CounterMetricFamily("gaplab_rollouts", "Rollouts that are recorded", value=found.rollouts_done)
        yield CounterMetricFamily("gaplab_steps", "Steps that are recorded", value=found.steps)
        yield GaugeMetricFamily(
            "gaplab_supervisors", "Supervisors that did not end in good order", value=len(found.supervisor_ages_s)
        )
        if found.supervisor_ages_s:
            age = min(found.supervisor_ages_s)
            help_ = "Seconds since a supervisor was last heard of"
            yield GaugeMetricFamily("gaplab_supervisor_heartbeat_age_seconds", help_, value=age)

    def _totals(self) -> Totals | None:
        with self._lock:
            if monotonic() - self._read_at >= KEPT_S:
                self._found, self._read_at = self._read(), monotonic()
            return self._found

    def _read(self) -> Totals | None:
        try:
            return totals.read(self._store)
        except StoreUnavailable:
            return None
