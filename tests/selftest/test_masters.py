"""What counts as detected: the stated exit code together with the stated words, nothing less."""

import pytest

from adeye.selftest.bench import BARE, GROUPS, Bench, Edit, Master, Seen, is_good, running
from adeye.selftest.running import MASTERS


@pytest.mark.parametrize(
    ("code", "text", "is_detected"),
    [
        (1, "FSR-01 FAIL\nFSR-02 PASS", True),
        (0, "FSR-01 FAIL", False),
        (3, "FSR-01 FAIL", False),
        (-1, "FSR-01 FAIL", False),
        (1, "FSR-02 FAIL", False),
        (1, "", False),
    ],
)
def test_exit_code_and_words_are_both_needed(code: int, text: str, *, is_detected: bool) -> None:
    master = Master("m", "channel", "w", "f", 1, "FSR-01 FAIL", running(), running())
    assert master.is_detected(Seen(code, text)) is is_detected


def test_only_exit_code_0_is_good() -> None:
    assert [code for code in (-1, 0, 1, 2, 3, 4, 5) if is_good(Seen(code, ""))] == [0]


@pytest.mark.slow
def test_edits_are_taken_through_the_production_path(bench: Bench) -> None:
    assert running(Edit(BARE, "flaw: none", "flaw: never_brakes"))(bench).exit_code == 1


def test_masters_have_names_of_their_own_and_say_how_they_show() -> None:
    assert len({master.name for master in MASTERS}) == len(MASTERS) >= 30
    assert {master.group for master in MASTERS} == set(GROUPS)
    for master in MASTERS:
        assert master.exit_code in {1, 2, 3, 4}
        assert min(map(len, (master.wrong, master.finder, master.words))) > 5, master.name
