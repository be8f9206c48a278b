"""The trace: its digest covers every judged value of its run, and nothing beyond its length."""

from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.signals import RoadMap, SceneContext, Surroundings
from adeye.spec.load import load_architecture
from adeye.trace import COLUMNS, DRAWN, LINK_TICKS, PRESENCE, ChannelEvent, Layout, Trace
from tests.stored import known

ARCHITECTURE = Path(__file__).parents[1] / "odd" / "architectures" / "camera_radar.yaml"

RUNS, ROWS, OBJECTS, SENSORS, CHANNELS, MONITORS, FAULTS, EVENTS, TRACKS = 2, 4, 2, 2, 2, 1, 1, 1, 3
SHAPES: dict[str, tuple[int, ...]] = {
    "ego": (7,),
    "ego_place": (6,),
    "objects": (OBJECTS, 5),
    "object_places": (OBJECTS, 6),
    "begun": (EVENTS,),
    "contact": (),
    "impact_speed": (),
    "foreign_contact": (),
    "sensor_stamp": (SENSORS,),
    "sensor_alive": (SENSORS,),
    "detected": (SENSORS, OBJECTS),
    "detections": (SENSORS, OBJECTS, 2),
    "points": (1, 5, 2),
    "acceleration": (CHANNELS,),
    "steering_angle": (CHANNELS,),
    "stamp": (CHANNELS,),
    "status": (CHANNELS,),
    "monitors": (MONITORS, 2),
    "tracks": (CHANNELS, TRACKS, 6),
    "track_error": (CHANNELS, OBJECTS, 2),
    "false_tracks": (CHANNELS,),
    "candidates": (CHANNELS, 2, 3, 2),
    "candidate_costs": (CHANNELS, 2),
    "chosen": (CHANNELS,),
    "authority": (),
    "reason": (),
    "command": (2,),
    "fault_active": (FAULTS,),
}
BOOLS = {"foreign_contact", "sensor_alive", "detected", "monitors", "fault_active"}
INTS = {"chosen", "contact", "status", "false_tracks", "authority", "reason"}
LENGTH = (4, 3)


def context() -> SceneContext:
    """Make what does not change during the runs; every number differs from run to run."""
    each, segments = np.arange(1.0, RUNS + 1), np.arange(RUNS * 5.0).reshape(RUNS, 1, 5)
    return SceneContext(
        step=0.05,
        object_ids=("lead", "truck"),
        object_classes=np.array([0, 7]),
        actor_count=1,
        object_sizes=np.arange(RUNS * OBJECTS * 3.0).reshape(RUNS, OBJECTS, 3),
        object_reflectivity=np.arange(RUNS * OBJECTS * 1.0).reshape(RUNS, OBJECTS),
        ego_size=np.arange(RUNS * 3.0).reshape(RUNS, 3),
        road=RoadMap(segments, each, 2, each, each, each, np.zeros((RUNS, 0, 5)), each),
        surroundings=Surroundings(
            each, each, each, np.array([False, True]), each + 1.0, each + 2.0, each + 3.0
        ),
        stream_seeds=np.arange(RUNS, dtype=np.uint64),
        event_ids=("brakes",),
    )


LAYOUT = Layout(
    scenario="follow",
    architecture=load_architecture(ARCHITECTURE).spec,
    architectures=tuple(load_architecture(ARCHITECTURE).spec for _ in range(RUNS)),
    sensors=("camera", "radar"),
    channels=("nominal", "safety"),
    monitors=("danger",),
    faults=("camera_out",),
    context=context(),
    horizon=0.1,
    tail=0.05,
    realised=("brakes",),
)


def make(**changes: Any) -> Trace:
    """Make a trace of two runs, the second one row shorter, with different numbers everywhere."""
    columns = {}
    for number, (name, shape) in enumerate(SHAPES.items()):
        size = (RUNS, ROWS, *shape)
        values = np.arange(np.prod(size), dtype=np.float64).reshape(size) + 0.25 * number
        kind: Any = np.bool_ if name in BOOLS else np.int64 if name in INTS else np.float64
        columns[name] = (values % 2 < 1) if name in BOOLS else values.astype(kind)
    parts: dict[str, Any] = {
        "layout": LAYOUT,
        "time": np.arange(ROWS) * 0.05,
        "length": np.array(LENGTH),
        "horizon_row": np.array([2, 2]),
        "complete": np.array([True, False]),
        "columns": columns,
        "channel_events": (None, ChannelEvent("channel_error", "nominal", 0.1, "no licence")),
        "case_digests": ("a", "b"),
    }
    return Trace(**{**parts, **changes})


def touch(trace: Trace, name: str, place: tuple[int, ...]) -> None:
    """Change one value of a column."""
    column = trace.columns[name]
    column[place] = ~column[place] if name in BOOLS else column[place] + 1


def test_scene_covers_every_column() -> None:
    assert set(SHAPES) == set(COLUMNS)


def test_digest_is_128_bits_and_the_same_for_the_same_values() -> None:
    first, second = make().digests()
    assert [len(first), len(second)] == [32, 32]
    assert make().digests() == [first, second]
    assert first != second


def digests_with(name: str, run: int, row: int) -> list[str]:
    """Return the digests with another value in a row of a column."""
    trace = make()
    touch(trace, name, (run, row, *(0 for _ in SHAPES[name])))
    return trace.digests()


@pytest.mark.parametrize("row", range(LENGTH[0]))
def test_digest_changes_with_any_value_of_its_run_only(row: int) -> None:
    before = make().digests()
    for name in set(COLUMNS) - DRAWN:
        after = digests_with(name, 0, row)
        assert after[0] != before[0], name
        assert after[1] == before[1], name


def test_digest_leaves_out_what_only_pictures_need_and_rows_beyond_the_length() -> None:
    before = make().digests()
    for name in DRAWN:
        assert digests_with(name, 0, 0) == before, name
    for name in COLUMNS:
        assert digests_with(name, 1, LENGTH[1]) == before, name


def test_digest_covers_length_horizon_end_and_clock() -> None:
    changes: dict[str, Any] = {
        "length": np.array([3, 3]),
        "horizon_row": np.array([1, 2]),
        "complete": np.array([False, False]),
        "time": np.arange(ROWS) * 0.06,
    }
    for name, change in changes.items():
        assert make(**{name: change}).digests()[0] != make().digests()[0], name


def test_digest_covers_type_and_shape() -> None:
    before = make().digests()[0]
    other = make()
    narrow: Any = other.columns["contact"].astype(np.int32)
    other.columns["contact"] = narrow
    assert other.digests()[0] != before
    reshaped = make()
    reshaped.columns["command"] = reshaped.columns["command"].reshape(RUNS, ROWS, 1, 2)
    assert reshaped.digests()[0] != before


def test_digest_tells_the_sign_of_zero_and_nan_from_zero() -> None:
    found = set()
    for value in (0.0, -0.0, np.nan):
        trace = make()
        trace.columns["begun"][0, 0] = value
        found.add(trace.digests()[0])
    assert len(found) == 3


@pytest.mark.slow
def test_digest_does_not_depend_on_memory_order_or_batch() -> None:
    trace = make()
    fortran = {name: np.asfortranarray(column) for name, column in trace.columns.items()}
    assert make(columns=fortran).digests() == trace.digests()
    alone = [trace.select([run]).digests()[0] for run in range(RUNS)]
    assert alone == trace.digests()


def test_channel_events_and_case_are_no_part_of_the_values() -> None:
    other = make(channel_events=(None, None), case_digests=("c", "d"))
    assert other.digests() == make().digests()


def test_selection_keeps_everything_in_the_asked_order() -> None:
    chosen = make().select([1, 0])
    assert chosen.runs == 2
    assert chosen.digests() == make().digests()[::-1]
    assert chosen.length.tolist() == [3, 4]
    assert chosen.case_digests == ("b", "a")
    event = chosen.channel_events[0]
    assert known(event).channel == "nominal"
    assert make().select([]).runs == 0


def test_selection_keeps_the_surroundings_of_its_runs() -> None:
    kept = make().select([1]).layout.context
    whole = LAYOUT.context
    assert kept.runs == 1
    assert kept.object_ids == whole.object_ids
    for name in (
        *("ego_size", "object_sizes", "object_reflectivity", "stream_seeds", "road.segments"),
        *("road.speed_limit", "surroundings.night", "surroundings.friction"),
    ):
        found, wanted = (attrgetter(name)(each) for each in (kept, whole))
        assert found.tolist() == wanted[[1]].tolist(), name


def test_column_is_had_by_its_name() -> None:
    trace = make()
    assert trace["ego"] is trace.columns["ego"]
    with pytest.raises(KeyError):
        trace["egg"]


LONG = 2 * LINK_TICKS + 50


def long(lengths: tuple[int, int] = (LONG, LINK_TICKS + 20)) -> Trace:
    """Make a trace of two runs that are long enough for links."""
    short = make()
    columns: dict[str, Any] = {
        name: np.tile(values, (1, LONG // ROWS + 1, *([1] * (values.ndim - 2))))[:, :LONG].copy()
        for name, values in short.columns.items()
    }
    time = np.arange(LONG) * 0.05
    return make(columns=columns, time=time, length=np.array(lengths))


def test_chain_has_a_link_for_every_hundred_rows_and_ends_with_the_digest() -> None:
    trace = long()
    assert [len(chain) for chain in trace.chains()] == [4, 3]
    assert [chain[-1] for chain in trace.chains()] == trace.digests()
    assert [len(chain) for chain in make().chains()] == [2, 2]


def test_links_before_a_change_stay_and_those_after_it_change() -> None:
    plain = long().chains()
    for name in set(COLUMNS) - DRAWN:
        trace = long()
        touch(trace, name, (0, LINK_TICKS + 10, *(0 for _ in SHAPES[name])))
        changed = trace.chains()
        same = [left == right for left, right in zip(plain[0], changed[0], strict=True)]
        assert same == [True, False, name == PRESENCE, False], name
        assert plain[1] == changed[1], name


def test_chain_does_not_depend_on_the_batch_nor_its_links_on_how_long_the_run_goes_on() -> None:
    both = long()
    assert [both.select([run]).chains()[0] for run in (0, 1)] == both.chains()
    assert both.chains()[0][:1] == long((LINK_TICKS + 1, LONG)).chains()[0][:1]
