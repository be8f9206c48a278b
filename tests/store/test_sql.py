"""The files of SQL: each view has its own."""

from pathlib import Path

from adeye.store import sql
from adeye.store.views import view_ddl

FOLDER = Path(sql.__file__).parent
WRITTEN = {"v_check"}
"""Views that are put together from the others."""
SCENARIO = "v_runs_scenario"
"""What the views of the scenarios are made from."""


def test_every_view_has_a_file_and_every_file_a_view() -> None:
    files = {path.stem for path in FOLDER.glob("v_*.sql")}
    assert files == {*view_ddl()} - WRITTEN | {SCENARIO}


def test_file_creates_the_view_of_its_name() -> None:
    for path in FOLDER.glob("v_*.sql"):
        name = "$view" if path.stem == SCENARIO else path.stem
        assert sql.statement(path.stem).startswith(f"CREATE VIEW {name} AS\n")


def test_nothing_of_the_files_is_left_to_fill_in_or_to_explain() -> None:
    for ddl in view_ddl().values():
        assert "-- " not in ddl
        assert "$" not in ddl.replace("'$.", "")
