"""The error that ends a command."""


class CommandError(Exception):
    """The command cannot go on; the message is one readable sentence.

    Attributes:
        code: the exit code for the shell.
    """

    def __init__(self, message: str, code: int = 1) -> None:
        self.code = code
        super().__init__(message)
