"""Forms for other tools: each is written, and a file without a form is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from adeye.errors import UsageError
from adeye.report.formats import GSN_FORMS, check_exports, render_export

if TYPE_CHECKING:
    from adeye.report.model.report import Report


@pytest.mark.parametrize(
    ("form", "name", "begin"),
    [
        ("sarif", "a.sarif", b"{"),
        ("reqif", "a.reqif", b"<?xml"),
        ("gsn", "a.svg", b"<svg"),
        ("gsn", "a.mmd", b"flowchart"),
        ("gsn", "a.json", b"{"),
    ],
)
def test_form_is_that_of_the_file(report: Report, form: str, name: str, begin: bytes) -> None:
    assert render_export(report, form, Path(name)).startswith(begin)


def test_json_of_a_goal_structure_is_not_that_of_sarif(report: Report) -> None:
    assert "nodes" in json.loads(render_export(report, "gsn", Path("a.json")))


@pytest.mark.parametrize("name", ["a.png", "a"])
def test_other_ends_are_refused_with_what_is_allowed(name: str) -> None:
    with pytest.raises(UsageError, match="no form of a goal structure") as error:
        check_exports({"gsn": Path(name)})
    assert all(end in str(error.value) for end in GSN_FORMS)


def test_known_ends_are_taken() -> None:
    for end in GSN_FORMS:
        check_exports({"gsn": Path(f"a{end}"), "sarif": Path("b")})
