import math
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.report.model.report import Report
from adeye.report.page.replay import Line, Replay


def rebuilt(replay: Replay, **changes: Any) -> Replay:
    fields = {name: getattr(replay, name) for name in Replay.model_fields}
    return Replay(**{**fields, **changes})


def test_rows_are_those_of_the_ego(report: Report) -> None:
    replay = report.replays[1]
    assert replay.rows == len(replay.ego.x_m) == 300


@pytest.mark.parametrize(
    ("part", "index", "column"),
    [
        ("ego", None, "speed_mps"),
        ("actors", 0, "heading_rad"),
        ("sensors", 1, "alive"),
        ("sensors", 0, "detections"),
        ("channels", 0, "status"),
        ("channels", 0, "tracks"),
        ("faults", 0, "active"),
        ("signals", 2, "values"),
    ],
)
def test_column_of_another_length_is_refused(
    report: Report, part: str, index: int | None, column: str
) -> None:
    replay = report.replays[0]
    whole = getattr(replay, part)
    one = whole if index is None else whole[index]
    short = one.model_copy(update={column: getattr(one, column)[:-1]})
    changed = short if index is None else (*whole[:index], short, *whole[index + 1 :])
    with pytest.raises(ValidationError, match=rf"{column}|{getattr(one, 'name', '')}"):
        rebuilt(replay, **{part: changed})


@pytest.mark.parametrize("field", ["authority", "reason"])
def test_decisions_have_a_row_per_tick(report: Report, field: str) -> None:
    replay = report.replays[0]
    with pytest.raises(ValidationError, match=f"{field} has"):
        rebuilt(replay, **{field: getattr(replay, field)[1:]})


@pytest.mark.parametrize("channel", [-2, 2])
def test_authority_of_nobody_is_refused(report: Report, channel: int) -> None:
    replay = report.replays[0]
    with pytest.raises(ValidationError, match="names none of the channels"):
        rebuilt(replay, authority=(channel,) * replay.rows)


def test_no_channel_is_an_authority(report: Report) -> None:
    replay = report.replays[0]
    assert set(rebuilt(replay, authority=(-1,) * replay.rows).authority) == {-1}


def test_replay_without_a_tick_is_refused(report: Report) -> None:
    ego = report.replays[0].ego
    columns = {name: () for name in type(ego).model_fields if isinstance(getattr(ego, name), tuple)}
    with pytest.raises(ValidationError, match="at least one tick"):
        rebuilt(report.replays[0], ego=ego.model_copy(update=columns))


def test_line_of_one_point_is_refused() -> None:
    with pytest.raises(ValidationError, match="at least 2"):
        Line(x_m=(0.0,), y_m=(0.0,))


def test_place_that_is_not_finite_is_refused() -> None:
    with pytest.raises(ValidationError, match="finite"):
        Line(x_m=(0.0, math.nan), y_m=(0.0, 0.0))


def test_fans_that_do_not_cover_the_run_are_refused(report: Report) -> None:
    replay = report.replays[0]
    channel = replay.channels[0]
    assert channel.fan is not None
    short = channel.fan.model_copy(update={"fans": channel.fan.fans[:-1]})
    changed = channel.model_copy(update={"fan": short})
    with pytest.raises(ValidationError, match="fans"):
        rebuilt(replay, channels=(changed, *replay.channels[1:]))


@pytest.mark.parametrize("name", ["number", "occupied"])
def test_grid_maps_that_do_not_cover_the_run_are_refused(report: Report, name: str) -> None:
    replay = report.replays[0]
    assert replay.grid is not None
    short = replay.grid.model_copy(update={name: getattr(replay.grid, name)[:-1]})
    with pytest.raises(ValidationError, match=f"grid.{name} has"):
        rebuilt(replay, grid=short)
