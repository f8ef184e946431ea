"""The metrics at `/metrics` for Prometheus: requests of this process, and the contents of the database."""

from collections.abc import Iterator
from threading import Lock
from time import monotonic, perf_counter

from prometheus_client import CollectorRegistry, Counter, Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gaplab.api.http.event_feed import EventFeed
from gaplab.schemas.lifecycle import State
from gaplab.services.store.database_errors import StoreUnavailable
from gaplab.services.store.queries.costs import Totals, totals
from gaplab.services.store.session import Store

CACHED_S = 5.0
"""Least interval between two readings of the database."""

BUCKETS_S = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)
METHODS = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}


class Metrics:
    """The metrics of one application.

    Attributes:
        registry: all metrics; applications in one process have separate registries.
        requests: counted by method, route and status.
        seconds: to the first byte of the answer, by method and route.
    """

    def __init__(self, store: Store, feed: EventFeed) -> None:
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
        self.registry.register(_Present(store, feed))


class RequestCounter:
    """Middleware that counts each request by its route; requests without a route count as route `none`."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request, and count it when its answer begins; what is not a request has no answer."""
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


class _Present(Collector):
    """The present streams of this process, and the contents of the database as long as it answers."""

    def __init__(self, store: Store, feed: EventFeed) -> None:
        self._store = store
        self._feed = feed
        self._lock = Lock()
        self._cached: Totals | None = None
        self._read_at = -CACHED_S

    def collect(self) -> Iterator[Metric]:
        """Yield the present values; those of the database are at most a few seconds old."""
        yield GaugeMetricFamily("gaplab_event_streams", "Open event streams", value=self._feed.open)
        yield CounterMetricFamily("gaplab_database_errors", "Failed uses of the database", value=self._store.errors)
        yield CounterMetricFamily("gaplab_database_retries", "Repeated transactions", value=self._store.retries)
        stored = self._totals()
        yield GaugeMetricFamily("gaplab_database_up", "Whether the database answers", value=stored is not None)
        if stored is None:
            return
        for name, counts in (("experiments", stored.experiments), ("repetitions", stored.repetitions)):
            family = GaugeMetricFamily(f"gaplab_{name}", f"{name.capitalize()} by state", labels=["state"])
            for state in State:
                family.add_metric([state.value], counts.get(state, 0))
            yield family
        yield GaugeMetricFamily("gaplab_rollouts_queued", "Rollouts still to be done", value=stored.rollouts_queued)
        of_stored = "of experiments that are stored: a deletion takes its own away"
        done, steps = f"Recorded rollouts {of_stored}", f"Recorded steps {of_stored}"
        yield GaugeMetricFamily("gaplab_rollouts_done", done, value=stored.rollouts_done)
        yield GaugeMetricFamily("gaplab_steps_done", steps, value=stored.steps)
        ages_s = stored.supervisor_ages_s
        yield GaugeMetricFamily("gaplab_supervisors", "Supervisors that have not ended in order", value=len(ages_s))
        if ages_s:
            about = "Seconds since the latest heartbeat of a supervisor"
            yield GaugeMetricFamily("gaplab_supervisor_heartbeat_age_seconds", about, value=min(ages_s))

    def _totals(self) -> Totals | None:
        with self._lock:
            if monotonic() - self._read_at >= CACHED_S:
                self._cached, self._read_at = self._read(), monotonic()
            return self._cached

    def _read(self) -> Totals | None:
        try:
            with self._store.reading() as session:
                return totals(session)
        except StoreUnavailable:
            return None
