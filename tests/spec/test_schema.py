"""The JSON Schemas are fresh and accept what the package ships."""

from __future__ import annotations

from pathlib import Path

import jsonschema
import pytest

from adeye.spec import schema
from adeye.spec.document import load_document

ROOT = Path(__file__).parents[2]
SHIPPED = [
    *[("odd", path) for path in (ROOT / "odd").glob("*.yaml")],
    *[("architecture", path) for path in (ROOT / "odd" / "architectures").glob("*.yaml")],
    *[("concept", path) for path in (ROOT / "odd" / "concepts").glob("*.yaml")],
    *[("scenario", path) for path in (ROOT / "scenarios_db").rglob("*.yaml")],
]


@pytest.mark.slow
def test_committed_schemas_are_fresh() -> None:
    assert schema.stale(ROOT / "docs" / "schema") == []


@pytest.mark.slow
def test_stale_schema_is_noticed(tmp_path: Path) -> None:
    schema.write(tmp_path)
    assert schema.main(["--check", str(tmp_path)]) == 0
    (tmp_path / "odd.schema.json").write_text("{}", encoding="utf-8")
    assert schema.main(["--check", str(tmp_path)]) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "path"), SHIPPED, ids=[path.stem for _, path in SHIPPED])
def test_shipped_files_fit_their_schema(kind: str, path: Path) -> None:
    jsonschema.validate(load_document(path).value, schema.schema(kind))


@pytest.mark.slow
def test_schema_refuses_an_unknown_key() -> None:
    content = load_document(ROOT / "odd" / "motorway_chauffeur.yaml").value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**content, "sede": 7}, schema.schema("odd"))


@pytest.mark.slow
def test_file_that_extends_another_may_hold_parts_of_its_records() -> None:
    strict = schema.schema("architecture")
    part = {"extends": "a.yaml", "channels": {"nominal": {"links": ["pose"]}}}
    jsonschema.validate(part, strict)
    jsonschema.validate({**part, "sensors": {"eye": None, "ear": {"range": None}}}, strict)
    mistakes: list[dict[str, object]] = [{"channels": {"nominal": {"link": []}}}, {"sensor": {}}]
    for wrong in mistakes:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate({"extends": "a.yaml", **wrong}, strict)
    del part["extends"]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(part, strict)
