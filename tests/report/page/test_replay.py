"""What a page embeds of a run, packed and unpacked; the player that shows it."""

import itertools
import json
import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from pydantic import ValidationError

from adeye.report.model.report import Report
from adeye.report.page.drive import desirability, fan_of
from adeye.report.page.replay import Line, Replay, differences, pack_replay, repeats, script_text
from adeye.trace import Trace
from tests.refusals import refused
from tests.stored import known


def rebuilt(replay: Replay, **changes: Any) -> Replay:
    fields = {name: getattr(replay, name) for name in Replay.model_fields}
    return Replay(**{**fields, **changes})


def test_column_of_another_length_is_refused(report: Report) -> None:
    replay = report.replays[0]
    for part, index, column in (
        ("ego", None, "speed_mps"),
        ("actors", 0, "heading_rad"),
        ("sensors", 1, "alive"),
        ("sensors", 0, "detections"),
        ("channels", 0, "status"),
        ("channels", 0, "tracks"),
        ("faults", 0, "active"),
        ("signals", 2, "values"),
    ):
        whole = getattr(replay, part)
        one = whole if index is None else whole[index]
        short = one.model_copy(update={column: getattr(one, column)[:-1]})
        changed = short if index is None else (*whole[:index], short, *whole[index + 1 :])
        with pytest.raises(ValidationError, match=rf"{column}|{getattr(one, 'name', '')}"):
            rebuilt(replay, **{part: changed})
    for field in ("authority", "reason"):
        with pytest.raises(ValidationError, match=f"{field} has"):
            rebuilt(replay, **{field: getattr(replay, field)[1:]})


def test_authority_is_a_channel_or_none(report: Report) -> None:
    replay = report.replays[0]
    for channel in (-2, 2):
        with pytest.raises(ValidationError, match="names none of the channels"):
            rebuilt(replay, authority=(channel,) * replay.rows)
    assert set(rebuilt(replay, authority=(-1,) * replay.rows).authority) == {-1}


def test_replay_without_a_tick_is_refused(report: Report) -> None:
    ego = report.replays[0].ego
    columns = {name: () for name in type(ego).model_fields if isinstance(getattr(ego, name), tuple)}
    with pytest.raises(ValidationError, match="at least one tick"):
        rebuilt(report.replays[0], ego=ego.model_copy(update=columns))


def test_line_of_one_point_or_without_a_place_is_refused() -> None:
    refused(ValidationError, Line, x_m=(0.0,), y_m=(0.0,), says="at least 2")
    refused(ValidationError, Line, x_m=(0.0, math.nan), y_m=(0.0, 0.0), says="finite")


def test_fans_and_maps_that_do_not_cover_the_run_are_refused(report: Report) -> None:
    replay = report.replays[0]
    channel, grid = replay.channels[0], known(replay.grid)
    fan = known(channel.fan)
    short: Any = fan.model_copy(update={"fans": fan.fans[:-1]})
    changed = channel.model_copy(update={"fan": short})
    refused(ValidationError, rebuilt, replay, channels=(changed, *replay.channels[1:]), says="fans")
    for name in ("number", "occupied"):
        short = grid.model_copy(update={name: getattr(grid, name)[:-1]})
        refused(ValidationError, rebuilt, replay, grid=short, says=f"grid.{name} has")


def numbers(packed: dict[str, Any]) -> list[float | None]:
    """Read back what ``differences`` packed, as the page does."""
    steps, values = 0, []
    for difference in packed["d"]:
        steps += difference or 0
        values.append(None if difference is None else steps / packed["k"])
    return values


def column(packed: Sequence[Any]) -> list[Any]:
    """Read back what ``repeats`` packed, as the page does."""
    pairs = zip(packed[::2], packed[1::2], strict=True)
    return list(itertools.chain.from_iterable([value] * count for value, count in pairs))


def test_differences_read_back_within_half_a_step_and_rounding_does_not_add_up() -> None:
    columns: list[list[float | None]] = [[], [0.0], [1.5, -2.25, 1e6], [None, 1.0, None, 0.999]]
    columns.append([index / 3.0 for index in range(10_000)])
    for values in columns:
        again = numbers(differences(values, 1000))
        assert [value is None for value in again] == [value is None for value in values]
        for one, other in zip(again, values, strict=True):
            assert one == (None if other is None else pytest.approx(other, abs=0.0005000001))


def test_repeats_read_back() -> None:
    columns: list[list[Any]] = [[], [True], [1, 1, 2, 1], ["ok", "ok", "silent"]]
    for values in columns:
        assert column(repeats(values)) == values


def test_packed_run_reads_back_with_detections_and_tracks_tick_by_tick(report: Report) -> None:
    replay = report.replays[0]
    packed = pack_replay(replay)
    assert packed["rows"] == replay.rows == len(replay.ego.x_m)
    assert numbers(packed["ego"]["x"]) == pytest.approx(replay.ego.x_m, abs=0.00051)
    assert numbers(packed["ego"]["heading"]) == pytest.approx(replay.ego.heading_rad, abs=0.000051)
    assert column(packed["authority"]) == list(replay.authority)
    assert column(packed["channels"][0]["status"]) == list(replay.channels[0].status)
    assert column(packed["faults"][0]["active"]) == list(replay.faults[0].active)
    grid, maps = packed["grid"], known(replay.grid)
    assert column(grid["number"]) == list(maps.number)
    assert column(grid["occupied"]) == list(maps.occupied)
    assert grid["levels"] == [1.0, 3.0, 7.0]
    assert pack_replay(replay.model_copy(update={"grid": None}))["grid"] is None
    sensor = packed["sensors"][0]
    found = list(zip(numbers(sensor["dx"]), numbers(sensor["dy"]), strict=True))
    counts = column(sensor["count"])
    ends = list(itertools.accumulate(counts))
    for end, count, sample in zip(ends, counts, replay.sensors[0].detections, strict=True):
        for one, other in zip(found[end - count : end], sample, strict=True):
            assert one == pytest.approx(other, abs=0.00051)
    tracks = packed["channels"][0]["tracks"]
    assert replay.channels[0].tracks is not None
    assert column(tracks["count"]) == [len(row) for row in replay.channels[0].tracks]
    assert len(tracks["columns"]) == 6
    assert packed["channels"][1]["tracks"] is None


def test_returns_read_back_tick_by_tick_and_each_sample_is_there_once(report: Report) -> None:
    replay = report.replays[0]
    one = tuple((10.0 + 0.1 * k, -3.0) for k in range(5))
    samples = (one, one, (), *[((1.25, 2.0), (-7.5, 0.5))] * (replay.rows - 3))
    sensor = replay.sensors[0].model_copy(update={"points": samples})
    packed = pack_replay(replay.model_copy(update={"sensors": (sensor,)}))["sensors"][0]["points"]
    assert packed["rows"] == [2, 1, replay.rows - 3]
    assert packed["count"] == [5, 0, 2]
    found = list(zip(numbers(packed["x"]), numbers(packed["y"]), strict=True))
    expected = [point for sample in (one, samples[-1]) for point in sample]
    assert np.array(found) == pytest.approx(np.array(expected), abs=0.0501)
    assert pack_replay(replay)["sensors"][0]["points"] is None


def test_signal_keeps_four_digits_of_its_largest_value(report: Report) -> None:
    replay = report.replays[1]
    for size in (1e-5, 0.02, 1.0, 40.0, 3e5):
        values = tuple(size * (row % 7) / 6.0 for row in range(replay.rows))
        signal = replay.signals[0].model_copy(update={"values": values})
        packed = pack_replay(replay.model_copy(update={"signals": (signal,)}))
        allowed = max(size * 1e-4, 1e-6)
        assert numbers(packed["signals"][0]["values"]) == pytest.approx(values, abs=allowed)


def test_script_text_is_strict_json_without_markup() -> None:
    value = {"a": "</script><!--", "b": "\u2028\u2029", "c": "ä", "d": [None, True, 1.5]}
    text = script_text(value)
    assert json.loads(text) == value
    assert not set("<\u2028\u2029") & set(text)
    refused(ValueError, script_text, {"a": float("nan")}, says="not JSON compliant")


def test_fan_reads_back_candidate_by_candidate(report: Report) -> None:
    channel = report.replays[0].channels[0]
    packed = pack_replay(report.replays[0])["channels"][0]["fan"]
    assert channel.fan is not None
    listed = [candidate for fan in channel.fan.fans for candidate in fan]
    assert column(packed["count"]) == [len(fan) for fan in channel.fan.fans]
    assert column(packed["points"]) == [len(candidate.points) for candidate in listed]
    assert column(packed["chosen"]) == [candidate.is_chosen for candidate in listed]
    desirable = [candidate.desirability for candidate in listed]
    assert numbers(packed["desirability"]) == pytest.approx(desirable, abs=0.025)
    places = list(zip(numbers(packed["x"]), numbers(packed["y"]), strict=True))
    wanted = [point for candidate in listed for point in candidate.points]
    assert np.array(places) == pytest.approx(np.array(wanted), abs=0.0501)
    assert "fan" not in pack_replay(report.replays[0])["channels"][1]


# --- The fan of a channel, from a trace to what is drawn ------------------------------------------

ROWS, CANDIDATES, POINTS = 25, 4, 3


def trace(costs: list[float], chosen: int, places: Any = None) -> Trace:
    """Make what is read of a trace of one run with two channels, of which the first has a fan."""
    shape = (1, ROWS, 2, CANDIDATES)
    fan = np.full((*shape, POINTS, 2), np.nan)
    fan[:, :, 0] = np.arange(POINTS * 2.0).reshape(POINTS, 2) * 10.04 if places is None else places
    each = np.full(shape, np.nan)
    each[:, :, 0] = costs
    columns = {
        "candidates": fan.astype(np.float32),
        "candidate_costs": each.astype(np.float32),
        "chosen": np.full((1, ROWS, 2), chosen, dtype=np.int16),
    }
    context = SimpleNamespace(step=0.05)

    class Made(SimpleNamespace):
        def __getitem__(self, name: str) -> Any:
            return columns[name]

    return cast("Trace", Made(layout=SimpleNamespace(context=context)))


def drawn(costs: list[float], chosen: int = 0, **more: Any) -> Any:
    held = np.minimum(np.arange(ROWS), ROWS - 2)
    return fan_of(trace(costs, chosen, **more), 0, 0, held)


def test_fan_is_drawn_twice_a_second() -> None:
    view = drawn([1.0, 2.0, 3.0, 4.0])
    assert view.every == 10
    assert len(view.fans) == 3


def test_best_is_drawn_last_and_shaded_most_but_for_the_chosen_one() -> None:
    fan = drawn([5.0, 1.0, 90.0, math.inf], chosen=1).fans[0]
    shades = [candidate.desirability for candidate in fan]
    assert shades == sorted(shades)
    assert (shades[0], shades[-1]) == (0.0, 1.0)
    assert [candidate.is_chosen for candidate in fan] == [False, False, False, True]
    fan = drawn([5.0, 1.0, 90.0, 95.0], chosen=0).fans[0]
    assert fan[-1].is_chosen
    assert fan[-1].desirability < 1.0


def test_candidate_and_fan_that_do_not_exist_are_not_drawn() -> None:
    assert len(drawn([1.0, 2.0, math.nan, 3.0]).fans[0]) == 3
    assert fan_of(trace([1.0] * CANDIDATES, 0), 0, 1, np.arange(ROWS)) is None


def test_place_of_the_ego_is_left_out_and_the_others_are_in_decimetres() -> None:
    (first, *_) = drawn([1.0, 2.0, 3.0, 4.0]).fans[0]
    assert first.points == ((20.1, 30.1), (40.2, 50.2))


def test_dearer_is_less_desirable() -> None:
    for cost in (1.0, 3.0, 50.0, 999.0):
        assert 1.0 > desirability(cost + 1.0, 1.0) > desirability(cost + 2.0, 1.0) >= 0.0
