"""Swept axes that move no metric."""

from typing import Any

from adeye.report.metrics import dead_axes, moves
from adeye.store.tables import METRIC_IDS
from tests.figures import figures_of

ODD: dict[str, Any] = {
    "scenarios": {
        "cut_in": {"parameters": {"gap": {"default": "30 m"}, "ego_speed": {"default": "100 km/h"}}}
    }
}


def row(point: dict[str, float], distance: float | None = 1.0, **changes: Any) -> dict[str, Any]:
    return {
        "scenario": "cut_in",
        "architecture": "candidate",
        "fault_entry": "none",
        "replicate": 0,
        "point": point,
        **dict.fromkeys(METRIC_IDS, 0.5),
        "min_distance_m": distance,
        **changes,
    }


def dead(rows: list[dict[str, Any]]) -> list[str]:
    return [item.axis for item in dead_axes(figures_of(rows), ODD, lambda text: text)]


def test_axis_that_changes_a_metric_is_alive() -> None:
    rows = [row({"gap": 30.0}, 1.0), row({"gap": 40.0}, 2.0)]
    assert moves(figures_of(rows), "gap")
    assert dead(rows) == []


def test_axis_that_changes_nothing_is_dead_with_its_values_in_the_users_units() -> None:
    rows = [row({"gap": 30.0, "ego_speed": 25.0}), row({"gap": 40.0, "ego_speed": 25.0})]
    found = list(dead_axes(figures_of(rows), ODD, lambda text: f"{text} --db x.db"))
    assert [(item.scenario, item.axis, item.values) for item in found] == [
        ("cut_in", "gap", "30 m, 40 m")
    ]
    assert "v_runs_cut_in" in found[0].command
    assert found[0].command.endswith("--db x.db")


def test_value_that_comes_or_goes_is_a_change() -> None:
    assert moves(figures_of([row({"gap": 30.0}, None), row({"gap": 40.0}, 1.0)]), "gap")


def test_only_runs_that_differ_in_nothing_else_are_compared() -> None:
    others: tuple[dict[str, Any], ...] = (
        {"architecture": "legacy"},
        {"fault_entry": "camera_out"},
        {"replicate": 1},
        {"point": {"gap": 40.0, "ego_speed": 30.0}},
    )
    for other in others:
        rows = [row({"gap": 30.0, "ego_speed": 25.0}, 1.0)]
        rows.append({**row({"gap": 40.0, "ego_speed": 25.0}, 2.0), **other})
        assert not moves(figures_of(rows), "gap")


def test_one_pair_in_any_architecture_keeps_an_axis_alive() -> None:
    rows = [row({"gap": gap}) for gap in (30.0, 40.0)]
    rows += [
        row({"gap": gap}, distance, architecture="legacy")
        for gap, distance in ((30.0, 1.0), (40.0, 2.0))
    ]
    assert dead(rows) == []


def test_axis_with_one_value_is_no_axis() -> None:
    assert dead([row({"gap": 30.0}), row({"gap": 30.0}, replicate=1)]) == []


def test_axis_of_one_architecture_is_judged_by_its_own_runs() -> None:
    rows = [row({}, architecture="legacy")]
    rows += [row({"yaw": 0.0}, 1.0), row({"yaw": 0.1}, 1.0)]
    assert dead(rows) == ["yaw"]


def test_scenarios_are_judged_apart() -> None:
    rows = [row({"gap": 30.0}, 1.0), row({"gap": 40.0}, 2.0)]
    rows += [row({"gap": gap}, scenario="braking") for gap in (30.0, 40.0)]
    found = list(dead_axes(figures_of(rows), ODD, lambda text: text))
    assert [(item.scenario, item.axis) for item in found] == [("braking", "gap")]


def test_more_axes_than_one_number_can_hold_are_told_apart() -> None:
    # 2 levels of 70 axes: 2^70 groups.
    names = [f"axis_{k}" for k in range(70)]
    base = dict.fromkeys(names, 0.0)
    rows = [row(base)] + [row({**base, name: 1.0}) for name in names]
    assert dead(rows) == sorted(names)
    rows[1] = row({**base, names[0]: 1.0}, 2.0)
    assert dead(rows) == sorted(names[1:])
