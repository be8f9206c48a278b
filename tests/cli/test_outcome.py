"""What came out of a campaign in words and as JSON."""

from dataclasses import replace

from adeye.cli.run import document, executed_text, rejudged_text
from tests.cli.test_run import SUMMARY


def test_nothing_executed_is_said() -> None:
    summary = replace(SUMMARY, executed=0, reused=12)
    assert executed_text(summary) == "Executed nothing, all 12 results were there."
    assert executed_text(replace(summary, judged=12)).endswith(
        "Re-judged 12 of 12 results; 0 executed again for it."
    )


def test_large_counts_can_be_read() -> None:
    text = executed_text(replace(SUMMARY, planned=1_000_000, executed=998_976, reused=1024))
    assert text == "Executed 998,976 of 1,000,000 test cases; 1,024 reused."


def test_nothing_planned_is_not_everything_there() -> None:
    empty = replace(SUMMARY, planned=0, executed=0)
    assert executed_text(empty) == "Executed 0 of 0 test cases; 0 reused."


def test_ways_of_judging_again_are_named() -> None:
    summary = replace(SUMMARY, judged=5, ways={"metric": 3, "trace": 2}, to_replay=1)
    assert rejudged_text(summary) == (
        "Re-judged 5 of 6 results (3 from metric rows, 2 from kept traces); "
        "0 executed again for it."
    )


def test_document_tells_what_was_chosen_and_what_remains() -> None:
    assert document(SUMMARY)["selected"] == 12
    assert document(SUMMARY)["remaining"] == 0
    part = replace(SUMMARY, selected=4, executed=4, to_execute=8)
    assert (document(part)["selected"], document(part)["remaining"]) == (4, 8)
    assert document(replace(SUMMARY, selected=0))["selected"] == 0
