"""What goes wrong between a client and the service."""

import httpx2
from pydantic import ValidationError

from gaplab.schemas.problems import Problem
from gaplab.schemas.records import ExperimentRead, StudyRead


class ServiceError(Exception):
    """The service refused or failed; `problem` is its answer.

    The message is the problem's detail, or a line for each thing that is wrong with what was sent.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        lines = [f"{each.pointer or '(the whole)'}: {each.message}" for each in problem.errors]
        super().__init__("\n".join(lines) if len(lines) > 1 else problem.detail)


class ServiceUnreachable(Exception):
    """Nothing answers at the service's address."""


class ExperimentFailed(Exception):
    """What was waited for did not complete; `ended` is what it ended as, the message says why."""

    def __init__(self, ended: ExperimentRead | StudyRead) -> None:
        self.ended = ended
        parts = ended.experiments if isinstance(ended, StudyRead) else (ended,)
        reasons = sorted({reason for each in parts for reason in each.reasons})
        super().__init__(f"{ended.name} ({ended.id}) ended as {ended.state}" + "".join(f"; {each}" for each in reasons))


class ExtraMissing(ImportError):
    """A library that only some need is not installed; the message is the line that installs it."""

    def __init__(self, library: str, extra: str) -> None:
        super().__init__(f"this needs {library}, which is not installed: pip install 'gaplab[{extra}]'", name=library)


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
