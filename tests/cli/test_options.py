"""What options share: help, completion, times, and the files that verbs write."""

from __future__ import annotations

import json
import math
import os
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_type_hints
from unittest.mock import Mock

import pytest
import typer
import yaml

from adeye.cli import options
from adeye.cli.app import app
from adeye.errors import IntegrityError, PlatformError, UsageError
from adeye.store.read import query
from tests.project import CANDIDATE, CONCEPT, Executed
from tests.sql import alter
from tests.stored import stored

# --- help texts from docstrings and examples; what ends a verb that was not foreseen


def verb() -> None:
    """Do a thing.

    A long paragraph that
    is wrapped in the source.

    Exit codes: 0.

    Parameters:
        a: What it is: short.
        b: Another, which is
            long.

    Examples:
        adeye verb
        adeye verb --a 1
            --b 2
    """


def test_docstring_is_the_help() -> None:
    texts = options.texts_of(verb)
    paragraphs = [
        "Do a thing.",
        "A long paragraph that is wrapped in the source.",
        "Exit codes: 0.",
    ]
    assert texts.help.split("\n\n") == paragraphs
    assert texts.parameters == {"a": "What it is: short.", "b": "Another, which is long."}
    assert texts.examples == ["adeye verb", "adeye verb --a 1 --b 2"]
    assert options.examples("adeye a", "adeye b") == "Examples:\n  adeye a\n  adeye b"


def leaves() -> None:
    """Leave as code from outside may."""
    raise SystemExit(0)


def test_process_that_is_asked_to_end_from_outside_did_not_succeed() -> None:
    app = typer.Typer()
    options.add(app, leaves)
    with pytest.raises(IntegrityError, match="asked to end the process with 0"):
        typer.main.get_command(app).main([], standalone_mode=False)


def breaks(db: Path) -> None:
    """Break after everything was read."""
    raise KeyError(str(db))


@pytest.mark.parametrize(
    ("alteration", "blamed"),
    [("SELECT 1", KeyError), ("UPDATE metric SET contact_time_s = 99.0", IntegrityError)],
)
def test_verb_that_breaks_blames_an_altered_database(
    tmp_path: Path, mini: Executed, alteration: str, blamed: type[Exception]
) -> None:
    path = shutil.copyfile(mini.db, tmp_path / "a.db")
    alter(path, alteration)
    app = typer.Typer()
    options.add(app, breaks)
    with pytest.raises(blamed):
        typer.main.get_command(app).main([str(path)], standalone_mode=False)


# --- what TAB offers; errors offer nothing


def context(**params: Any) -> Any:
    return SimpleNamespace(params=params)


@pytest.mark.usefixtures("folder")
def test_scenarios_of_the_shipped_catalogue_and_queries_that_begin_so() -> None:
    assert ("cut_in", "motorway") in options.complete_scenarios(context(), "cut")
    for complete, begun, name in (
        (options.complete_scenarios, "lead", "lead_braking"),
        (options.complete_queries, "worst", "worst-runs"),
    ):
        assert [offer for offer, _ in complete(context(), begun)] == [name]


def test_runs_and_campaigns_come_from_the_database(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Any, str]] = []

    def run_query(db: Any, sql: str, **_options: Any) -> query.QueryResult:
        asked.append((db, sql))
        return query.QueryResult(("a", "b"), (("abcd", "cut_in\x1b x"), (7, "first")), is_cut=False)

    monkeypatch.setattr(query, "run_query", run_query)
    assert options.complete_runs(context(db="x.db"), "ab") == [("abcd", "cut_in x")]
    assert options.complete_runs(context(db="x.db"), "a'b' --") == []
    assert options.complete_campaigns(context(), "7") == [("7", "first")]
    assert asked[0][0] == "x.db"
    assert "LIKE 'ab%'" in asked[1][1]  # quotes do not reach the statement


@pytest.mark.parametrize("complete", [options.complete_runs, options.complete_campaigns])
def test_no_database_offers_nothing_and_makes_none(folder: Path, complete: Any) -> None:
    assert complete(context(), "") == []
    assert list(folder.iterdir()) == []


# --- options of a session: times, and what cannot be read


def test_times_of_people() -> None:
    known = {"8h": 28_800, "30s": 30, "1d": 86_400, "1h1m1s": 3_661}
    known |= dict.fromkeys(("90m", "90min", "1h30m", "1 h 30 min", "1.5 h"), 5_400)
    assert {text: options.seconds(text, "--budget") for text in known} == known


def test_what_is_no_time_is_refused() -> None:
    wrong = ("", "8", "h", "8 hours", "0s", "-1h", "1e3s", "nan", "1h30", "1hm", "inf", "8h!")
    for text in wrong:
        with pytest.raises(UsageError, match=r"--budget is.*such as 8h"):
            options.seconds(text, "--budget")


def test_nothing_given_leaves_nothing_out() -> None:
    names = ("shard", "keyword", "maxfail", "budget", "deadline")
    session = options.make_session(**dict.fromkeys(names), last_failed=False)
    assert session.choice.is_everything
    assert (session.limits.budget_s, session.limits.most_failures) == (math.inf, None)


def test_what_cannot_be_read_is_an_input_error_before_anything_runs(adeye: Any) -> None:
    wrong = {"--shard": "4/3", "-k": "a b", "--budget": "long", "--deadline": "0s"}
    for option, value in wrong.items():
        said = adeye("run", "none.yaml", option, value).refused
        assert option in said
        assert "none.yaml" not in said


# --- files that verbs write: what they may be called, what they must not be, and how they fail


ODD = "odd/tested.yaml"
TRACE = "time,gap\n0,9\n0.1,5\n0.2,3\n"
CASES = "ego_speed_mps,other_speed_mps,gap_m,lateral_speed_mps\n16,8,30,1\n"


def test_a_name_that_begins_with_a_dash_is_refused() -> None:
    with pytest.raises(UsageError, match="'--quiet' stands where"):
        options.named(Path("--quiet"))
    assert options.named(Path("a-b.csv")) == Path("a-b.csv")
    assert options.named(None) is None


def test_a_page_ends_in_html() -> None:
    for name in ("x.pdf", "x", "x.html.gz", "-.html"):
        with pytest.raises(UsageError):
            options.named_page(Path(name))
    for name in ("x.html", "a/X.HTM"):
        assert options.named_page(Path(name)) == Path(name)
    assert options.named_page(None) is None


def test_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "new" / "rows.csv"
    options.write_rows(("a", "b"), [(1, None)], path)
    assert path.read_text("utf-8") == "a,b\n1,\n"

    monkeypatch.setattr(os, "fsync", Mock(side_effect=OSError(27, "File too large")))
    with pytest.raises(PlatformError, match="File too large"):
        options.write_rows(("a", "b"), [(2, 2)], path)
    assert path.read_text("utf-8") == "a,b\n1,\n"


@pytest.mark.parametrize("way", ["same", "./same", "link", "hard"])
@pytest.mark.parametrize(
    ("verb", "text"), [(("stl", "always(gap > 2)"), TRACE), (("reference",), CASES)]
)
def test_input_is_not_overwritten(
    adeye: Any, folder: Path, verb: tuple[str, ...], text: str, way: str
) -> None:
    table = folder / "same"
    table.write_text(text, "utf-8")
    (folder / "link").symlink_to(table)
    os.link(table, folder / "hard")
    assert "would be overwritten" in adeye(*verb, "same", "-o", way).refused
    assert table.read_text("utf-8") == text


def test_findings_are_not_written_over_the_files_that_are_checked(adeye: Any, folder: Path) -> None:
    for name, arguments in (
        ("odd.yaml", ("check", "odd.yaml", "--sarif")),
        ("base.json", ("gate", "--baseline", "base.json", "--junit")),
    ):
        (folder / name).write_text("{}", "utf-8")
        assert "would be overwritten" in adeye(*arguments, name).refused


@pytest.mark.slow
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


def test_names_are_refused_before_anything_is_done(adeye: Any, folder: Path) -> None:
    for arguments, said in (
        (("report", "1", "--report-json", "--quiet"), "'--quiet' stands where"),
        (("report", "1", "-o", "x.pdf"), "'x.pdf' does not end in .html"),
        (("compare", "--html", "x.txt"), "'x.txt' does not end in .html"),
        (("stl", "a", "b.csv", "-o", "--json"), "'--json' stands where"),
    ):
        assert said in adeye(*arguments).refused
        assert list(folder.iterdir()) == []


WRITING: dict[str, list[str]] = stored("verbs")["writing"]
"""How the verb of each option that names a file to write is called."""
ENDINGS = {"--report": ".html", "--html": ".html", "--gsn": ".svg"}


def test_every_option_that_names_a_file_to_write_is_among_these() -> None:
    checks = (options.named, options.named_anew, options.named_page, options.named_place)

    def written(command: Any, verb: str) -> set[str]:
        if hasattr(command, "commands"):
            parts = command.commands.items()
            return {item for name, part in parts for item in written(part, f"{verb} {name}")}
        hints = get_type_hints(command.callback, include_extras=True)
        return {
            f"{verb} --{name.replace('_', '-')}".strip()
            for name, hint in hints.items()
            for item in getattr(hint, "__metadata__", ())
            if getattr(item, "callback", None) in checks
        }

    assert written(typer.main.get_command(app), "") == set(WRITING)


@pytest.fixture
def project(folder: Path, mini: Executed, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(mini.project.folder / "odd", folder / "odd")
    shutil.copytree(mini.project.folder / "scenarios_db", folder / "scenarios_db")
    shutil.copy(mini.db, folder / "x.db")
    (folder / "table.csv").write_text("time,gap\n0,9\n0.1,5\n", "utf-8")
    monkeypatch.setenv("ADEYE_DB", "x.db")
    return folder


def output(option: str, project: Path, target: str) -> str:
    """Name a file as an option asks for it: by a link, if it has to end otherwise."""
    verb, _, flag = option.rpartition(" ")
    ending = ".html" if (verb, flag) == ("report", "--output") else ENDINGS.get(flag, "")
    if verb in {"query", "export"}:
        ending = ".csv"
    if not ending:
        return target
    link = project / f"link{ending}"
    link.symlink_to(target)
    return link.name


def refused(adeye: Any, project: Path, option: str, target: str) -> None:
    """Call a verb that is to write over a file, and see that it does not."""
    flag = option.rpartition(" ")[2]
    before = (project / target).read_bytes()
    words = ["00000" if word == "RUN" else word for word in WRITING[option]]
    done = adeye(*words, flag, output(option, project, target))
    assert (done.code, "would be overwritten" in done.err) == (2, True), (option, target, done.err)
    assert (project / target).read_bytes() == before


@pytest.mark.parametrize("option", WRITING)
def test_no_verb_writes_over_a_database(adeye: Any, project: Path, option: str) -> None:
    refused(adeye, project, option, "x.db")


@pytest.mark.parametrize("option", ["run --junit", "report --reqif", "gate --junit"])
@pytest.mark.parametrize("target", ["x.db-wal", "x.db-shm", "x.traces/a.npz", "selftest.json"])
def test_nothing_is_written_beside_a_database(
    adeye: Any, project: Path, option: str, target: str
) -> None:
    (project / "x.traces").mkdir()
    (project / target).touch()
    refused(adeye, project, option, target)


@pytest.mark.parametrize(
    "option", ["run --sarif", "report --output", "gate --junit", "check --sarif"]
)
def test_no_verb_writes_over_what_was_planned(adeye: Any, project: Path, option: str) -> None:
    (cut_in,) = project.glob("scenarios_db/**/cut_in.yaml")
    for target in (ODD, CONCEPT, CANDIDATE, str(cut_in.relative_to(project))):
        refused(adeye, project, option, target)
        for link in project.glob("link*"):
            link.unlink()


def test_input_of_a_campaign_is_known_from_another_folder_and_after_an_edit(
    adeye: Any, project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned = project / "odd" / "mine.json"
    content = yaml.safe_load((project / ODD).read_text("utf-8"))
    planned.write_text(json.dumps({**content, "odd": "mine"}), "utf-8")
    assert adeye("run", "odd/mine.json").code == 0
    elsewhere = project / "elsewhere"
    elsewhere.mkdir()
    shutil.copy(planned, elsewhere / "copy.json")
    monkeypatch.chdir(elsewhere)
    monkeypatch.setenv("ADEYE_DB", "../x.db")
    refused(adeye, elsewhere, "report --report-json", "../odd/mine.json")
    refused(adeye, elsewhere, "report --report-json", "copy.json")
    planned.write_text('{"odd": "nothing that can be planned"}', "utf-8")
    refused(adeye, elsewhere, "report --report-json", "../odd/mine.json")
    # An empty file, and one of that name in no such folder, is anybody's.
    for name in ("empty.json", "mine.json"):
        (elsewhere / name).touch()
        assert adeye("report", "--report-json", name).code == 0


@pytest.mark.parametrize(
    ("files", "said"),
    [
        *(
            (("x.xml", "--report-json", way), "are one file")
            for way in ("./x.xml", "odd/../x.xml", "link.xml", "X.XML")
        ),
        *(
            ((name,), "belongs to the database")
            for name in ("new.db", "./new.db", "new.db-journal")
        ),
        (("odd",), "'odd' is a folder"),
    ],
)
def test_file_that_cannot_be_one_of_its_own_is_refused_before_the_run(
    adeye: Any, project: Path, files: tuple[str, ...], said: str
) -> None:
    (project / "link.xml").symlink_to("x.xml")
    assert said in adeye("run", ODD, "--db", "new.db", "--junit", *files).refused
    assert not (project / "new.db").exists()


READ_BESIDE = [
    ("gate --junit", "--baseline NEW --update"),
    ("gate --junit", "--baseline NEW"),
    ("report --sarif", "--baseline NEW"),
    ("manifest write --output", "--sign NEW"),
    ("manifest write --output", "--file table.csv --file NEW"),
    ("run --report-json", "NEW"),
]
"""Options that name a file to write, and what else of their verb names one."""


@pytest.mark.parametrize(("option", "other"), READ_BESIDE)
@pytest.mark.parametrize("way", ["new.json", "./new.json", "odd/../new.json", "NEW.JSON"])
def test_what_is_written_is_no_other_file_that_is_named_there_or_not(
    adeye: Any, project: Path, option: str, other: str, way: str
) -> None:
    verb, _, flag = option.rpartition(" ")
    before = {path: path.read_bytes() for path in project.rglob("*") if path.is_file()}
    words = other.replace("NEW", "new.json").split()
    done = adeye(*verb.split(), *words, flag, way)
    assert "are one file" in done.refused
    assert {path: path.read_bytes() for path in project.rglob("*") if path.is_file()} == before


@pytest.mark.slow
def test_baseline_is_renewed_and_no_database_is_one(adeye: Any, project: Path) -> None:
    for _ in range(2):
        assert adeye("gate", "--baseline", "b.json", "--update").code == 0
    done = adeye("gate", "--baseline", "x.db", "--update")
    assert (done.code, (project / "x.db").read_bytes()[:6]) == (2, b"SQLite")


@pytest.mark.parametrize("name", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_standard_output_is_written_to(adeye: Any, project: Path, name: str) -> None:
    done = adeye("query", "SELECT 1 AS one", "-o", "to.csv").ok
    (project / "link.csv").symlink_to(name)
    done = adeye("query", "SELECT 1 AS one", "-o", "link.csv")
    assert (done.code, done.out) == (0, "one\n1\n")
    assert (project / "link.csv").is_symlink()


def test_export_makes_no_folder_that_is_called_like_a_file(adeye: Any, project: Path) -> None:
    assert ".parquet, .csv" in adeye("export", "-o", "runs.xlsx").refused
    assert not (project / "runs.xlsx").exists()
    assert adeye("export", "-f", "csv", "-o", "runs.24").code == 0
    assert (project / "runs.24" / "runs.csv").is_file()


def test_cells_that_a_spreadsheet_would_obey_are_text(adeye: Any, folder: Path) -> None:
    (folder / "cases.csv").write_text(CASES.replace("\n", ",=note\n", 1).replace("1\n", "1,=1+1\n"))
    assert adeye("reference", "cases.csv", "-o", "out.csv").code == 0
    lines = (folder / "out.csv").read_text("utf-8").splitlines()
    assert [line.split(",")[4] for line in lines] == ["'=note", "'=1+1"]
