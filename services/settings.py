"""Settings of the service and limits of the API, read from the environment once by a main."""

from typing import Annotated, Self

from pydantic import Field, PositiveInt, ValidationError
from pydantic_settings import BaseSettings, EnvSettingsSource, PydanticBaseSettingsSource, SettingsConfigDict


class _Environment(BaseSettings):
    """Values that `from_environment` reads; the constructor reads nothing."""

    model_config = SettingsConfigDict(frozen=True, extra="forbid", env_prefix="GAPLAB_", env_ignore_empty=True)

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],  # noqa: ARG003 - the base's signature
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,  # noqa: ARG003
        dotenv_settings: PydanticBaseSettingsSource,  # noqa: ARG003
        file_secret_settings: PydanticBaseSettingsSource,  # noqa: ARG003
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Take values from the constructor's arguments alone."""
        return (init_settings,)

    @classmethod
    def from_environment(cls) -> Self:
        """Return the values that the process was started with; an empty variable is not set.

        Raises:
            ValueError: a value is not permitted; the message names its variable.
        """
        try:
            return cls(**EnvSettingsSource(cls)())
        except ValidationError as error:
            (first, *_) = error.errors()
            variable = f"{cls.model_config['env_prefix']}{first['loc'][0]}".upper()
            msg = f"{variable} is {first['input']!r}; it must be a whole number of at least 1"
            raise ValueError(msg) from error


class Settings(_Environment):
    """Where the database and Ray are, and how the service behaves; nothing here changes a number of a result.

    Attributes:
        database_url: SQLAlchemy URL. `GAPLAB_DATABASE_URL`; `sqlite:///gaplab.db` in the working directory.
        ray_address: of an existing cluster; None starts Ray on this machine. `GAPLAB_RAY_ADDRESS`.
        workers: cores of gaplab's own Ray, or repetitions at once on a cluster; None is all cores. `GAPLAB_WORKERS`.
        lease_s: seconds of silence after which a supervisor's work goes to others. `GAPLAB_LEASE_S`; 30.
        rollout_limit_s: seconds that a rollout may take before its process is ended; a measurement by hardware has no
            limit. `GAPLAB_ROLLOUT_LIMIT_S`; 60.
        step_limit_s: seconds of work that a step may take before its process is ended. `GAPLAB_STEP_LIMIT_S`; a week.
        host: that the API binds. `GAPLAB_HOST`; loopback.
        port: that the API binds. `GAPLAB_PORT`; 8000.
        url: where the command finds the service. `GAPLAB_URL`; host and port.
        token: that the command shows to the service. `GAPLAB_TOKEN`; none.
    """

    database_url: str = "sqlite:///gaplab.db"
    ray_address: str | None = None
    workers: PositiveInt | None = None
    lease_s: PositiveInt = 30
    rollout_limit_s: PositiveInt = 60
    step_limit_s: PositiveInt = 604_800
    host: str = "127.0.0.1"
    port: PositiveInt = 8000
    url: str = Field(default_factory=lambda given: address(given["host"], given["port"]))
    token: Annotated[str | None, Field(repr=False)] = None


class Limits(_Environment):
    """How much the API lets in. Each is `GAPLAB_MAX_…` in the environment: `GAPLAB_MAX_BODY_BYTES` and so on.

    Requests without a token share the limits of one token.

    Attributes:
        body_bytes: of one request.
        iterations: of one experiment.
        repetitions: of one submission, over all experiments of a study.
        experiments_per_token: that have not ended.
        experiments: that have not ended, of all tokens.
        rollouts_per_token: budgeted and not yet done, of experiments that have not ended.
        rollouts: the same, of all tokens.
        streams_per_token: of events, open at once at one API process; a request that waits for events is one.
        streams: the same, of all tokens.
        imported_rows: of one archive. On SQLite other writers wait while they are stored, some seconds for the default.
        requests: served at once by one API process; fewer if it may open fewer than twice as many files.
    """

    model_config = SettingsConfigDict(env_prefix="GAPLAB_MAX_")

    body_bytes: PositiveInt = 1_000_000
    iterations: PositiveInt = 1_000
    repetitions: PositiveInt = 10_000
    experiments_per_token: PositiveInt = 1_000
    experiments: PositiveInt = 5_000
    rollouts_per_token: PositiveInt = 100_000_000_000
    rollouts: PositiveInt = 1_000_000_000_000
    streams_per_token: PositiveInt = 20
    streams: PositiveInt = 200
    imported_rows: PositiveInt = 250_000
    requests: PositiveInt = 1_000


def address(host: str, port: int) -> str:
    """Return the URL of a service that binds this host and port."""
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def variable_of(limit: str) -> str:
    """Return the environment variable that sets the limit."""
    return f"GAPLAB_MAX_{limit.upper()}"
