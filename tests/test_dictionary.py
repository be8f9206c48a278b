"""The signal dictionary: what each part brings, with unit, scale and kind."""

from __future__ import annotations

import re

import pytest

from adeye.signals import (
    REASON_LABELS,
    STATUS_LABELS,
    SignalType,
    architecture_signals,
    scene_signals,
)

SCENE = scene_signals(("lead", "truck"), 3)
PARTS = architecture_signals(
    ("camera",), ("nominal", "safety"), ("danger",), ("camera_out",), ("lead", "truck")
)


def test_scene_and_architecture_share_no_name() -> None:
    assert not SCENE.keys() & PARTS.keys()


@pytest.mark.parametrize("name", [*SCENE, *PARTS])
def test_every_signal_says_what_it_is(name: str) -> None:
    signal = {**SCENE, **PARTS}[name]
    assert re.fullmatch(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*", name)
    assert signal.text
    assert signal.scale > 0.0
    assert signal.kind in {"number", "boolean", "enumeration"}
    assert (signal.kind == "enumeration") == bool(signal.labels)


def test_every_actor_brings_the_same_signals() -> None:
    lead = {name.removeprefix("actor.lead") for name in SCENE if name.startswith("actor.lead.")}
    truck = {name.removeprefix("actor.truck") for name in SCENE if name.startswith("actor.truck.")}
    assert lead == truck
    assert {".x", ".y", ".heading", ".speed", ".acceleration", ".lane", ".distance", ".gap"} == lead


def test_scene_without_actors_keeps_the_ego() -> None:
    bare = scene_signals((), 2)
    assert not [name for name in bare if name.startswith("actor.")]
    assert {"time", "ego.speed", "ego.lane_offset", "contact", "standstill", "in_odd"} <= set(bare)


def test_lane_names_the_leftmost() -> None:
    assert "0 at the right to 2" in SCENE["ego.lane"].text


def test_units_are_si() -> None:
    assert SCENE["ego.speed"].unit == "m/s"
    assert SCENE["actor.lead.gap"].unit == "m"
    assert PARTS["channel.nominal.acceleration"].unit == "m/s²"
    assert PARTS["sensor.camera.age"].unit == "s"
    assert SCENE["contact"] == SignalType("1", 1.0, "boolean", SCENE["contact"].text)


def test_parts_bring_their_signals() -> None:
    assert {"authority.nominal", "authority.safety"} <= PARTS.keys()
    assert {"sensor.camera.detects.lead", "sensor.camera.detects.truck"} <= PARTS.keys()
    assert {"channel.nominal.tracks.lead", "channel.safety.tracks.truck"} <= PARTS.keys()
    assert {"monitor.danger.raw", "monitor.danger.confirmed"} <= PARTS.keys()
    assert "fault.camera_out.active" in PARTS
    assert PARTS["channel.safety.status"].labels == STATUS_LABELS
    assert PARTS["switch.reason"].labels == REASON_LABELS


def test_architecture_without_parts_still_has_what_is_about_the_run() -> None:
    about_the_run = {"switch.reason", "safe_state", "faulted"}
    assert set(architecture_signals((), (), (), (), ())) == about_the_run
