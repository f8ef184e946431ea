"""Exit codes of the `gaplab` command, for scripts."""

from enum import IntEnum
from typing import Self

from gaplab.api.clients.confirmation import NotSubmitted
from gaplab.api.clients.errors import ExperimentFailed, ExtraMissing, ServiceError, ServiceUnreachable, WrongSuffix
from gaplab.api.process.errors import CommandError as CommandError
from gaplab.services.core.errors import GaplabError, InvalidArchive, InvalidSpec, NotFound


class Exit(IntEnum):
    """The exit codes of `gaplab`, with the meaning of each."""

    meaning: str

    def __new__(cls, code: int, meaning: str) -> Self:
        """Return a code with its meaning."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.meaning = meaning
        return member

    OK = 0, "done"
    FAILED = 1, "the service or a watched experiment failed"
    USAGE = 2, "wrong use of the command"
    UNREACHABLE = 3, "no service answers"
    NOT_FOUND = 4, "unknown id or name"
    INVALID = 5, "invalid spec or request"
    CONFLICT = 6, "the state of the experiment, or a limit of the service, forbids it now"
    FILE = 7, "a file cannot be read or written, or is not JSON"
    DENIED = 8, "no token, or one that does not permit it"
    INTERRUPTED = 130, "interrupted"


BY_STATUS = (
    dict.fromkeys((401, 403), Exit.DENIED)
    | dict.fromkeys((404,), Exit.NOT_FOUND)
    | dict.fromkeys((409, 412, 429), Exit.CONFLICT)
    | dict.fromkeys((413, 415, 422, 428), Exit.INVALID)
)

BY_ERROR: dict[type[Exception], Exit] = {
    NotSubmitted: Exit.INTERRUPTED,
    ServiceUnreachable: Exit.UNREACHABLE,
    NotFound: Exit.NOT_FOUND,
    InvalidSpec: Exit.INVALID,
    InvalidArchive: Exit.INVALID,
    WrongSuffix: Exit.USAGE,
    **dict.fromkeys((GaplabError, ExperimentFailed, ExtraMissing, ValueError), Exit.FAILED),
    OSError: Exit.FILE,
}
"""The first kind that an error is of has its code."""

TOLD: tuple[type[Exception], ...] = (ServiceError, CommandError, *BY_ERROR)
"""Errors that end a command with a sentence; any other is a mistake of gaplab."""


def code_of(error: Exception) -> int:
    """Return the exit code for an error of the service, or of what a command does without it."""
    if isinstance(error, CommandError):
        return error.code
    if isinstance(error, ServiceError):
        return BY_STATUS.get(error.problem.status, Exit.FAILED)
    return next(code for kind, code in BY_ERROR.items() if isinstance(error, kind))
