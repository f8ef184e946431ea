"""How the command ends when it cannot do what it was asked: a sentence, and a number for scripts."""

from enum import IntEnum

from gaplab.api.clients.client import ServiceError, ServiceUnreachable
from gaplab.api.process.errors import CommandError as CommandError


class Exit(IntEnum):
    """The exit codes of `gaplab`; 2 is a wrong use of the command itself."""

    OK = 0
    FAILED = 1
    USAGE = 2
    UNREACHABLE = 3
    NOT_FOUND = 4
    INVALID = 5
    CONFLICT = 6
    FILE = 7
    DENIED = 8
    INTERRUPTED = 130


MEANINGS = {
    Exit.OK: "done",
    Exit.FAILED: "the service or what was watched failed",
    Exit.USAGE: "wrong use of the command",
    Exit.UNREACHABLE: "no service answers",
    Exit.NOT_FOUND: "no such id",
    Exit.INVALID: "invalid spec or request",
    Exit.CONFLICT: "its state, or all that is under way, forbids it now",
    Exit.FILE: "a file cannot be read or written, or is not JSON",
    Exit.DENIED: "the token does not permit it, or there is none",
    Exit.INTERRUPTED: "interrupted",
}

EXPLAINED = f"Exit codes: {'; '.join(f'{code.value} {meaning}' for code, meaning in MEANINGS.items())}."

BY_STATUS = {
    401: Exit.DENIED,
    403: Exit.DENIED,
    404: Exit.NOT_FOUND,
    409: Exit.CONFLICT,
    412: Exit.CONFLICT,
    413: Exit.INVALID,
    415: Exit.INVALID,
    422: Exit.INVALID,
    428: Exit.INVALID,
    429: Exit.CONFLICT,
}


def code_of(error: ServiceError | ServiceUnreachable | CommandError) -> Exit:
    """The exit code that tells a script what happened."""
    if isinstance(error, CommandError):
        return Exit(error.code)
    if isinstance(error, ServiceUnreachable):
        return Exit.UNREACHABLE
    return BY_STATUS.get(error.problem.status, Exit.FAILED)
