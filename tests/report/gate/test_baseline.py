"""The file of a baseline: small, sorted, one line a result, and found out when it was edited."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pydantic import ValidationError

from adeye.errors import IntegrityError, SpecError
from adeye.report.gate.baseline import (
    SCHEMA,
    Baseline,
    baseline_text,
    json_schema,
    read_baseline,
    write_baseline,
)
from tests.report.fake_baseline import BRAKING, GATE, baseline


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_baseline(baseline(), tmp_path / "b.json")
    return tmp_path / "b.json"


def test_what_is_written_is_read(path: Path) -> None:
    assert read_baseline(path) == baseline()


def test_same_campaign_has_the_same_bytes(path: Path) -> None:
    assert path.read_text("utf-8") == baseline_text(baseline())


def test_one_result_that_changes_is_one_line_of_its_test_case() -> None:
    before = baseline_text(baseline()).splitlines()
    after = baseline_text(baseline(margins={("FSR-1", GATE, BRAKING, 2): 1.5})).splitlines()
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert len(changed) == 2
    assert '"margins": [1.5' in changed[0][1]
    assert '"digest"' in changed[1][1]


def test_document_follows_its_schema(path: Path) -> None:
    document, schema = json.loads(path.read_text("utf-8")), json_schema()
    assert document["schema"] == SCHEMA == schema["properties"]["schema"]["const"]
    assert set(document) == set(schema["required"])
    assert set(schema["properties"]) - set(document) == {"channel_failures"}


def test_only_a_gate_that_allows_failures_of_channels_is_written_so(tmp_path: Path) -> None:
    written = baseline(channel_failures="allow")
    write_baseline(written, tmp_path / "b.json")
    assert read_baseline(tmp_path / "b.json") == written


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
        read_baseline(path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "this is no baseline"),
        (b"[]", "its schema is 'list'"),
        (b'{"schema": "adeye/report@1"}', "its schema is 'adeye/report@1'"),
        (b'{"a": 1,\n "a": 2}', "'a' is there twice"),
        (b'{"a": NaN}', "NaN is no number"),
        (b'{"schema":\n "adeye', "b.json:2:"),
        (b"\xff\xfe", "this is no baseline"),
        (b"[" * 100_000, "this is no baseline"),
    ],
)
def test_what_is_no_baseline_is_refused(path: Path, content: bytes, said: str) -> None:
    path.write_bytes(content)
    with pytest.raises(SpecError) as caught:
        read_baseline(path)
    assert said in str(caught.value)
    assert "b.json:" in str(caught.value)


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="there is no such baseline"):
        read_baseline(tmp_path / "none.json")
    with pytest.raises(SpecError, match="a folder, not a file"):
        read_baseline(tmp_path)


def test_baseline_with_a_right_digest_and_a_wrong_content_is_refused(path: Path) -> None:
    text = baseline_text(Baseline.model_construct(**{**dict(baseline()), "planned": -1}))
    path.write_text(text, "utf-8")
    with pytest.raises(SpecError, match="planned"):
        read_baseline(path)


def test_record_refuses_what_does_not_hold_together() -> None:
    with pytest.raises(ValidationError, match="16 of 99 test cases"):
        baseline(planned=99)
    with pytest.raises(ValidationError, match="not listed"):
        baseline(architectures={})
    parts = baseline().cases
    assert parts is not None
    twice = parts[0].model_dump() | {"rows": [*parts[0].rows, parts[0].rows[0]]}
    with pytest.raises(ValidationError, match="there twice"):
        type(parts[0]).model_validate(twice)
