"""The n-th call fails, for n = 1, 2, 3 … until nothing fails any more: all or nothing, and said.

Of the database every statement and every commit fails once, of files every opening, writing and
renaming, of processes every start, of pipes every answer of a worker.
"""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any, Final

import pytest

from adeye.campaign.traces import read_kept
from tests.chaos.runners import (
    IS_FULL,
    assert_identical,
    assert_one_message,
    assert_whole_blocks,
    record,
    resume,
    run_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.chaos.bench import Said
    from tests.chaos.runners import Cradle, Runner, Undisturbed

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

BLOCK: Final = 4


def places(last: int, reduced: int) -> Iterator[int]:
    """Every n in full, some of them otherwise: the first, the last and between."""
    step = 1 if IS_FULL else max(1, last // reduced)
    yield from range(1, last + 1, step)


def failed(
    cradle: Cradle, whole: Undisturbed, kind: str, nth: int, arguments: tuple[str, ...]
) -> Runner:
    """Run to the end with a call that fails, or with none for 0."""
    setup: dict[str, Any] = {"block": BLOCK, "fail": {"kind": kind, "nth": nth}}
    runner = cradle.start(whole.folder, *arguments, setup=setup)
    runner.wait()
    return runner


def test_nth_call_of_the_database_fails(cradle: Cradle, little: Undisturbed) -> None:
    last = failed(cradle, little, "database", 0, run_of("counted.db")).counted
    tried = 0
    for nth in places(last, 6):
        db = little.folder / "nth.db"
        for left in little.folder.glob("nth.db*"):
            left.unlink()
        said = failed(cradle, little, "database", nth, run_of(db.name)).wait()
        assert_one_message(said, 5, db.name)
        assert_whole_blocks(db)
        resume(cradle, little, db, block=BLOCK)
        tried += 1
    record("nth call of the database", calls=last, tried=tried)


REPORTS: Final = {"--report": "report.html", "--junit": "junit.xml", "--report-json": "report.json"}


def test_nth_call_of_a_file_for_a_report_fails(cradle: Cradle, little: Undisturbed) -> None:
    """A report is there whole, or not at all; what was there before stays."""
    folder = little.folder
    options = [word for option, name in REPORTS.items() for word in (option, name)]
    arguments = run_of("reports.db", *options)
    of_report = ["--output" if word == "--report" else word for word in options]
    assert failed(cradle, little, "file", 0, arguments).wait().code == 0
    # Of the finished campaign, so that no time of an execution is in them.
    complete = failed(cradle, little, "file", 0, arguments)
    assert complete.wait().code == 0
    wanted = {name: {b"of yesterday", (folder / name).read_bytes()} for name in REPORTS.values()}
    # Lines of the user's files can be done without; they are not told where a file is not read.
    (folder / "odd").rename(folder / "moved")
    said = cradle.adeye(folder, "report", "--db", "reports.db", *of_report)
    assert said.code == 0, said.text
    (folder / "moved").rename(folder / "odd")
    for name, contents in wanted.items():
        contents.add((folder / name).read_bytes())
    tried, last = 0, complete.counted
    for nth in places(last, 5):
        for name in REPORTS.values():
            (folder / name).write_bytes(b"of yesterday")
        assert_failed_file(failed(cradle, little, "file", nth, arguments).wait())
        for name, contents in wanted.items():
            assert (folder / name).read_bytes() in contents, (nth, name)
        assert list(folder.glob("*.part")) == []
        tried += 1
    resume(cradle, little, folder / "reports.db", block=BLOCK)
    record("nth call of a file for a report", calls=last, tried=tried)


def test_nth_call_of_a_file_for_a_trace_fails(cradle: Cradle, little: Undisturbed) -> None:
    """What the database names of the kept traces is there and can be read."""
    folder, kept = little.folder, little.folder / "kept.db.traces"
    arguments = (*run_of("kept.db"), "--traces", "all")
    last = failed(cradle, little, "file", 0, arguments).counted
    tried = 0
    for nth in places(last, 5):
        shutil.rmtree(kept, ignore_errors=True)
        for left in folder.glob("kept.db*"):
            left.unlink()
        assert_failed_file(failed(cradle, little, "file", nth, arguments).wait())
        assert_whole_blocks(folder / "kept.db")
        assert [path for path in kept.glob("*") if read_kept(kept, path.stem) is None] == []
        resume(cradle, little, folder / "kept.db", block=BLOCK)
        tried += 1
    record("nth call of a file for a trace", calls=last, tried=tried)


def assert_failed_file(said: Said) -> None:
    """See that a failed call was said; what can be done without may fail in silence."""
    if "No space left on device" in said.text or said.code:
        # A file of the user that cannot be read is a matter of the input.
        is_input = "SpecError: " in said.text and "cannot be read: " in said.text
        assert_one_message(said, 2 if is_input else 5)


def test_nth_start_of_a_process_fails(cradle: Cradle, little: Undisturbed) -> None:
    arguments = run_of("starts.db", "--workers", "2")
    last = failed(cradle, little, "process", 0, arguments).counted
    assert last >= 2
    tried = 0
    for nth in places(last, 1):
        for left in little.folder.glob("starts.db*"):
            left.unlink()
        said = failed(cradle, little, "process", nth, arguments).wait()
        if said.code:
            assert_one_message(said, 5)
        resume(cradle, little, little.folder / "starts.db", block=BLOCK)
        tried += 1
    record("nth start of a process", calls=last, tried=tried)


def test_nth_answer_of_a_worker_is_lost(cradle: Cradle, little: Undisturbed) -> None:
    arguments = run_of("pipes.db", "--workers", "2")
    last = failed(cradle, little, "pipe", 0, arguments).counted
    assert last > 0
    tried = 0
    for nth in places(last, 1):
        for left in little.folder.glob("pipes.db*"):
            left.unlink()
        said = failed(cradle, little, "pipe", nth, arguments).wait()
        # Its block is executed once more, by another worker.
        assert said.code == 0, said.text
        assert_identical(little, little.folder / "pipes.db")
        tried += 1
    record("nth answer of a worker", calls=last, tried=tried)
