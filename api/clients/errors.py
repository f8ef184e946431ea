"""Errors between a client and the service."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from http import HTTPStatus
from importlib import import_module
from pathlib import Path
from typing import Any, Self

import httpx2
from pydantic import ValidationError

from gaplab.schemas.mistakes import Problem
from gaplab.schemas.records import StudyRead


class ServiceError(Exception):
    """The service refused a request or failed; `problem` is its answer.

    The message is the problem's detail, or a line for each mistake in the request. `retry_after_s` says when to try
    again, if the service knows.
    """

    def __init__(self, problem: Problem, retry_after_s: float | None = None) -> None:
        self.problem = problem
        self.retry_after_s = retry_after_s
        super().__init__("\n".join(lines_of(problem)) if len(problem.errors) > 1 else problem.detail)

    def __reduce__(self) -> tuple[type[Self], tuple[Problem, float | None]]:
        """Return the class and the arguments from which a copy of the error is made."""
        return type(self), (self.problem, self.retry_after_s)


class ServiceUnreachable(Exception):
    """No service answers at the address, or none in time."""


class UnknownService(ServiceUnreachable):
    """What answers at the address is not gaplab of this version."""


class ExperimentFailed(Exception):
    """A study ended without completing; `ended` is its last state, the message says why."""

    def __init__(self, ended: StudyRead) -> None:
        self.ended = ended
        reasons = sorted({reason for experiment in ended.experiments for reason in experiment.reasons})
        super().__init__("; ".join([f"{ended.name} ({ended.id}) ended as {ended.state}", *reasons]))

    def __reduce__(self) -> tuple[type[Self], tuple[StudyRead]]:
        """Return the class and the arguments from which a copy of the error is made."""
        return type(self), (self.ended,)


class ExtraMissing(ImportError):
    """A library of an optional extra is not installed; the message has the command that installs it."""

    def __init__(self, library: str, extra: str) -> None:
        self.extra = extra
        super().__init__(f"this needs {library}, which is not installed: pip install 'gaplab[{extra}]'", name=library)

    def __reduce__(self) -> tuple[type[Self], tuple[str, str]]:
        """Return the class and the arguments from which a copy of the error is made."""
        return type(self), (str(self.name), self.extra)


class WrongSuffix(ValueError):
    """The suffix of a file names no format in which it can be written."""


def format_of(file: str | Path, formats: Sequence[str]) -> str:
    """Return the format that the suffix of a file names; raise WrongSuffix if it is not one of these formats."""
    suffix = Path(file).suffix.removeprefix(".").lower()
    if suffix not in formats:
        raise WrongSuffix(f"{file} has another suffix; permitted: {', '.join(f'.{each}' for each in formats)}")
    return suffix


def library(name: str, extra: str) -> Any:  # noqa: ANN401 - a module that may be missing
    """Return a library of an optional extra; raise ExtraMissing if it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise ExtraMissing(name.partition(".")[0], extra) from error


def is_final(error: Exception) -> bool:
    """Return whether a repeated request would fail the same way."""
    if isinstance(error, ServiceError):
        return error.problem.status < 500 and error.problem.status != HTTPStatus.TOO_MANY_REQUESTS
    return isinstance(error, UnknownService)


@contextmanager
def if_found() -> Iterator[None]:
    """End the block at a request for what the service does not have; any other error is raised."""
    try:
        yield
    except ServiceError as error:
        if error.problem.status != HTTPStatus.NOT_FOUND:
            raise


def is_of_gaplab(error: Exception) -> bool:
    """Return whether gaplab itself refused a request, and not a proxy or another service at its address."""
    return isinstance(error, ServiceError) and error.problem.type.startswith("urn:gaplab:")


def refuses_sender(error: ServiceError) -> bool:
    """Return whether the service refused the token, and not what was sent with it."""
    return error.problem.status in {401, 403}


def lines_of(problem: Problem) -> list[str]:
    """Return a problem in words: a line for each mistake in the request, or its detail."""
    return [f"{error.pointer or '(the whole)'}: {error.message}" for error in problem.errors] or [problem.detail]


def error_of(answer: httpx2.Response) -> ServiceError:
    """Return the error for an answer that is not a success; one without a problem does not come from this service."""
    try:
        problem = Problem.model_validate_json(answer.content)
    except ValidationError:
        detail = f"{answer.url} answers {answer.status_code} without a problem document; is it a gaplab service?"
        problem = Problem(type="about:blank", title="Not understood", status=answer.status_code, detail=detail)
    after = answer.headers.get("retry-after", "")
    return ServiceError(problem, float(after) if after.isdecimal() else None)
