"""Settings of the service and limits of the API. Each process reads them from the environment once, at its start."""

import os
import shlex
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PositiveInt, ValidationError

_ADDRESS = r"^https?://[^/\s]+\S*$"

_WITHIN = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}  # noqa: S104 - nothing is bound here
"""Loopback by the wildcard host that includes it."""


class InvalidSetting(ValueError):
    """An environment variable has a value that is not permitted; the message names both.

    Attributes:
        variable: its name.
    """

    def __init__(self, variable: str, reason: str) -> None:
        self.variable = variable
        super().__init__(f"{variable} {reason}")


class _Environment(BaseModel):
    """Values that `from_environment` reads; the variable of each is its name after `prefix`, in upper case."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)

    prefix: ClassVar[str] = "GAPLAB_"

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> Self:
        """Return the values of an environment, by default the process's; an empty variable counts as not set.

        Raises:
            InvalidSetting: a value is not permitted; the message names its variable.
        """
        given = {name.upper(): value for name, value in environment.items() if value}
        known: dict[str, Any] = {name: given.get(cls.variable_of(name)) for name in cls.model_fields}
        try:
            return cls(**{name: value for name, value in known.items() if value is not None})
        except ValidationError as error:
            (first, *_) = error.errors()
            name = str(first["loc"][0])
            raise InvalidSetting(cls.variable_of(name), cls._expectation(name, first["input"])) from error

    @classmethod
    def variable_of(cls, name: str) -> str:
        """Return the environment variable of a field."""
        return f"{cls.prefix}{name}".upper()

    @classmethod
    def _expectation(cls, name: str, given: object) -> str:  # noqa: ARG003 - for subclasses
        """Return what is wrong with a value, and what is permitted."""
        return f"is {given!r}; it must be a whole number of at least 1"


class Settings(_Environment):
    """Settings of the service; none of them changes a number of a result.

    Attributes:
        database_url: SQLAlchemy URL. `GAPLAB_DATABASE_URL`; `sqlite:///gaplab.db` in the working directory.
        ray_address: address of an existing cluster; None starts Ray on this machine. `GAPLAB_RAY_ADDRESS`.
        workers: cores of gaplab's own Ray, or repetitions at once on a cluster; None is all cores. `GAPLAB_WORKERS`.
        lease_s: seconds of silence after which a supervisor's work goes to others. `GAPLAB_LEASE_S`; 30.
        rollout_limit_s: seconds for each of 100 rollouts, unless hardware measures. `GAPLAB_ROLLOUT_LIMIT_S`; 60.
        step_limit_s: seconds of work that a step may take. `GAPLAB_STEP_LIMIT_S`; a week.
        host: host that the API binds. `GAPLAB_HOST`; loopback.
        port: port that the API binds. `GAPLAB_PORT`; 8000.
        url: address of the service, for the command and for links in notifications. `GAPLAB_URL`; host and port.
        token: token that the command sends to the service. `GAPLAB_TOKEN`; none.
    """

    database_url: str = "sqlite:///gaplab.db"
    ray_address: str | None = None
    workers: PositiveInt | None = None
    lease_s: PositiveInt = 30
    rollout_limit_s: PositiveInt = 60
    step_limit_s: PositiveInt = 604_800
    host: str = "127.0.0.1"
    port: PositiveInt = 8000
    url: str = Field(pattern=_ADDRESS, default_factory=lambda given: own_address(given["host"], given["port"]))
    token: Annotated[str | None, Field(repr=False)] = None

    def bound(self, host: str | None, port: int | None) -> Self:
        """Return the settings with another host or port, if given; the URL follows unless it was set."""
        given: dict[str, Any] = {
            "host": self.host if host is None else host,
            "port": self.port if port is None else port,
        }
        if "url" not in self.model_fields_set:
            given["url"] = own_address(**given)
        return self.model_copy(update=given)

    @classmethod
    def _expectation(cls, name: str, given: object) -> str:
        """Return what is wrong with a value, and what is permitted."""
        if name == "url":
            return f"is {given!r}; it must be an http or https address, like http://127.0.0.1:8000"
        return super()._expectation(name, given)


class Limits(_Environment):
    """Limits of the API. Each is `GAPLAB_MAX_…` in the environment: `GAPLAB_MAX_BODY_BYTES` and so on.

    Requests without a token share the limits of one token.

    Attributes:
        body_bytes: bytes of one request.
        iterations: iterations of one experiment.
        repetitions: repetitions of one submission, over all experiments of a study.
        unconfirmed_core_hours: expected core-hours of a submission or an extension that does not confirm its cost.
        experiments_per_token: experiments of one token that have not ended.
        experiments: experiments of all tokens that have not ended.
        rollouts_per_token: remaining rollouts of one token, in experiments that have not ended.
        rollouts: remaining rollouts of all tokens, in experiments that have not ended.
        streams_per_token: open event streams of one token in one API process, including requests that wait for events.
        streams: open event streams of all tokens in one API process.
        imported_rows: rows of one imported archive. On SQLite other writers wait some seconds for as many.
        requests: requests that one API process serves at once; fewer if it may open fewer than twice as many files.
        unnamed_attachment_bytes: bytes of all files beside measurements that no answer names.
    """

    prefix: ClassVar[str] = "GAPLAB_MAX_"

    body_bytes: PositiveInt = 1_000_000
    iterations: PositiveInt = 1_000
    repetitions: PositiveInt = 10_000
    unconfirmed_core_hours: PositiveInt = 1_000
    experiments_per_token: PositiveInt = 1_000
    experiments: PositiveInt = 5_000
    rollouts_per_token: PositiveInt = 100_000_000_000
    rollouts: PositiveInt = 1_000_000_000_000
    streams_per_token: PositiveInt = 20
    streams: PositiveInt = 200
    imported_rows: PositiveInt = 50_000
    requests: PositiveInt = 1_000
    unnamed_attachment_bytes: PositiveInt = 1_000_000_000


def _command_line(text: str) -> str:
    if not shlex.split(text):
        raise ValueError("the command line is empty")
    return text


class Notify(_Environment):
    """Who is told that work has ended: settings of the service's owner, which no request can change.

    Attributes:
        url: webhook that is told of every study. `GAPLAB_NOTIFY_URL`.
        command: command line that is run for the same, without a shell. `GAPLAB_NOTIFY_COMMAND`.
        secret: key of the signature of webhooks. `GAPLAB_NOTIFY_SECRET`.
        hosts: hosts that webhooks of single studies may have, separated by commas; others are refused.
            `GAPLAB_NOTIFY_HOSTS`; none.
    """

    prefix: ClassVar[str] = "GAPLAB_NOTIFY_"

    url: Annotated[str | None, Field(pattern=_ADDRESS, repr=False)] = None
    command: Annotated[Annotated[str, AfterValidator(_command_line)] | None, Field(repr=False)] = None
    secret: Annotated[str | None, Field(repr=False)] = None
    hosts: Annotated[str, Field(pattern=r"^[A-Za-z0-9.:,\[\]\s-]*$")] = ""

    @classmethod
    def _expectation(cls, name: str, given: object) -> str:
        """Return what is permitted, without the value, which may be secret."""
        if name == "command":
            return "is not a command line: it must name a program, and close its quotes"
        return "is not an http or https address" if name == "url" else f"is {given!r}; it must be hosts, with commas"

    @property
    def permitted_hosts(self) -> frozenset[str]:
        """Return the hosts that users' webhooks may have, in lower case."""
        return frozenset(host.strip().lower() for host in self.hosts.split(",") if host.strip())

    @property
    def is_on(self) -> bool:
        """Return whether anything can be told."""
        return bool(self.url or self.command or self.permitted_hosts)


def address(host: str, port: int) -> str:
    """Return the URL of a service that binds this host and port."""
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def own_address(host: str, port: int) -> str:
    """Return the URL at which this machine reaches a service that binds the host, which may be a wildcard."""
    return address(_WITHIN.get(host, host), port)


variable_of = Limits.variable_of
"""Returns the environment variable that sets a limit."""
