"""Two runners of one campaign with clocks that disagree, and leases that end while they work."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Final

import pytest

from tests.chaos.runners import Undisturbed, claimed, record, run_of, size

pytestmark = [pytest.mark.chaos, pytest.mark.slow]

HOUR_S: Final = 3600.0
TRIES: Final = 10
PAIRS: Final[Mapping[str, tuple[dict[str, Any], dict[str, Any]]]] = {
    "one hour ahead": ({}, {"clock_s": HOUR_S}),
    "one hour behind": ({}, {"clock_s": -HOUR_S}),
    "another machine, one hour ahead": ({}, {"clock_s": HOUR_S, "machine": "elsewhere"}),
}


@pytest.mark.parametrize("name", PAIRS)
def test_two_runners_do_each_run_once(little: Undisturbed, name: str) -> None:
    db = little.cleared("clocks.db")
    assert little.adeye("db", "upgrade", "--db", db.name).code == 0
    runners = [little.start(*run_of(db.name), block=1, **setup) for setup in PAIRS[name]]
    codes = [runner.wait().code for runner in runners]
    # A runner that leaves while the other one still works says that evidence is missing.
    assert set(codes) <= {0, 3}, [runner.wait().text for runner in runners]
    little.resume(db.name, block=1)
    claims, blocks = claimed(db)
    record(f"clocks, {name}", blocks=blocks, claims=claims, twice=0)
    if "machine" not in PAIRS[name][1]:
        # On one machine no time of day ends a lease, so nothing was even executed twice.
        assert claims == blocks


def test_late_result_is_fenced_off(little: Undisturbed) -> None:
    """Every lease ends at once, so that either runner takes blocks that the other one executes."""
    fenced = 0
    setup: dict[str, Any] = {"late": True, "calls_of": ["complete_block", False]}
    for number in range(TRIES):
        db = f"late-{number}.db"
        assert little.adeye("db", "upgrade", "--db", db).code == 0
        runners = [little.start(*run_of(db), block=1, **setup) for _ in range(2)]
        assert {runner.wait().code for runner in runners} <= {0, 3}
        fenced += sum(runner.counted for runner in runners)
        little.resume(db, block=1)
        if fenced and number + 1 >= size(1, TRIES):
            break
    assert fenced > 0
    record("late results", campaigns=number + 1, fenced_off=fenced)


@pytest.mark.parametrize("zone", ["Europe/Stockholm", "America/St_Johns", "Asia/Kathmandu"])
def test_zone_of_the_machine_changes_no_row(little: Undisturbed, zone: str) -> None:
    """Also across the hour that summer time takes away or gives twice."""
    for number, moment in enumerate(("2026-03-29T00:59:59", "2026-10-25T00:59:59")):
        db = f"zone-{number}-{os.path.basename(zone)}.db"  # noqa: PTH119
        little.resume(db, zone=zone, moment=moment)
