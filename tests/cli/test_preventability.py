"""``adeye preventability``: the table, the findings, and what it refuses."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from adeye.cli.app import app

if TYPE_CHECKING:
    from pathlib import Path

    from tests.project import Executed


@pytest.fixture(scope="module")
def db(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> str:
    copy: Path = tmp_path_factory.mktemp("preventability") / "adeye.db"
    shutil.copyfile(mini.db, copy)
    return str(copy)


def test_findings_are_listed_with_their_commands(db: str) -> None:
    done = CliRunner().invoke(app, ["preventability", "--db", db, "--model", "cc,rss"])
    assert done.exit_code == 0, done.output
    assert "Only the model" in done.output
    assert "findings, avoided by the model only:" in done.output
    assert done.output.count("adeye replay ") == 2
    assert "without faults" in done.output


def test_json_has_every_run(db: str) -> None:
    done = CliRunner().invoke(app, ["preventability", "1", "--db", db, "--all", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["edition"] == "r157-01"
    assert len(found["comparisons"]) == found["executed"] == found["looked_at"]["cc"] == 28
    cells = [item["cell"] for item in found["comparisons"]]
    assert "only_model" in cells
    assert "unknown" not in cells


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--model", "rrs"], "rss"),
        (["--edition", "r157-1"], "r157-01"),
        (["--threshold", "4"], "unit"),
        (["ffff0000"], "there is none"),
    ],
)
def test_bad_input_is_refused(db: str, options: list[str], text: str) -> None:
    from adeye.cli.entry import main_with

    done = CliRunner().invoke(app, ["preventability", "--db", db, *options])
    assert done.exit_code != 0
    assert text in str(done.exception) + str(getattr(done.exception, "remedy", ""))
