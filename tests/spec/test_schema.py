"""The JSON Schemas are fresh and accept what the package ships."""

from functools import cache
from pathlib import Path
from typing import Any

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


@cache
def validator(kind: str) -> Any:
    content = schema.schema(kind)
    made = jsonschema.validators.validator_for(content)
    made.check_schema(content)
    return made(content)


# They name every default and every bound of what users write.
@pytest.mark.parametrize("kind", schema.KINDS)
def test_committed_schema_is_fresh(kind: str) -> None:
    written = (ROOT / "docs" / "schema" / f"{kind}.schema.json").read_text("utf-8")
    assert schema.schema_text(kind) == written


@pytest.mark.slow
def test_stale_schema_is_noticed(tmp_path: Path) -> None:
    schema.write(tmp_path)
    assert schema.main(["--check", str(tmp_path)]) == 0
    (tmp_path / "odd.schema.json").write_text("{}", encoding="utf-8")
    assert schema.main(["--check", str(tmp_path)]) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "path"), SHIPPED, ids=[path.stem for _, path in SHIPPED])
def test_shipped_files_fit_their_schema(kind: str, path: Path) -> None:
    validator(kind).validate(load_document(path).value)


def test_schema_refuses_an_unknown_key() -> None:
    content = load_document(ROOT / "odd" / "motorway_chauffeur.yaml").value
    assert not validator("odd").is_valid({**content, "sede": 7})


@pytest.mark.slow
def test_file_that_extends_another_may_hold_parts_of_its_records() -> None:
    fits = validator("architecture").is_valid
    part: dict[str, Any] = {"channels": {"nominal": {"links": ["pose"]}}}
    for whole, is_right in (
        (part, True),
        ({**part, "sensors": {"eye": None, "ear": {"range": None}}}, True),
        ({"channels": {"nominal": {"link": []}}}, False),
        ({"sensor": {}}, False),
    ):
        assert fits({"extends": "a.yaml", **whole}) is is_right, whole
    assert not fits(part)
