"""The JSON of a report: read back, by its schema, and nothing else."""

import json
from typing import Any

import jsonschema
import pytest

from adeye.errors import SpecError
from adeye.report.formats.json import json_schema, parse_json, render_json
from adeye.report.formats.junit import render_junit
from adeye.report.formats.reqif import render_reqif
from adeye.report.formats.sarif import render_sarif
from adeye.report.model.report import Report
from tests.refusals import refused
from tests.report.fake import build_report


def test_reading_back_gives_the_same_report(report: Report) -> None:
    assert parse_json(render_json(report, with_replays=True)) == report


def test_replays_are_left_out_unless_asked_for(report: Report) -> None:
    text = render_json(report)
    assert "replays" not in json.loads(text)
    assert parse_json(text) == report.model_copy(update={"replays": ()})


@pytest.mark.slow
def test_document_follows_its_schema(report: Report) -> None:
    validator = jsonschema.Draft202012Validator(json_schema())
    validator.check_schema(json_schema())
    for with_replays in (False, True):
        document: dict[str, Any] = json.loads(render_json(report, with_replays=with_replays))
        assert document["schema"] == "adeye/report@1"
        validator.validate(document)
    assert not validator.is_valid({**document, "schema": "adeye/report@2"})
    assert not validator.is_valid({**document, "surprise": 1})


def test_what_is_no_report_is_refused() -> None:
    for text, message in (
        ("{", "not JSON"),
        ("[]", "schema 'list'"),
        ('{"schema": "adeye/report@9"}', "adeye/report@9"),
        ('{"schema": "adeye/report@1"}', "does not hold together"),
    ):
        refused(SpecError, parse_json, text, says=message)


@pytest.mark.parametrize("write", [render_json, render_junit, render_reqif, render_sarif])
def test_same_report_gives_the_same_bytes_in_every_form(write: Any) -> None:
    assert write(build_report()) == write(build_report())
