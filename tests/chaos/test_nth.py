"""The n-th call fails, for n = 1, 2, 3 … until nothing fails any more: all or nothing, and said.

Of the database every statement and every commit fails once, of files every opening, writing and
renaming, of processes every start, of pipes every answer of a worker.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Final

import pytest

from adeye.campaign.traces import read_kept
from tests.chaos.bench import Said
from tests.chaos.runners import (
    IS_FULL,
    Runner,
    Undisturbed,
    assert_one_message,
    assert_whole_blocks,
    record,
    run_of,
)

pytestmark = [pytest.mark.chaos, pytest.mark.slow]


def places(last: int, reduced: int) -> Iterator[int]:
    """Every n in full, some of them otherwise: the first, the last and between."""
    step = 1 if IS_FULL else max(1, last // reduced)
    yield from range(1, last + 1, step)


def failed(whole: Undisturbed, kind: str, nth: int, arguments: tuple[str, ...]) -> Runner:
    """Run to the end with a call that fails, or with none for 0."""
    runner = whole.start(*arguments, fail={"kind": kind, "nth": nth})
    runner.wait()
    return runner


def test_nth_call_of_the_database_fails(little: Undisturbed) -> None:
    last = failed(little, "database", 0, run_of("counted.db")).counted
    tried = 0
    for nth in places(last, 6):
        db = little.cleared("nth.db")
        said = failed(little, "database", nth, run_of(db.name)).wait()
        assert_one_message(said, 5, db.name)
        assert_whole_blocks(db)
        little.resume(db.name)
        tried += 1
    record("nth call of the database", calls=last, tried=tried)


REPORTS: Final = {"--report": "report.html", "--junit": "junit.xml", "--report-json": "report.json"}


def test_nth_call_of_a_file_for_a_report_fails(little: Undisturbed) -> None:
    """A report is there whole, or not at all; what was there before stays."""
    folder = little.folder
    options = [word for option, name in REPORTS.items() for word in (option, name)]
    arguments = run_of("reports.db", *options)
    of_report = ["--output" if word == "--report" else word for word in options]
    assert failed(little, "file", 0, arguments).wait().code == 0
    # Of the finished campaign, so that no time of an execution is in them.
    complete = failed(little, "file", 0, arguments)
    assert complete.wait().code == 0
    present = {name: (folder / name).read_bytes() for name in REPORTS.values()}
    # A file of another kind would not be overwritten at all.
    yesterday = {name: content + b"\n" for name, content in present.items()}
    wanted = {name: {yesterday[name], content} for name, content in present.items()}
    # Lines of the user's files can be done without; they are not told where a file is not read.
    (folder / "odd").rename(folder / "moved")
    said = little.adeye("report", "--db", "reports.db", *of_report)
    assert said.code == 0, said.text
    (folder / "moved").rename(folder / "odd")
    for name, contents in wanted.items():
        contents.add((folder / name).read_bytes())
    tried, last = 0, complete.counted
    for nth in places(last, 5):
        for name, content in yesterday.items():
            (folder / name).write_bytes(content)
        assert_failed_file(failed(little, "file", nth, arguments).wait())
        for name, contents in wanted.items():
            assert (folder / name).read_bytes() in contents, (nth, name)
        assert list(folder.glob("*.part")) == []
        tried += 1
    little.resume("reports.db")
    record("nth call of a file for a report", calls=last, tried=tried)


def test_nth_call_of_a_file_for_a_trace_fails(little: Undisturbed) -> None:
    """What the database names of the kept traces is there and can be read."""
    folder, kept = little.folder, little.folder / "kept.db.traces"
    arguments = (*run_of("kept.db"), "--traces", "all")
    last = failed(little, "file", 0, arguments).counted
    tried = 0
    for nth in places(last, 5):
        shutil.rmtree(kept, ignore_errors=True)
        little.cleared("kept.db")
        assert_failed_file(failed(little, "file", nth, arguments).wait())
        assert_whole_blocks(folder / "kept.db")
        assert [path for path in kept.glob("*") if read_kept(kept, path.stem) is None] == []
        little.resume("kept.db")
        tried += 1
    record("nth call of a file for a trace", calls=last, tried=tried)


def assert_failed_file(said: Said) -> None:
    """See that a failed call was said; what can be done without may fail in silence."""
    if "No space left on device" in said.text or said.code:
        # A file of the user that cannot be read is a matter of the input; once it has run, it may
        # be another one by now.
        is_input = "SpecError: " in said.text and "cannot be read: " in said.text
        if said.code == 3:
            assert "edited while it ran: " in said.text
        else:
            assert_one_message(said, 2 if is_input else 5)


def test_nth_start_of_a_process_fails(little: Undisturbed) -> None:
    arguments = run_of("starts.db", "--workers", "2")
    last = failed(little, "process", 0, arguments).counted
    assert last >= 2
    tried = 0
    for nth in places(last, 1):
        little.cleared("starts.db")
        said = failed(little, "process", nth, arguments).wait()
        if said.code:
            assert_one_message(said, 5)
        little.resume("starts.db")
        tried += 1
    record("nth start of a process", calls=last, tried=tried)


def test_nth_answer_of_a_worker_is_lost(little: Undisturbed) -> None:
    arguments = run_of("pipes.db", "--workers", "2")
    last = failed(little, "pipe", 0, arguments).counted
    assert last > 0
    tried = 0
    for nth in places(last, 1):
        little.cleared("pipes.db")
        said = failed(little, "pipe", nth, arguments).wait()
        # Its block is executed once more, by another worker.
        assert said.code == 0, said.text
        little.assert_identical(little.folder / "pipes.db")
        tried += 1
    record("nth answer of a worker", calls=last, tried=tried)
