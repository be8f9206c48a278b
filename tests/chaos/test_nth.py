"""The n-th call fails, for n = 1, 2, 3 … until nothing fails any more: all or nothing, and said.

Of the database every statement and every commit fails once, of files every opening, writing and
renaming, of processes every start, of pipes every answer of a worker.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import pytest

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


def test_nth_call_of_a_file_fails(cradle: Cradle, little: Undisturbed) -> None:
    """A run with traces and reports writes what is asked for whole, or leaves what was there."""
    reports = ("report.html", "junit.xml", "report.json")
    options = ("--report", reports[0], "--junit", reports[1], "--report-json", reports[2])
    arguments = (*run_of("files.db", *options), "--traces", "all")
    complete = failed(cradle, little, "file", 0, arguments)
    last = complete.counted
    assert complete.wait().code == 0
    # Made from the finished campaign, so that no time of an execution is in them.
    assert failed(cradle, little, "file", 0, arguments).wait().code == 0
    wanted = {name: (little.folder / name).read_bytes() for name in reports}
    tried = ended_well = 0
    for nth in places(last, 12):
        for left in (*little.folder.glob("files.db*"), *map(little.folder.joinpath, reports)):
            left.unlink(missing_ok=True)
        said = failed(cradle, little, "file", nth, arguments).wait()
        if said.code == 0:
            # What adeye can do without, such as a cache.
            ended_well += 1
        else:
            # A file of the user that cannot be read is a matter of the input.
            is_input = "SpecError: " in said.text and "cannot be read: " in said.text
            assert_one_message(said, 2 if is_input else 5)
        for name in reports:
            path = little.folder / name
            if path.exists():
                assert path.read_bytes()[-8:] == wanted[name][-8:], (nth, name)
        assert list(little.folder.glob("*.tmp")) == []
        resume(cradle, little, little.folder / "files.db", block=BLOCK)
        tried += 1
    record("nth call of a file", calls=last, tried=tried, not_needed=ended_well)


def test_nth_start_of_a_process_fails(cradle: Cradle, little: Undisturbed) -> None:
    arguments = run_of("starts.db", "--workers", "2")
    last = failed(cradle, little, "process", 0, arguments).counted
    assert last >= 2
    tried = 0
    for nth in places(last, 2):
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
