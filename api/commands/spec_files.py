"""Spec files."""

import json
import sys
from pathlib import Path
from typing import Any, NoReturn

from gaplab.api.commands.exit_codes import CommandError, Exit


def read_spec(name: str) -> dict[str, Any]:
    """Return the spec in a JSON file, or in standard input if the name is "-".

    Raises:
        CommandError: the file cannot be read, or does not hold a JSON object.
    """
    try:
        text = sys.stdin.read() if name == "-" else Path(name).read_text("utf-8")
        spec = json.loads(text, parse_constant=_refuse)
    except OSError as error:
        msg = f"{name}: {error.strerror or error}"
        raise CommandError(msg, Exit.FILE) from error
    except (ValueError, RecursionError) as error:
        msg = f"{name} is not JSON: {error}"
        raise CommandError(msg, Exit.FILE) from error
    if not isinstance(spec, dict):
        msg = f'{name} holds no JSON object; write one, like {{"strategy": "simulated_fit"}}'
        raise CommandError(msg, Exit.FILE)
    return spec


def _refuse(constant: str) -> NoReturn:
    msg = f"JSON has no {constant}; use a number or null"
    raise ValueError(msg)
