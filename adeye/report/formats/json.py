"""The machine twin of a report: versioned JSON and its schema."""

from __future__ import annotations

import json
from typing import Any

from pydantic import ValidationError

from adeye.errors import SpecError
from adeye.report.model.report import SCHEMA, Report


def render_json(report: Report, *, with_replays: bool = False) -> str:
    """Write a report as JSON, the same text for the same report.

    Args:
        report: The report.
        with_replays: Whether to write the embedded runs too, tick by tick. They can be had again
            from the commands of the worst cases, and are left out by default.

    Returns:
        A JSON object whose ``schema`` is ``adeye/report@1``, with a final newline.
    """
    content = report.model_dump(mode="json", exclude=None if with_replays else {"replays"})
    document = {"schema": SCHEMA, **content}
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def parse_json(text: str) -> Report:
    """Read a report back from its JSON.

    Raises:
        SpecError: It is not JSON, of another schema, or does not hold together.
    """
    try:
        document: Any = json.loads(text)
    except ValueError as error:
        raise SpecError(f"the report is not JSON: {error}", remedy="Write it again.") from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise SpecError(
            f"the report has schema {found!r}, and {SCHEMA!r} can be read",
            remedy="Write it again with this version.",
        )
    content = {key: value for key, value in document.items() if key != "schema"}
    try:
        return Report.model_validate(content)
    except ValidationError as error:
        raise SpecError(
            f"the report does not hold together: {error}", remedy="Write it again."
        ) from error


def json_schema() -> dict[str, Any]:
    """Describe the JSON of a report as JSON Schema (draft 2020-12)."""
    schema = Report.model_json_schema(mode="serialization")
    schema["properties"] = {"schema": {"const": SCHEMA}, **schema["properties"]}
    schema["required"] = ["schema", *(name for name in schema["required"] if name != "replays")]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
