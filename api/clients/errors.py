"""What goes wrong between a client and the service."""

import httpx2
from pydantic import ValidationError

from schemas.problems import Problem


class ServiceError(Exception):
    """The service refused or failed; `problem` is its answer, and the message is the problem's detail."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        super().__init__(problem.detail)


class ServiceUnreachable(Exception):
    """Nothing answers at the service's address."""


def is_for_good(error: Exception) -> bool:
    """Whether asking again would end the same."""
    return isinstance(error, ServiceError) and error.problem.status < 500


def problem_of(answer: httpx2.Response) -> Problem:
    """The problem in an answer; one that carries none comes from something else than this service."""
    try:
        return Problem.model_validate_json(answer.content)
    except ValidationError:
        detail = f"{answer.url} answers {answer.status_code} and no problem; is it a gaplab?"
        return Problem(type="about:blank", title="Not understood", status=answer.status_code, detail=detail)
