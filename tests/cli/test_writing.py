"""Files that verbs write: what they may be called, what they must not be, and how they fail."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from adeye.cli.writing import keep_apart, named, named_page, write_rows
from adeye.errors import PlatformError, UsageError

TRACE = "time,gap\n0,9\n0.1,5\n0.2,3\n"
CASES = "ego_speed_mps,other_speed_mps,gap_m,lateral_speed_mps\n16,8,30,1\n"


def test_a_name_that_begins_with_a_dash_is_refused() -> None:
    with pytest.raises(UsageError, match="'--quiet' stands where"):
        named(Path("--quiet"))
    assert named(Path("a-b.csv")) == Path("a-b.csv")
    assert named(None) is None


@pytest.mark.parametrize("name", ["x.pdf", "x", "x.html.gz", "-.html"])
def test_a_page_ends_in_html(name: str) -> None:
    with pytest.raises(UsageError):
        named_page(Path(name))


@pytest.mark.parametrize("name", ["x.html", "a/X.HTM"])
def test_a_page_may_be_called(name: str) -> None:
    assert named_page(Path(name)) == Path(name)
    assert named_page(None) is None


def test_only_what_is_read_is_kept(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("x", "utf-8")
    (tmp_path / "b").write_text("x", "utf-8")
    keep_apart(tmp_path / "b", tmp_path / "a", None, tmp_path / "gone")
    with pytest.raises(UsageError, match="overwritten"):
        keep_apart(tmp_path / "b", None, tmp_path / "a", tmp_path / "b")


def test_rows_that_cannot_be_written_leave_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "new" / "rows.csv"
    write_rows(("a", "b"), [(1, None)], path)
    assert path.read_text("utf-8") == "a,b\n1,\n"

    def full(_: int) -> None:
        raise OSError(27, "File too large")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(PlatformError, match="File too large"):
        write_rows(("a", "b"), [(2, 2)], path)
    assert path.read_text("utf-8") == "a,b\n1,\n"


@pytest.mark.parametrize("way", ["same", "./same", "link", "hard"])
@pytest.mark.parametrize(
    ("verb", "text"), [(("stl", "always(gap > 2)"), TRACE), (("reference",), CASES)]
)
def test_no_verb_writes_over_its_input(
    adeye: Any, folder: Path, verb: tuple[str, ...], text: str, way: str
) -> None:
    table = folder / "same"
    table.write_text(text, "utf-8")
    (folder / "link").symlink_to(table)
    os.link(table, folder / "hard")
    done = adeye(*verb, "same", "-o", way)
    assert done.code == 2
    assert "would be overwritten" in done.err
    assert table.read_text("utf-8") == text


def test_findings_are_not_written_over_the_files_that_are_checked(adeye: Any, folder: Path) -> None:
    (folder / "odd.yaml").write_text("odd: x\n", "utf-8")
    done = adeye("check", "odd.yaml", "--sarif", "odd.yaml")
    assert (done.code, "would be overwritten" in done.err) == (2, True)
    (folder / "base.json").write_text("{}", "utf-8")
    done = adeye("gate", "--baseline", "base.json", "--junit", "base.json")
    assert (done.code, "would be overwritten" in done.err) == (2, True)


@pytest.mark.parametrize(
    ("verb", "text"), [(("stl", "always(gap > 2)"), TRACE), (("reference",), CASES)]
)
def test_failing_disk_is_no_input_error_and_a_missing_folder_is_made(
    adeye: Any, folder: Path, verb: tuple[str, ...], text: str
) -> None:
    (folder / "table.csv").write_text(text, "utf-8")
    assert adeye(*verb, "table.csv", "-o", "made/below/x.csv").code == 0
    assert (folder / "made" / "below" / "x.csv").read_text("utf-8").count("\n") == text.count("\n")
    done = adeye(*verb, "table.csv", "-o", "table.csv/x.csv")
    assert done.code == 5
    assert "PlatformError: cannot write" in done.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("report", "1", "--json", "--quiet"), "'--quiet' stands where"),
        (("report", "1", "-o", "x.pdf"), "'x.pdf' does not end in .html"),
        (("compare", "--html", "x.txt"), "'x.txt' does not end in .html"),
        (("stl", "a", "b.csv", "-o", "--json"), "'--json' stands where"),
    ],
)
def test_names_are_refused_before_anything_is_done(
    adeye: Any, folder: Path, arguments: tuple[str, ...], said: str
) -> None:
    done = adeye(*arguments)
    assert done.code == 2
    assert said in done.err
    assert list(folder.iterdir()) == []
