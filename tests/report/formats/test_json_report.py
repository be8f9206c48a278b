import json
from typing import Any

import jsonschema
import pytest

from adeye.errors import SpecError
from adeye.report.formats.json import json_schema, parse_json, render_json
from adeye.report.model.report import Report


def test_reading_back_gives_the_same_report(report: Report) -> None:
    assert parse_json(render_json(report, with_replays=True)) == report


def test_replays_are_left_out_unless_asked_for(report: Report) -> None:
    text = render_json(report)
    assert "replays" not in json.loads(text)
    assert parse_json(text) == report.model_copy(update={"replays": ()})


@pytest.mark.slow
@pytest.mark.parametrize("with_replays", [False, True])
def test_document_follows_its_schema(report: Report, *, with_replays: bool) -> None:
    document = json.loads(render_json(report, with_replays=with_replays))
    assert document["schema"] == "adeye/report@1"
    jsonschema.Draft202012Validator.check_schema(json_schema())
    jsonschema.Draft202012Validator(json_schema()).validate(document)


def test_schema_refuses_another_version_and_an_unknown_key(report: Report) -> None:
    document: dict[str, Any] = json.loads(render_json(report))
    validator = jsonschema.Draft202012Validator(json_schema())
    assert not validator.is_valid({**document, "schema": "adeye/report@2"})
    assert not validator.is_valid({**document, "surprise": 1})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ("[]", "schema 'list'"),
        ('{"schema": "adeye/report@9"}', "adeye/report@9"),
        ('{"schema": "adeye/report@1"}', "does not hold together"),
    ],
)
def test_what_is_no_report_is_refused(text: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        parse_json(text)


def test_same_report_gives_the_same_text(report: Report) -> None:
    assert render_json(report) == render_json(report)
