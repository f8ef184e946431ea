"""What the environment may say, read once by a main."""

import os
from dataclasses import dataclass, field, fields


@dataclass(frozen=True)
class Settings:
    """Where the database and Ray are, and how the service behaves; nothing here changes a number of a result.

    Attributes:
        database_url: SQLAlchemy URL. `GAPLAB_DATABASE_URL`; `sqlite:///gaplab.db` in the working directory.
        ray_address: of an existing cluster; None starts Ray on this machine. `GAPLAB_RAY_ADDRESS`.
        workers: cores of gaplab's own Ray, or repetitions at once on a cluster; None is all cores. `GAPLAB_WORKERS`.
        lease_s: seconds for which a supervisor may be silent before its work goes to others. `GAPLAB_LEASE_S`; 30.
        host: that the API binds. `GAPLAB_HOST`; loopback.
        port: that the API binds. `GAPLAB_PORT`; 8000.
        url: where the command finds the service. `GAPLAB_URL`; host and port.
        token: that the command shows to the service. `GAPLAB_TOKEN`; none.
    """

    database_url: str = "sqlite:///gaplab.db"
    ray_address: str | None = None
    workers: int | None = None
    lease_s: int = 30
    host: str = "127.0.0.1"
    port: int = 8000
    url: str = "http://127.0.0.1:8000"
    token: str | None = field(default=None, repr=False)

    @classmethod
    def from_environment(cls) -> "Settings":
        """The settings that the process was started with.

        Raises:
            ValueError: a number that is none, with the name of its variable.
        """
        get = os.environ.get
        host, port = get("GAPLAB_HOST") or cls.host, _number("GAPLAB_PORT", None) or cls.port
        return cls(
            database_url=get("GAPLAB_DATABASE_URL") or cls.database_url,
            ray_address=get("GAPLAB_RAY_ADDRESS") or None,
            workers=_number("GAPLAB_WORKERS", None),
            lease_s=_number("GAPLAB_LEASE_S", None) or cls.lease_s,
            host=host,
            port=port,
            url=get("GAPLAB_URL") or address(host, port),
            token=get("GAPLAB_TOKEN") or None,
        )


@dataclass(frozen=True)
class Limits:
    """How much the API lets in. Each is `GAPLAB_MAX_…` in the environment: `GAPLAB_MAX_BODY_BYTES` and so on.

    What is said of a token holds as well for all who need none, taken together.

    Attributes:
        body_bytes: of one request.
        iterations: of one experiment.
        repetitions: of one submission: of all experiments of a study together.
        experiments_per_token: that have not ended.
        experiments: that have not ended, of all.
        rollouts_per_token: budgeted and not yet done, of experiments that have not ended.
        rollouts: the same, of all.
        streams_per_token: of events, open at once at one API process; a request that waits for events is one.
        streams: the same, of all.
    """

    body_bytes: int = 1_000_000
    iterations: int = 1_000
    repetitions: int = 10_000
    experiments_per_token: int = 1_000
    experiments: int = 5_000
    rollouts_per_token: int = 100_000_000_000
    rollouts: int = 1_000_000_000_000
    streams_per_token: int = 20
    streams: int = 200

    @classmethod
    def from_environment(cls) -> "Limits":
        """The limits that the process was started with.

        Raises:
            ValueError: a number that is none, with the name of its variable.
        """
        defaults = cls()
        names = [each.name for each in fields(cls)]
        return cls(**{name: _number(variable_of(name), None) or getattr(defaults, name) for name in names})


def address(host: str, port: int) -> str:
    """Where what binds these is found."""
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def variable_of(limit: str) -> str:
    """The variable of the environment that sets the limit."""
    return f"GAPLAB_MAX_{limit.upper()}"


def _number(variable: str, default: int | None) -> int | None:
    text = os.environ.get(variable)
    if not text:
        return default
    if not text.isdecimal() or int(text) < 1:
        msg = f"{variable} is {text!r}; it must be a whole number of at least 1"
        raise ValueError(msg)
    return int(text)
