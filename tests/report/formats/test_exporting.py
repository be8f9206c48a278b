"""Exports: the same bytes from every database, whole or not at all, never over something else."""

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import duckdb
import pytest

from adeye.errors import UsageError
from adeye.report.formats.tables import CONTENTS, FORMATS, Written, export_campaign
from adeye.store.read.export import TABLES, CampaignExport
from adeye.version import __version__


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("form", FORMATS)
def test_folder_has_every_table_and_says_what_it_is(tmp_path: Path, mini: Any, form: Any) -> None:
    folder = tmp_path / "deep" / "out"
    written = export_campaign(mini.db, None, folder, file_format=form)
    about = json.loads((folder / CONTENTS).read_text("utf-8"))
    assert contents(folder).keys() == {CONTENTS, *(f"{name}.{form}" for name in TABLES)}
    assert about["tool"] == f"adeye {__version__}"
    assert (about["campaign"], about["planned"], about["done"]) == (written.campaign, 28, 28)
    assert written.rows["runs"] == 28
    for name, file in about["files"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == file["sha256"]
        assert written.rows[file["table"]] == file["rows"] > 0
    units = {
        column["name"]: column.get("unit") for column in about["files"][f"runs.{form}"]["columns"]
    }
    assert units["ego_speed_mps"] == "m/s"
    assert units["min_ttc_s"] == "s"
    assert "provenance" not in about
    assert list(folder.parent.iterdir()) == [folder]


@pytest.mark.slow
def test_queries_over_views_run_over_the_files(tmp_path: Path, mini: Any) -> None:
    from adeye.store.read.query import run_query

    export_campaign(mini.db, None, tmp_path / "out")
    for name, table in TABLES.items():
        columns = ", ".join(item.name for item in table.columns if not item.is_provenance)
        order = ", ".join(table.order)
        sql = f"SELECT {columns} FROM {{}} ORDER BY {order}"  # noqa: S608
        stored = run_query(mini.db, sql.format(table.view)).rows
        file = tmp_path / "out" / f"{name}.parquet"
        assert duckdb.execute(sql.format(f"'{file}'")).fetchall() == list(stored)


def test_same_campaign_gives_the_same_bytes(tmp_path: Path, mini: Any) -> None:
    for form in FORMATS:
        export_campaign(mini.db, None, tmp_path / f"a.{form}", tables=["verdicts"])
        export_campaign(mini.db, "1", tmp_path / f"b.{form}", tables=["verdicts"])
        assert (tmp_path / f"a.{form}").read_bytes() == (tmp_path / f"b.{form}").read_bytes()


def test_provenance_is_written_if_asked_for(tmp_path: Path, mini: Any) -> None:
    export_campaign(mini.db, None, tmp_path / "out", file_format="csv", with_provenance=True)
    about = json.loads((tmp_path / "out" / CONTENTS).read_text("utf-8"))
    assert about["provenance"]
    assert about["created_at"]
    assert "executed_at" in (tmp_path / "out" / "runs.csv").read_text("utf-8").partition("\n")[0]


def test_export_takes_the_place_of_the_former_one(tmp_path: Path, mini: Any) -> None:
    folder = tmp_path / "out"
    export_campaign(mini.db, None, folder, file_format="csv", tables=["runs", "events"])
    export_campaign(mini.db, None, folder, file_format="jsonl", tables=["events"])
    assert contents(folder).keys() == {CONTENTS, "events.jsonl"}
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("name", ["out", "runs.csv"])
def test_failure_leaves_what_was_there(
    tmp_path: Path, mini: Any, monkeypatch: pytest.MonkeyPatch, name: str, error: BaseException
) -> None:
    output = tmp_path / name
    export_campaign(mini.db, None, output)
    before = contents(output) if output.is_dir() else output.read_bytes()
    real = CampaignExport.chunks

    def failing(self: CampaignExport) -> Iterator[Any]:
        yield next(real(self))
        raise error

    monkeypatch.setattr(CampaignExport, "chunks", failing)
    with pytest.raises(BaseException, match=r"No space|^$"):
        export_campaign(mini.db, None, output)
    assert (contents(output) if output.is_dir() else output.read_bytes()) == before
    with pytest.raises(BaseException, match=r"No space|^$"):
        export_campaign(mini.db, None, tmp_path / f"new_{name}")
    assert list(tmp_path.iterdir()) == [output]


@pytest.mark.parametrize(
    ("name", "options", "part"),
    [
        ("runs.csv", {"tables": ["runs", "events"]}, "2 tables are asked for"),
        ("runs.csv", {"file_format": "parquet"}, "promises csv"),
        ("theirs", {}, "holds something else"),
        ("mixed", {}, "holds something else"),
        ("file", {}, "without the ending of a table"),
    ],
)
def test_what_an_export_is_not_is_left_alone(
    tmp_path: Path, mini: Any, name: str, options: Any, part: str
) -> None:
    for folder in ("theirs", "mixed"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "thesis.txt").write_text("x", "utf-8")
    (tmp_path / "mixed" / CONTENTS).write_text("{}", "utf-8")
    (tmp_path / "file").write_text("x", "utf-8")
    with pytest.raises(UsageError, match=part):
        export_campaign(mini.db, None, tmp_path / name, **options)
    assert (tmp_path / "theirs" / "thesis.txt").read_text("utf-8") == "x"
    assert (tmp_path / "file").read_text("utf-8") == "x"
    assert not (tmp_path / "runs.csv").exists()


def test_result_says_how_much_is_missing(tmp_path: Path, mini: Any) -> None:
    written = export_campaign(mini.db, None, tmp_path / "out.jsonl", tables=["fsr_status"])
    assert isinstance(written, Written)
    assert (written.planned, written.done, list(written.rows)) == (28, 28, ["fsr_status"])
