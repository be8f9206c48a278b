"""Groups of cases are those that a comparison of every two of them finds."""

import random  # noqa: TID251 - made-up plans; no simulated noise

import pytest

from adeye.store.accounts import CaseGroups

Case = tuple[str, str, str, str]


def fed(cases: list[Case], part: int = 3) -> CaseGroups:
    """Feed cases one after the other, those of one kind together as far as they are in line."""
    groups = CaseGroups()
    waiting: list[Case] = []
    for case in [*cases, ("", "", "", "")]:
        if waiting and (case[:3] != waiting[0][:3] or len(waiting) == part):
            groups.add(*waiting[0][:3], [item[3] for item in waiting])
            waiting = []
        waiting.append(case)
    return groups


def matched(groups: CaseGroups) -> list[tuple[int, int, str]]:
    return [(item[1], item[2], item[3]) for rows in groups.matches("c") for item in rows]


def compared(cases: list[Case]) -> list[tuple[int, int, str]]:
    """Compare every case with every other one."""
    found = []
    for ordinal, (scenario, _, fault, situation) in enumerate(cases):
        same = [
            (other, case[1])
            for other, case in enumerate(cases)
            if (case[0], case[2], case[3]) == (scenario, fault, situation)
        ]
        if len({architecture for _, architecture in same}) > 1:
            found.append((same[0][0], ordinal, fault))
    return sorted(found)


@pytest.mark.parametrize("seed", range(20))
def test_groups_are_those_that_comparing_every_two_cases_finds(seed: int) -> None:
    picks = random.Random(seed)  # noqa: S311 - made up
    cases = [
        (picks.choice("st"), picks.choice("abc"), picks.choice(["none", "f", "f+g"]), str(number))
        for number in picks.choices(range(8), k=picks.randrange(60))
    ]
    groups = fed(cases)
    assert matched(groups) == compared(cases)
    counts = {item[1:4]: item[4] for item in groups.counts("c")}
    assert counts == {kind: [case[:3] for case in cases].count(kind) for kind in counts}
    assert sum(counts.values()) == len(cases)


def test_one_architecture_has_no_partners() -> None:
    groups = fed([("s", "a", "none", "1"), ("s", "a", "none", "1"), ("s", "a", "none", "2")])
    assert matched(groups) == []


def test_texts_that_join_to_the_same_are_different_groups() -> None:
    cases = [("s", "a", "f", "1"), ("sf", "b", "", "1"), ("s", "b", "", "f1")]
    assert matched(fed(cases)) == []


def test_many_cases_come_in_parts_in_the_order_of_the_plan() -> None:
    situations = [str(number) for number in range(6_000)]
    groups = CaseGroups()
    for architecture in "ab":
        groups.add("s", architecture, "none", situations)
    parts = list(groups.matches("c"))
    assert len(parts) > 1
    found = [(item[1], item[2]) for rows in parts for item in rows]
    assert found == [(n, m) for n in range(6_000) for m in (n, n + 6_000)]
