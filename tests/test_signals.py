"""What flows between stages: columns, words, the dictionary, records for compiled stages."""

import re
from typing import Any

import numpy as np
import pytest

from adeye import signals
from adeye import signals as flow

# --- What flows between the stages: columns are numbered as named, commands copy, records pack ----


def test_column_numbers_follow_the_names() -> None:
    for prefix, columns in (
        ("EGO", flow.EGO_COLUMNS),
        ("OBJECT", flow.OBJECT_COLUMNS),
        ("PLACE", flow.PLACE_COLUMNS),
        ("DETECTION", flow.DETECTION_COLUMNS),
        ("REFUGE", flow.REFUGE_COLUMNS),
    ):
        short = {"steering_angle": "STEERING", "road_heading": "HEADING"}
        for number, name in enumerate(columns):
            constant = f"{prefix}_{short.get(name, name.upper())}"
            assert getattr(flow, constant) == number, constant


def test_codes_follow_the_labels_and_reasons_of_stored_traces_keep_their_numbers() -> None:
    statuses = [getattr(flow, label.upper()) for label in flow.STATUS_LABELS]
    reasons = [getattr(flow, f"REASON_{label.upper()}") for label in flow.REASON_LABELS]
    assert statuses == list(range(len(flow.STATUS_LABELS)))
    assert reasons == list(range(len(flow.REASON_LABELS)))
    stored = ("none", "default", "request", "latched", "staleness", "no_channel", "stuck")
    assert flow.REASON_LABELS[: len(stored)] == stored


def test_an_estimate_is_the_ego_state_and_its_place() -> None:
    assert flow.ESTIMATE_COLUMNS[: flow.ESTIMATE_PLACE] == flow.EGO_COLUMNS
    assert flow.ESTIMATE_COLUMNS[flow.ESTIMATE_PLACE :] == flow.PLACE_COLUMNS


def test_copy_of_a_command_is_not_changed_with_it() -> None:
    shapes: dict[str, tuple[int, ...]] = {
        **dict.fromkeys(("acceleration", "steering_angle", "stamp", "status", "chosen"), (2,)),
        "plan": (2, 3, 4),
        "monitors": (2, 1, 2),
        "tracks": (2, 1, 6),
        "candidates": (2, 4, 3, 2),
        "candidate_costs": (2, 4),
    }
    arrays: dict[str, Any] = {name: np.ones(shape) for name, shape in shapes.items()}
    copy = signals.ControlCommand("nominal", **arrays).copy()
    for array in arrays.values():
        array[...] = -5.0
    assert copy.channel == "nominal"
    for name in shapes:
        assert (getattr(copy, name) == 1.0).all(), name
    # What a command does not have its copy has not.
    one = np.zeros(1)
    bare = signals.ControlCommand("safety", one, one, one, np.zeros(1, dtype=np.int64)).copy()
    for name in ("plan", "monitors", "tracks", "candidates", "chosen"):
        assert getattr(bare, name) is None, name


# --- Reasons keep their numbers, because stored traces hold them ----------------------------------


# --- The signal dictionary: what each part brings, with unit, scale and kind ----------------------

SCENE = signals.scene_signals(("lead", "truck"), 3)
PARTS = signals.architecture_signals(
    ("camera",), ("nominal", "safety"), ("danger",), ("camera_out",), ("lead", "truck")
)


def test_scene_and_architecture_share_no_name() -> None:
    assert not SCENE.keys() & PARTS.keys()


def test_every_signal_says_what_it_is() -> None:
    for name, signal in {**SCENE, **PARTS}.items():
        assert re.fullmatch(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*", name)
        assert signal.text, name
        assert signal.scale > 0.0, name
        assert signal.kind in {"number", "boolean", "enumeration"}, name
        assert (signal.kind == "enumeration") == bool(signal.labels), name


def test_every_actor_brings_the_same_signals() -> None:
    lead = {name.removeprefix("actor.lead") for name in SCENE if name.startswith("actor.lead.")}
    truck = {name.removeprefix("actor.truck") for name in SCENE if name.startswith("actor.truck.")}
    assert lead == truck
    assert {".x", ".y", ".heading", ".speed", ".acceleration", ".lane", ".distance", ".gap"} == lead


def test_scene_without_actors_keeps_the_ego() -> None:
    bare = signals.scene_signals((), 2)
    assert not [name for name in bare if name.startswith("actor.")]
    assert {"time", "ego.speed", "ego.lane_offset", "contact", "standstill", "in_odd"} <= set(bare)


def test_lane_names_the_leftmost() -> None:
    assert "0 at the right to 2" in SCENE["ego.lane"].text


def test_units_are_si() -> None:
    assert SCENE["ego.speed"].unit == "m/s"
    assert SCENE["actor.lead.gap"].unit == "m"
    assert PARTS["channel.nominal.acceleration"].unit == "m/s²"
    assert PARTS["sensor.camera.age"].unit == "s"
    assert SCENE["contact"] == signals.SignalType(
        "1", 1.0, "boolean", SCENE["contact"].text, of_objects=True, at_start="false"
    )


def test_parts_bring_their_signals() -> None:
    assert {"authority.nominal", "authority.safety"} <= PARTS.keys()
    assert {"sensor.camera.detects.lead", "sensor.camera.detects.truck"} <= PARTS.keys()
    assert {"channel.nominal.tracks.lead", "channel.safety.tracks.truck"} <= PARTS.keys()
    assert {"monitor.danger.raw", "monitor.danger.confirmed"} <= PARTS.keys()
    assert "fault.camera_out.active" in PARTS
    assert PARTS["channel.safety.status"].labels == signals.STATUS_LABELS
    assert PARTS["switch.reason"].labels == signals.REASON_LABELS


def test_architecture_without_parts_still_has_what_is_about_the_run() -> None:
    about_the_run = {"switch.reason", "safe_state", "faulted"}
    assert set(signals.architecture_signals((), (), (), (), ())) == about_the_run


# --- Who has authority, and the signal dictionary ------------------------------------------------


def test_parameter_record_repeats_scalars_and_keeps_columns() -> None:
    packed = signals.parameter_record({"gain": 2, "range": np.array([80.0, 120.0])})
    assert packed["gain"].tolist() == [2.0, 2.0]
    assert packed["range"].tolist() == [80.0, 120.0]
    assert packed.dtype.names == ("gain", "range")
    assert signals.parameter_record({"gain": 2}).shape == (1,)


def test_parameter_record_of_unequal_columns_is_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        signals.parameter_record({"a": np.zeros(2), "b": np.zeros(3)})


def test_columns_of_specs_follow_the_runs_and_shared_specs_are_read_once() -> None:
    near, far = {"range": 80.0, "rate": 10}, {"range": 120.0, "rate": 20}
    read: list[float] = []

    def numbers(spec: dict[str, float]) -> dict[str, float]:
        read.append(spec["range"])
        return spec

    found = signals.spec_columns([near, far, near, near, far], numbers)
    assert found["range"].tolist() == [80.0, 120.0, 80.0, 80.0, 120.0]
    assert found["rate"].tolist() == [10.0, 20.0, 10.0, 10.0, 20.0]
    assert found["rate"].dtype == np.float64
    assert read == [80.0, 120.0]
    # Equal ones that are two objects are two rows.
    twins = signals.spec_columns([{"range": 80.0}, {"range": 80.0}], lambda spec: spec)
    assert twins["range"].tolist() == [80.0, 80.0]
