"""TypeScript declarations of the service's JSON, which the type check of the page's scripts reads."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gaplab.api.app import create_app
from gaplab.services.store.session import Store

FILE = Path(__file__).parents[1] / "api" / "dashboard" / "types" / "api.d.ts"
MADE = "/* Made by `make docs` from the OpenAPI document; what is changed here is lost. */"
TYPES = {"integer": "number", "number": "number", "string": "string", "boolean": "boolean", "null": "null"}


def declarations() -> str:
    """Return a namespace `Api` with one type for each schema of the OpenAPI document.

    Every field is declared as present, since answers leave none out.
    """
    schemas = create_app(Store("sqlite://")).openapi()["components"]["schemas"]
    body = "\n".join(_declaration(name, schema) for name, schema in sorted(schemas.items()))
    return f"{MADE}\n\ndeclare namespace Api {{\n{body}\n}}\n"


def _declaration(name: str, schema: Mapping[str, Any]) -> str:
    if "properties" not in schema:
        return f"  type {name} = {_type(schema)};"
    fields = "".join(f"    {field}: {_type(value)};\n" for field, value in schema["properties"].items())
    return f"  interface {name} {{\n{fields}  }}"


def _type(schema: Mapping[str, Any]) -> str:
    """Return the type of a schema; a part that has no schema of its own may be anything."""
    if "$ref" in schema:
        return str(schema["$ref"]).rpartition("/")[2]
    if "anyOf" in schema:
        return " | ".join(dict.fromkeys(_type(option) for option in schema["anyOf"]))
    if "enum" in schema:
        return " | ".join(json.dumps(value) for value in schema["enum"])
    if schema.get("type") == "array":
        return _array(schema)
    if schema.get("type") == "object":
        values = schema.get("additionalProperties")
        return f"Record<string, {_type(values) if isinstance(values, Mapping) else 'any'}>"
    return TYPES.get(schema.get("type", ""), "any")


def _array(schema: Mapping[str, Any]) -> str:
    if "prefixItems" in schema:
        return f"[{', '.join(_type(item) for item in schema['prefixItems'])}]"
    return f"Array<{_type(schema.get('items', {}))}>"
