"""What other tools answered, and that every difference has a reason that predicts it."""

import warnings
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from docs.peers import compare, states
from docs.peers.reasons import AD_RSS

FOUND = list(compare.results())


def name_of(found: compare.Result) -> str:
    return f"{found.peer.split()[0]}-{found.comparison.theirs}-{found.comparison.name}"


@pytest.mark.parametrize("found", FOUND, ids=name_of)
def test_every_difference_is_understood(found: compare.Result) -> None:
    assert found.states >= 200
    assert found.open == []
    assert found.agreeing + sum(found.reasons.values()) == found.states


@pytest.mark.parametrize("found", FOUND, ids=name_of)
def test_other_value_of_ours_is_not_understood(found: compare.Result) -> None:
    def off(*state: float) -> float:
        return 1.00001 * found.comparison.ours(*state) + 1e-5

    (stored,) = [
        states.read(peer)["metrics"][metric]["rows"]
        for peer, (_, comparisons) in compare.PEERS.items()
        for metric, comparison in comparisons.items()
        if comparison is found.comparison
    ]
    changed = compare.compared(found.peer, replace(found.comparison, ours=off, reasons=()), stored)
    unchanged = compare.compared(found.peer, replace(found.comparison, reasons=()), stored)
    assert len(unchanged.open) == sum(found.reasons.values())
    finite = [row for row in stored if row[-1] is not None and abs(row[-1]) < float("inf")]
    assert len(changed.open) >= len(unchanged.open)
    if found.agreeing and any(found.comparison.ours(*row[:-1]) == row[-1] for row in finite):
        assert len(changed.open) > len(unchanged.open)


def test_states_fill_their_ranges_and_none_comes_twice() -> None:
    drawn = states.draw(400, [(0.0, 10.0), (-1.0, 1.0)], 3)
    assert len({tuple(row) for row in drawn}) == 400
    for place, (low, high) in enumerate([(0.0, 10.0), (-1.0, 1.0)]):
        values = sorted(row[place] for row in drawn)
        assert low <= values[0]
        assert values[-1] <= high
        widest = max(b - a for a, b in pairwise([low, *values, high]))
        assert widest < 0.02 * (high - low)


def test_infinity_and_nothing_are_kept_apart(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(states, "ANSWERS", tmp_path)
    rows = [[1.0, float("inf")], [2.0, None], [3.0, 4.5]]
    states.write("tool", "1", {"ttc": (["gap"], rows)})
    assert states.read("tool")["metrics"]["ttc"]["rows"] == rows


def test_infinity_agrees_with_infinity_only() -> None:
    inf = float("inf")
    assert compare.agree(inf, inf, 1e-6)
    assert not compare.agree(inf, -inf, 1e-6)
    assert not compare.agree(inf, 1e9, 1e-6)
    assert not compare.agree(float("nan"), 1.0, 1e-6)
    assert compare.agree(1e6, 1e6 + 0.5, 1e-6)
    assert not compare.agree(1.0, 1.00001, 1e-6)


def test_ad_rss_answers_what_is_stored_and_the_same_as_we_to_a_billionth() -> None:
    with warnings.catch_warnings():
        # Its two modules register the same converters.
        warnings.simplefilter("ignore")
        pytest.importorskip("ad_rss")
    from docs.peers import ask_rss

    stored = states.read("ad-rss")["metrics"]
    for name, ask in (
        ("rss_same", ask_rss.same_direction),
        ("rss_opposite", ask_rss.opposite),
        ("rss_lateral", ask_rss.lateral),
    ):
        assert ask()[1] == [pytest.approx(row, rel=1e-12) for row in stored[name]["rows"]]
        _, rows = ask(10_000)
        ours = [AD_RSS[name].ours(*row[:-1]) for row in rows]
        # Its comparison with 0 takes what is within a millimetre of it for 0.
        theirs = [max(row[-1], 0.0) for row in rows]
        assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-9)


def test_stored_answers_of_ad_rss_are_ours_to_a_billionth() -> None:
    for name, metric in states.read("ad-rss")["metrics"].items():
        ours = [AD_RSS[name].ours(*row[:-1]) for row in metric["rows"]]
        assert ours == pytest.approx([row[-1] for row in metric["rows"]], rel=1e-9, abs=1e-9)


def test_sumo_still_answers_what_is_stored() -> None:
    pytest.importorskip("libsumo")
    from docs.peers import ask_sumo

    stored = states.read("sumo")["metrics"]
    for name, (_, rows) in ask_sumo.answers().items():
        assert rows == stored[name]["rows"]
