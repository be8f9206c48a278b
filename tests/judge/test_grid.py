"""The map around the ego at one row: layers, numbers of cells, and views of channels."""

import io
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from adeye.errors import UsageError
from adeye.judge.grid import LAYERS, GridMap, grid_at, grid_map
from adeye.judge.safe_stop import ratings_of
from adeye.kernel.stops import RULE_NAMES
from adeye.spec.architecture import Architecture
from adeye.spec.grid import ADEYE_COSTS, CellCosts, CellRule, GridSettings, rating_costs
from adeye.trace import Trace
from tests.judge.conftest import HandMade
from tests.refusals import refused

Make = Callable[..., HandMade]


def beside(made: HandMade) -> HandMade:
    """Let the object stand 10 m ahead of the ego's front."""
    return made.object("lead", s=14.0, speed=0.0).ego(s=0.0)


def fixed(trace: Trace, height: float) -> Trace:
    """Make the objects of a trace static ones."""
    context = replace(trace.layout.context, actor_count=0)
    context.object_sizes[..., 2] = height
    return replace(trace, layout=replace(trace.layout, context=context))


def test_car_10_m_ahead_occupies_its_cells_and_the_ego_its_own(hand_made: Make) -> None:
    found = grid_map(beside(hand_made()).trace(), 0, 0.0)
    across = abs(found.y) < 1.0
    occupied = ((found.x > 12.0) & (found.x < 16.0))[:, None] & across
    assert np.array_equal(found["time_to_occupancy"] == 0.0, occupied)
    assert np.isinf(found["time_to_occupancy"][~occupied]).all()
    assert np.array_equal(found["ego"], (abs(found.x) < 2.0)[:, None] & across)
    assert np.array_equal(found["number"] == 8.0, occupied)
    assert np.array_equal(found["blocked"], occupied)
    assert not found["static"].any()


def test_window_is_as_asked_for(hand_made: Make) -> None:
    trace = hand_made().trace()
    found = grid_map(trace, 0, 0.0)
    assert {name: layer.shape for name, layer in found.layers.items()} == dict.fromkeys(
        LAYERS, (150, 70)
    )
    small = GridSettings(width="9 m", ahead="12 m", behind="3 m", cell="1 m")
    found = grid_map(trace, 0, 0.0, small)
    assert found.x.tolist() == [index - 2.5 for index in range(15)]
    assert found.y.tolist() == [index - 4.0 for index in range(9)]


def test_oncoming_car_arrives_when_it_must(hand_made: Make) -> None:
    made = hand_made().ego(s=0.0).object("lead", s=44.0, speed=20.0, heading=math.pi)
    found = grid_map(made.trace(), 0, 0.0)
    ahead = (found.x > 0.0) & (found.x < 41.0)
    times = found["time_to_occupancy"][ahead][:, found.y == 0.25][:, 0]
    assert times == pytest.approx((42.0 - found.x[ahead]) / 20.0, abs=0.5 / 20.0)


def test_nothing_is_predicted_beyond_the_horizon(hand_made: Make) -> None:
    made = hand_made().object("lead", s=10.0, speed=5.0).ego(s=0.0)
    times = grid_map(made.trace(), 0, 0.0, GridSettings(horizon="2 s"))["time_to_occupancy"]
    assert times[np.isfinite(times)].max() == pytest.approx(2.0, abs=0.05)


def test_static_object_is_as_high_as_it_is_and_is_not_predicted(hand_made: Make) -> None:
    found = grid_map(fixed(beside(hand_made()).trace(), 0.9), 0, 0.0)
    assert (found["static"] > 0.0).sum() == 32
    assert found["static"].max() == 0.9
    assert np.isinf(found["time_to_occupancy"]).all()
    assert (found["number"] == 8.0).sum() == 32


def test_map_tells_lanes_and_shoulder(hand_made: Make) -> None:
    found = grid_map(hand_made().trace(), 0, 0.0)
    d = found.y + 5.25
    lanes = np.where((d >= 0.0) & (d < 10.5), np.floor(d / 3.5), -1)
    assert np.array_equal(found["lane"], np.tile(lanes, (150, 1)))
    assert np.array_equal(found["shoulder"], np.tile((d < 0.0) & (d >= -2.0), (150, 1)))
    assert np.array_equal(found["drivable"], np.tile((d >= -2.0) & (d <= 10.5), (150, 1)))


def test_ratings_are_those_of_the_safety_channel(
    hand_made: Make, architecture: Callable[..., Architecture]
) -> None:
    ratings = {"ratings": {"hard_shoulder": 2}}
    other = architecture(
        channels={
            "nominal": {"kind": "nominal", "links": ["camera"], "rate": "10 Hz"},
            "safety": {
                "kind": "safety",
                "links": ["truth"],
                "rate": "10 Hz",
                "parameters": ratings,
            },
        }
    )
    trace = hand_made(objects=()).trace()
    found = grid_map(replace(trace, layout=replace(trace.layout, architectures=(other,))), 0, 0.0)
    assert ratings_of(other).hard_shoulder == 2
    # The outer edge of the shoulder runs through the middle of the last cells.
    assert set(found["number"][found["shoulder"]].tolist()) == {2.0, 7.0}


def test_costs_of_adeye_on_a_straight_road(hand_made: Make) -> None:
    made = beside(hand_made(objects=("lead",)))
    found = grid_map(fixed(made.trace(), 1.5), 0, 0.0, GridSettings(costs=ADEYE_COSTS))

    def cost(x: float, y: float) -> float:
        return float(found["number"][found.x == x, found.y == y].item())

    assert cost(5.25, 0.25) == 25.0
    assert cost(5.25, -4.75) == 25.0
    # A cell with the right edge of the road in it, the shoulder, the ground beside it.
    assert [cost(5.25, y) for y in (-5.25, -6.25, -15.25)] == [50.0, 50.0, 50.0]
    # To the left of the ego's left side, and beside the road there.
    assert [cost(5.25, y) for y in (0.75, 1.25, 4.75, 5.25, 8.25)] == [25.0, 65.0, 65.0, 90.0, 90.0]
    assert cost(14.25, 0.25) == 100.0
    blocked = found["blocked"]
    assert np.array_equal(blocked, (found["static"] > 0.0) | (found.y > 5.0))


def number_at(found: GridMap, along: float) -> float:
    """Number of the cell 4 m beside the reference line, of the ego 5.25 m beside it."""
    cell = abs(found.x - along).argmin(), abs(found.y + 9.25).argmin()
    return float(found["number"][cell])


def test_bay_costs_little_and_rest_area_nothing_in_adeye(hand_made: Make) -> None:
    trace = hand_made(objects=()).trace()
    bays = np.array([[[0.0, 5.0, 10.0, 4.0, 0.0], [1.0, 30.0, 10.0, 4.0, 0.0]]])
    road = replace(trace.layout.context.road, refuges=bays)
    context = replace(trace.layout.context, road=road)
    trace = replace(trace, layout=replace(trace.layout, context=context))
    found = grid_map(trace, 0, 0.0, GridSettings(costs=ADEYE_COSTS))
    # The ego is 5.25 m from the right edge, the bays begin 2 m beside it.
    assert [number_at(found, x) for x in (10.0, 20.0, 35.0)] == [5.0, 50.0, 0.0]
    beside = (found.y >= -11.25) & (found.y < -7.25)
    for name, row, start in (("parking", 0, 5.0), ("rest_area", 1, 30.0)):
        along = (found.x > start) & (found.x < start + 10.0)
        assert np.array_equal(found[name] == row, along[:, None] & beside)
        assert np.unique(found[name]).tolist() == [-1, row]
    assert number_at(grid_map(trace, 0, 0.0), 35.0) == 0.0


def test_kerb_is_no_obstacle_for_adeye(hand_made: Make) -> None:
    trace = fixed(beside(hand_made()).trace(), 0.15)
    found = grid_map(trace, 0, 0.0, GridSettings(costs=ADEYE_COSTS))
    assert (found["static"] > 0.0).sum() == 32
    assert found["number"].max() == 90.0


def test_rules_change_numbers_in_their_order(hand_made: Make) -> None:
    rules = (
        CellRule(layer="lane", above=-1.0, set=10.0),
        CellRule(layer="sensors", up_to=0.0, add=5.0),
        CellRule(layer="ego", above=0.0, set=0.0),
    )
    costs = CellCosts(default=30.0, rules=rules, outside=40.0, blocked=35.0)
    found = grid_map(hand_made(objects=()).trace(), 0, 0.0, GridSettings(costs=costs))
    seen = found["sensors"] > 0
    on_lane = found["lane"] >= 0
    expected = np.where(on_lane, 10.0, 30.0) + np.where(seen, 0.0, 5.0)
    assert np.array_equal(found["number"], np.where(found["ego"], 0.0, expected))
    assert np.array_equal(found["blocked"], ~on_lane & ~seen)


def test_dead_sensor_covers_nothing(hand_made: Make) -> None:
    made = hand_made(objects=())
    found = grid_map(made.trace(), 0, 1.0)
    bearing = np.degrees(np.arctan2(found.y, found.x[:, None]))
    assert np.array_equal(found["sensors"], abs(bearing) <= 30.0)
    made.set("sensor_alive", value=False, rows=slice(5, None), at=0)
    assert not grid_map(made.trace(), 0, 1.0)["sensors"].any()
    assert grid_map(made.trace(), 0, 0.3)["sensors"].any()
    made.set("sensor_alive", value=False, rows=slice(1, None), at=0)
    assert grid_map(made.trace(), 0, 0.0)["sensors"].any()


def test_view_of_a_channel_has_what_it_believed_where_it_looked(hand_made: Make) -> None:
    made = hand_made(objects=())
    tracks = made.columns["tracks"]
    # A ghost that stands, 14 m ahead of where the ego was 0.5 s before.
    tracks[0, 10, 1, 0] = [14.0, 0.0, 0.0, 0.0, 4.0, 2.0]
    made.columns["stamp"][0, 10, 1] = 0.5
    trace = made.trace()
    found = grid_at(trace, 0, 10, view="safety")
    occupied = found["time_to_occupancy"] == 0.0
    assert occupied.sum() == 32
    assert found.x[occupied.any(axis=1)].mean() == pytest.approx(4.0)
    assert np.isnan(found["static"]).all()
    assert np.isinf(grid_at(trace, 0, 10, view="nominal")["time_to_occupancy"]).all()
    assert np.isinf(grid_at(trace, 0, 10)["time_to_occupancy"]).all()


def test_last_row_shows_what_was_decided_before_it(hand_made: Make) -> None:
    made = hand_made(objects=(), rows=11)
    made.columns["tracks"][0, 9, 1, 0] = [14.0, 0.0, 0.0, 0.0, 4.0, 2.0]
    found = grid_at(made.trace(), 0, 10, view="safety")
    assert (found["time_to_occupancy"] == 0.0).sum() == 32


RULE = CellRule(layer="sensors", above=0.0, add=7.0)


@pytest.mark.parametrize("rules", [(), (RULE,)], ids=["no rule", "rule"])
@pytest.mark.parametrize("name", list(LAYERS))
def test_layer_alone_is_that_of_the_whole_map(
    hand_made: Make, name: str, rules: tuple[CellRule, ...]
) -> None:
    trace = hand_made().trace()
    costs = rating_costs(ratings_of(trace.layout.architectures[0]))
    settings = GridSettings(costs=costs.model_copy(update={"rules": rules}))
    whole = grid_at(trace, 0, 10, settings)
    alone = grid_at(trace, 0, 10, settings, layers=[name])
    assert list(alone.layers) == [name]
    assert np.array_equal(alone[name], whole[name])


def test_time_outside_of_the_run_is_refused(hand_made: Make) -> None:
    for time in (-0.1, 2.1, math.nan):
        error = refused(UsageError, grid_map, hand_made().trace(), 0, time, says="the run has no")
        assert "from 0 to 2 s" in str(error)


def test_unknown_view_is_refused_with_those_that_there_are(hand_made: Make) -> None:
    with pytest.raises(UsageError, match="no view 'safty'") as error:
        grid_map(hand_made().trace(), 0, 0.0, view="safty")
    assert "safety" in str(error.value)


def test_archive_has_layers_axes_and_names(hand_made: Make) -> None:
    found = grid_map(beside(hand_made()).trace(), 0, 0.0)
    again = np.load(io.BytesIO(found.archive()))
    assert set(again) == {*LAYERS, "x", "y", "pose", "time", "view", "place_names"}
    for name in LAYERS:
        assert np.array_equal(again[name], found[name])
    assert (again["pose"].tolist(), str(again["view"])) == ([0.0, 5.25, 0.0], "truth")
    assert again["place_names"].tolist() == list(RULE_NAMES)


def test_trace_without_tracks_has_no_view_of_a_channel(hand_made: Make) -> None:
    made = hand_made()
    made.columns["tracks"] = made.columns["tracks"][:, :, :, :0]
    refused(UsageError, grid_map, made.trace(), 0, 0.0, view="safety", says="no tracks")
