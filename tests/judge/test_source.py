"""Signals of a trace: every name of the dictionary, and what holds at which row."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.stl.series import SampleStatus
from adeye.judge.trace_signals import TraceSignals, is_decision, plan_dictionary, trace_dictionary
from adeye.signals import EGO_HEADING, SILENT
from adeye.spec.odd import Attributes
from adeye.trace import NO_TRACKS
from tests.judge.stl.batch import errors_of
from tests.refusals import refused
from tests.stored import known


def signals(made: Any, **options: Any) -> TraceSignals:
    inside = options.pop("inside", np.ones(made.runs, dtype=bool))
    return TraceSignals(made.trace(), inside, **options)


def values(made: Any, name: str, **options: Any) -> Any:
    series = signals(made, **options).series(name)
    assert not errors_of(series).any()
    return np.asarray(series.values[0], dtype=float)


def test_every_name_of_the_dictionary_can_be_read(hand_made: Any) -> None:
    source = signals(hand_made(runs=2, objects=("lead", "other")), faults=("never",))
    assert len(source.dictionary) > 60
    for name, declared in source.dictionary.items():
        series = source.series(name)
        assert series.values.shape == (2, 21), name
        assert (series.unit, series.kind, series.labels) == (
            declared.unit,
            declared.kind,
            declared.labels,
        )
        assert not errors_of(series).any(), name


def test_plan_and_trace_have_the_same_dictionary(
    hand_made: Any, scenario: Any, architecture: Any
) -> None:
    made = hand_made(objects=("lead", "other"), faults=("camera_out",))
    planned = plan_dictionary(
        scenario("lead", "other"), architecture(), ["camera_out", "never"], ["danger"]
    )
    assert planned == trace_dictionary(made.trace().layout, ["never"])


def test_unknown_signal_is_a_key_error(hand_made: Any) -> None:
    refused(KeyError, signals(hand_made()).series, "ego.sped")


def test_inside_odd_needs_one_entry_per_run(hand_made: Any) -> None:
    refused(ValueError, signals, hand_made(runs=2), inside=np.ones(1, dtype=bool), says="shape")


@pytest.mark.parametrize(
    ("name", "decided"),
    [("authority.safety", True), ("sensor.camera.alive", True), ("ego.speed", False)],
)
def test_decisions_are_told_from_scenes(name: str, *, decided: bool) -> None:
    assert is_decision(name) is decided


def test_last_row_has_no_decision(hand_made: Any) -> None:
    for name in (
        "channel.nominal.status",
        "channel.nominal.tracks.lead",
        "authority.safety",
        "switch.reason",
        "sensor.camera.age",
        "monitor.danger.raw",
        "fault.camera_out.active",
        "faulted",
    ):
        status = signals(hand_made(faults=("camera_out",))).series(name).status
        assert status is not None, name
        assert status[0, -1] == SampleStatus.NOT_APPLICABLE, name
        assert np.all(status[0, :-1] == SampleStatus.VALUE), name


def test_command_of_a_silent_channel_does_not_apply_but_its_status_does(hand_made: Any) -> None:
    made = hand_made().set("status", SILENT, rows=4, at=0)
    source = signals(made)
    command, state = (
        source.series(f"channel.nominal.{what}") for what in ("acceleration", "status")
    )
    assert known(command.status)[0, 4] == SampleStatus.NOT_APPLICABLE
    assert known(state.status)[0, 4] == SampleStatus.VALUE
    assert state.labels[int(state.values[0, 4])] == "silent"


def test_track_of_an_actor_is_a_truth_value(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other"))
    made.columns["track_error"][0, 3:, 0, 1] = 0.0
    assert values(made, "channel.nominal.tracks.other")[:5].tolist() == [0, 0, 0, 1, 1]
    assert not values(made, "channel.nominal.tracks.lead")[:-1].any()
    assert not values(made, "channel.safety.tracks.other")[:-1].any()


def test_silent_channel_tracks_nothing_and_one_without_tracks_does_not_say(hand_made: Any) -> None:
    made = hand_made().set("false_tracks", NO_TRACKS, rows=slice(4, 7), at=0)
    made.set("status", SILENT, rows=5, at=0)
    series = signals(made).series("channel.nominal.tracks.lead")
    unknown = SampleStatus.NOT_APPLICABLE
    assert known(series.status)[0, 3:8].tolist() == [0, unknown, 0, unknown, 0]
    assert not series.values[0, 5]


def test_age_counts_from_the_start_before_the_first_sample(hand_made: Any) -> None:
    made = hand_made().set("sensor_stamp", -1.0, rows=slice(0, 3), at=0)
    made.set("sensor_stamp", 0.2, rows=slice(3, 21), at=0)
    age = values(made, "sensor.camera.age")
    np.testing.assert_allclose(age[:6], [0.0, 0.1, 0.2, 0.1, 0.2, 0.3], atol=1e-12)


def test_columns_arrive_under_their_names(hand_made: Any) -> None:
    made = hand_made(objects=("lead", "other"))
    made.ego(acceleration=-1.5, steering_angle=0.02, d=9.0)
    made.object("other", d=1.0, speed=7.0, acceleration=0.5).set("monitors", value=True, rows=2)
    made.set("detected", value=True, rows=5).set("authority", 1, rows=6)
    made.set("acceleration", -3.0, rows=7, at=1).set("fault_active", value=True, rows=8, at=0)
    expected = {
        ("ego.acceleration", 0): -1.5,
        ("ego.steering_angle", 0): 0.02,
        ("ego.y", 0): 9.0,
        ("ego.lane", 0): 2.0,
        ("ego.lane_offset", 0): 0.25,
        ("actor.other.speed", 0): 7.0,
        ("actor.other.acceleration", 0): 0.5,
        ("actor.other.lane", 0): 0.0,
        ("actor.lead.gap", 0): 40.0,
        ("actor.lead.distance", 0): np.hypot(40.0, 1.75),
        ("any_actor.distance", 0): np.hypot(40.0, 1.75),
        ("monitor.danger.confirmed", 2): 1.0,
        ("monitor.danger.raw", 3): 0.0,
        ("sensor.truth.detects.other", 5): 1.0,
        ("sensor.truth.detects.other", 6): 0.0,
        ("authority.safety", 6): 1.0,
        ("authority.nominal", 6): 0.0,
        ("channel.safety.acceleration", 7): -3.0,
        ("fault.camera_out.active", 8): 1.0,
        ("fault.camera_out.active", 9): 0.0,
        ("faulted", 7): 0.0,
        ("faulted", 8): 1.0,
        ("faulted", 9): 1.0,
        ("time", 9): 0.9,
    }
    for (name, row), value in expected.items():
        assert values(made, name)[row] == pytest.approx(value), name


def test_actor_signals_say_whom_they_are_about(hand_made: Any) -> None:
    series = signals(hand_made(objects=("lead", "other"))).series("actor.other.speed")
    assert series.actor is not None
    assert np.all(series.actor == 1)


def test_fault_of_another_entry_is_never_active(hand_made: Any) -> None:
    assert not values(hand_made(), "fault.brake_loss.active", faults=["brake_loss"]).any()


def test_safe_state_is_standstill_on_lane_or_shoulder(hand_made: Any) -> None:
    for speed, d, stands, safe in (
        (0.0, 5.25, True, True),
        (0.05, -1.9, True, True),
        (-0.05, 5.25, True, True),
        (0.06, 5.25, False, False),
        (0.0, -2.1, True, False),
        (0.0, 10.6, True, False),
    ):
        made = hand_made().ego(speed=speed, d=d)
        assert values(made, "standstill").all() == stands, speed
        assert values(made, "safe_state").all() == safe, speed


def test_contact_is_no_safe_state(hand_made: Any) -> None:
    made = hand_made().ego(speed=0.0).touch(4, "lead")
    assert values(made, "safe_state")[:5].tolist() == [1.0, 1.0, 1.0, 1.0, 0.0]
    assert values(made, "contact")[:5].tolist() == [0.0, 0.0, 0.0, 0.0, 1.0]


def test_odd_is_left_by_speed_or_by_leaving_the_road(hand_made: Any) -> None:
    for speed, d, planned, inside in (
        (36.0, 5.25, True, True),
        (37.0, 5.25, True, False),
        (36.0, -3.0, True, False),
        (36.0, 5.25, False, False),
    ):
        attributes = Attributes.model_validate(
            {"dynamic_elements": {"ego_speed": {"max": "130 km/h"}}}
        )
        made = hand_made().ego(speed=speed, d=d)
        found = values(made, "in_odd", inside=np.array([planned]), attributes=attributes)
        assert found.all() == inside == found.any(), speed


@pytest.mark.parametrize(
    ("d", "turned", "part", "wrong"),
    [
        (5.25, 0.0, "driving", False),
        (5.25, 3.0, "driving", True),
        (-1.0, 3.0, "shoulder", False),
        (-2.6, 0.0, "off", False),
        (10.6, 0.0, "off", False),
    ],
)
def test_the_road_says_what_holds_where_the_ego_is(
    hand_made: Any, d: float, turned: float, part: str, *, wrong: bool
) -> None:
    made = hand_made().ego(d=d)
    made.columns["ego"][..., EGO_HEADING] += turned
    series = signals(made).series("ego.strip")
    assert series.labels[int(series.values[0, 0])] == part
    assert bool(values(made, "ego.wrong_way")[0]) is wrong
    limit = made.trace().layout.context.road.speed_limit[0]
    assert (values(made, "ego.speed_limit") == limit).all()


def test_odd_without_a_speed_limit_has_none(hand_made: Any) -> None:
    assert values(hand_made().ego(speed=90.0), "in_odd").all()
    assert not values(hand_made().ego(d=-3.0), "in_odd").any(), "it is left with the road"


@pytest.mark.parametrize("name", ["standstill", "safe_state", "in_odd", "ego.speed"])
def test_unknown_speed_is_an_error_not_a_truth_value(hand_made: Any, name: str) -> None:
    made = hand_made().ego(speed=np.nan)
    assert errors_of(signals(made).series(name)).all()


@pytest.mark.parametrize(
    "name", ["ego.on_road", "ego.lane", "ego.lane_offset", "ego.strip", "ego.wrong_way", "in_odd"]
)
def test_unknown_place_is_an_error(hand_made: Any, name: str) -> None:
    made = hand_made()
    made.columns["ego_place"][:] = np.nan
    made.columns["ego_place"][..., 4] = -1.0
    assert errors_of(signals(made).series(name)).all()
