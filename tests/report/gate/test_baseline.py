"""The file of a baseline: small, sorted, one line a result, and found out when it was edited."""

import json
from pathlib import Path

import pytest
from pydantic import ValidationError

from adeye.errors import IntegrityError, SpecError
from adeye.report.gate import baseline as stored_baseline
from tests.refusals import refused
from tests.report.fake_baseline import BRAKING, GATE, baseline
from tests.stored import known


@pytest.fixture
def path(tmp_path: Path) -> Path:
    stored_baseline.write_baseline(baseline(), tmp_path / "b.json")
    return tmp_path / "b.json"


def test_what_is_written_is_read_and_the_same_campaign_has_the_same_bytes(path: Path) -> None:
    assert stored_baseline.read_baseline(path) == baseline()
    assert path.read_text("utf-8") == stored_baseline.baseline_text(baseline())
    # Only a gate that allows failures of channels, or sets contacts aside, is written so.
    written = baseline(channel_failures="allow", preventable_by=("cc",), uncertainty=20)
    stored_baseline.write_baseline(written, path.with_name("c.json"))
    assert stored_baseline.read_baseline(path.with_name("c.json")) == written


def test_one_result_that_changes_is_one_line_of_its_test_case() -> None:
    before = stored_baseline.baseline_text(baseline()).splitlines()
    after = stored_baseline.baseline_text(
        baseline(margins={("FSR-1", GATE, BRAKING, 2): 1.5})
    ).splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert len(changed) == 2
    assert '"margins": [1.5' in changed[0][1]
    assert '"digest"' in changed[1][1]


def test_document_follows_its_schema(path: Path) -> None:
    document, schema = json.loads(path.read_text("utf-8")), stored_baseline.json_schema()
    assert document["schema"] == stored_baseline.SCHEMA == schema["properties"]["schema"]["const"]
    assert set(document) == set(schema["required"])
    unwritten = {"channel_failures", "preventable_by", "uncertainty", "attributes", "tolerance"}
    assert set(schema["properties"]) - set(document) == unwritten


@pytest.mark.parametrize(
    ("old", "new"),
    [('"PPP"', '"FPP"'), ('"mandatory": true', '"mandatory": false'), ("[1.0,", "[9.0,"),
     ('"full_factorial"', '"random"'), ('"gate": ["candidate"]', '"gate": ["legacy"]')],
)  # fmt: skip
def test_edited_baseline_is_found_out(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")
    with pytest.raises(IntegrityError, match="was edited after it was written"):
        stored_baseline.read_baseline(path)


def test_what_is_no_baseline_is_refused(path: Path) -> None:
    for content, said in (
        (b"", "this is no baseline"),
        (b"[]", "its schema is 'list'"),
        (b'{"schema": "adeye/report@1"}', "its schema is 'adeye/report@1'"),
        (b'{"a": 1,\n "a": 2}', "'a' is there twice"),
        (b'{"a": NaN}', "NaN is no number"),
        (b'{"schema":\n "adeye', "b.json:2:"),
        (b"\xff\xfe", "this is no baseline"),
        (b"[" * 100_000, "this is no baseline"),
    ):
        path.write_bytes(content)
        caught = refused(SpecError, stored_baseline.read_baseline, path, says=said)
        assert "b.json:" in str(caught)


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="there is no such baseline"):
        stored_baseline.read_baseline(tmp_path / "none.json")
    refused(SpecError, stored_baseline.read_baseline, tmp_path, says="a folder, not a file")


def test_baseline_with_a_right_digest_and_a_wrong_content_is_refused(path: Path) -> None:
    text = stored_baseline.baseline_text(
        stored_baseline.Baseline.model_construct(**{**dict(baseline()), "planned": -1})
    )
    path.write_text(text, "utf-8")
    refused(SpecError, stored_baseline.read_baseline, path, says="planned")


def test_record_refuses_what_does_not_hold_together() -> None:
    refused(ValidationError, baseline, planned=99, says="16 of 99 test cases")
    refused(ValidationError, baseline, architectures={}, says="not listed")
    parts = known(baseline().cases)
    twice = parts[0].model_dump() | {"rows": [*parts[0].rows, parts[0].rows[0]]}
    refused(ValidationError, type(parts[0]).model_validate, twice, says="there twice")
