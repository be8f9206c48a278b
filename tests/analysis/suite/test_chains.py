"""Reaction chains: each wait counted once, brakes limited by the weakest."""

from typing import Any

import numpy as np
import pytest

from adeye.analysis.suite.conditions import DEFAULTS, Condition
from adeye.analysis.suite.records import Chain
from adeye.analysis.suite.speeds import MARGIN, SAFETY_HITS, braking_of, chains_of, needed_ranges_of
from adeye.kernel.criticality import stopping_distance
from adeye.kernel.motion import GRAVITY
from tests.analysis.suite.rigs import architecture, radar

DRY = DEFAULTS[0]


def chain(sensor: dict[str, Any] | None = None, **changes: Any) -> Chain:
    (found,) = chains_of(architecture({"eye": sensor or radar()}, **changes))
    return found


def channel(**content: Any) -> dict[str, Any]:
    return {"nominal": {"kind": "nominal", "links": ["eye"], "rate": 20.0, **content}}


def test_waits_of_the_built_in_nominal_channel() -> None:
    found = chain(radar(rate=10.0, latency=0.1, jitter=0.02))
    assert found.sense_s == pytest.approx(0.1 + 0.1 + 0.02)
    assert found.confirm_s == pytest.approx(2 * 0.1)
    assert found.decide_s == pytest.approx(0.05 + 0.05)
    assert found.act_s == pytest.approx(0.15)
    assert found.total_s == pytest.approx(0.67)
    assert not found.is_assumed


def test_first_hit_confirms_where_one_is_enough() -> None:
    found = chain(channels=channel(parameters={"confirm_hits": 1}))
    assert found.confirm_s == 0.0


def test_brakes_are_as_weak_as_the_weakest_of_channel_vehicle_and_grip() -> None:
    strong = chain(channels=channel(parameters={"emergency_deceleration": 20.0}))
    weak = chain(channels=channel(parameters={"emergency_deceleration": 3.0}))
    ice = Condition("ice", 0.0, 1e4, "day", 0.2)
    assert braking_of(strong, Condition("track", 0.0, 1e4, "day", 2.0)) == 9.0
    assert braking_of(weak, DRY) == 3.0
    assert braking_of(strong, ice) == pytest.approx(0.2 * GRAVITY)


def test_safety_channel_waits_for_its_monitor_and_for_the_switch() -> None:
    found = chain(
        channels={
            "nominal": {"kind": "nominal", "links": [], "rate": 20.0},
            "safety": {
                "kind": "safety",
                "links": ["eye"],
                "rate": 10.0,
                "parameters": {"confirm": 0.2, "emergency_deceleration": 7.0},
            },
        },
        switch={
            "policy": "fixed_priority",
            "priority": ["safety", "nominal"],
            "default": "nominal",
            "debounce": 0.3,
            "handover": 0.1,
        },
    )
    assert found.confirm_s == pytest.approx((SAFETY_HITS - 1) * 0.05 + 0.2)
    assert found.decide_s == pytest.approx(0.1 + 0.3 + 0.1)
    assert found.deceleration_mps2 == 7.0


def test_plug_in_channel_is_assumed_to_be_like_the_built_in_unless_it_tells() -> None:
    plugin = {"own": {"kind": "./own.py:Own", "links": ["eye"], "rate": 20.0}}
    switch = {"policy": "fixed_priority", "priority": ["own"], "default": "own"}
    silent = chain(channels=plugin, switch=switch)
    assert silent.is_assumed
    assert [silent.confirm_s, silent.deceleration_mps2] == pytest.approx([0.1, 8.0])
    told = {"confirm_hits": 5, "emergency_deceleration": 6.0, "name": "x", "is_fast": True}
    plugin["own"]["parameters"] = told
    found = chain(channels=plugin, switch=switch)
    assert not found.is_assumed
    assert [found.confirm_s, found.deceleration_mps2] == pytest.approx([0.2, 6.0])


def test_sensor_without_a_link_has_no_chain() -> None:
    built = architecture({"eye": radar()}, channels=channel(links=[]))
    assert list(chains_of(built)) == []


def test_needed_range_is_the_stopping_distance_and_the_margin() -> None:
    found = chain()
    speeds = np.array([-3.0, 10.0, 30.0])
    need = needed_ranges_of(found, DRY, speeds)
    braking = braking_of(found, DRY)
    assert need[0] == MARGIN
    for speed, value in zip(speeds[1:], need[1:], strict=True):
        assert value == stopping_distance(speed, found.total_s, braking) + MARGIN
