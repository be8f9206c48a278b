"""What a report says about preventability."""

from adeye.judge.preventability import Cell, Comparison
from adeye.report.assessment import LISTED, preventability_of


def compared(number: int, cell: Cell, *, edition: str = "r157-01", model: str = "cc") -> Comparison:
    return Comparison(
        run=f"run{number:02}",
        scenario="cut_in",
        architecture="legacy",
        fault_entry="none",
        model=model,
        edition=edition,
        drive=f"drive{number:02}",
        cell=cell,
        impact_speed_mps=float(number),
        drive_impact_speed_mps=None,
    )


COMMANDS = ("adeye preventability c0de", lambda run: f"adeye replay {run}")


def test_nothing_evaluated_counts_what_is_open() -> None:
    told = preventability_of([], (7, 3), COMMANDS)
    assert (told.executed, told.compared, told.open_contacts) == (7, 0, 3)
    assert (told.tallies, told.findings, told.command) == ((), 0, COMMANDS[0])


def test_hardest_contacts_are_listed_and_all_are_counted() -> None:
    found = [compared(number, "only_model") for number in range(LISTED + 3)]
    told = preventability_of([*found, compared(99, "neither")], (99, 0), COMMANDS)
    assert told.findings == LISTED + 3
    assert [item.run for item in told.listed] == [
        f"run{LISTED + 2 - at:02}" for at in range(LISTED)
    ]
    assert told.listed[0].drive_command == f"adeye replay drive{LISTED + 2:02}"


def test_run_that_two_models_are_held_against_is_one_compared_run() -> None:
    found = [compared(1, "neither"), compared(1, "both_avoid", model="fsm")]
    told = preventability_of(found, (1, 0), COMMANDS)
    assert told.compared == 1
    assert [(item.model, item.counts["neither"]) for item in told.tallies] == [
        ("cc", 1),
        ("fsm", 0),
    ]


def test_editions_are_not_counted_together() -> None:
    found = [compared(1, "neither"), compared(1, "neither", edition="r157-original")]
    told = preventability_of(found, (1, 0), COMMANDS)
    assert [(item.edition, item.runs) for item in told.tallies] == [
        ("r157-01", 1),
        ("r157-original", 1),
    ]
