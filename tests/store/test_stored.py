import pytest

from adeye.store.records import Block, BlockCase, Finding, Plan, WorkState


def case(ordinal: int, result: str, missing: tuple[str, ...], *, has_result: bool) -> BlockCase:
    return BlockCase(ordinal, f"t{result}", result, has_result=has_result, missing_fsrs=missing)


def test_block_executes_what_has_no_result_once() -> None:
    block = Block(
        1,
        "c",
        1,
        (
            case(0, "a", ("F",), has_result=False),
            case(1, "a", ("F",), has_result=False),
            case(2, "b", ("F",), has_result=True),
            case(3, "c", (), has_result=False),
        ),
    )
    assert [item.result_digest for item in block.to_execute] == ["a", "c"]
    assert [item.result_digest for item in block.to_judge] == ["b"]


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (WorkState(0, 0, 3, 0), "complete"),
        (WorkState(0, 1, 3, 1), "running"),
        (WorkState(1, 0, 3, 1), "interrupted"),
        (WorkState(0, 0, 3, 1), "quarantined"),
    ],
)
def test_state_of_a_campaign_is_that_of_its_blocks(state: WorkState, text: str) -> None:
    assert state.text == text


def test_plan_reuses_what_it_does_not_execute() -> None:
    assert Plan("c", 10, to_execute=3, to_judge=2, is_new=True).reused == 7


def test_finding_reads_as_table_row_and_problem() -> None:
    assert str(Finding("run", "abc", "altered")) == "run abc: altered"
    assert str(Finding("database", "", "page 3")) == "database: page 3"
