"""Scenes of the reference drivers: convergence, symmetries, scenes with an answer."""

import math
import os
from itertools import product
from typing import Any

import numpy as np
import pytest

from adeye.kernel.reference_drivers import drivers as columns
from adeye.kernel.reference_drivers.drivers import MODELS
from tests.driven_scenes import driven, scenes_of

KMH = 1.0 / 3.6

compiled_only = pytest.mark.skipif(
    bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="a grid of scenes takes minutes interpreted"
)

FEW = 2 if os.environ.get("NUMBA_DISABLE_JIT") else 3
"""Values of each axis, where scenes are compared with themselves."""


def grid(speeds: int, shares: int, gaps: int, laterals: int) -> list[tuple[float, ...]]:
    """Return a grid of 10 to 130 km/h, gaps of 1 to 120 m, sideways 0.2 to 3 m/s."""
    axes = product(
        np.linspace(10.0, 130.0, speeds) * KMH,
        np.linspace(0.0613, 0.9371, shares),
        np.linspace(1.0137, 119.771, gaps),
        np.linspace(0.2, 3.0, laterals),
    )
    return [(float(v), float(v * s), float(g), float(w)) for v, s, g, w in axes]


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize("model", MODELS)
def test_impact_speed_converges_with_the_step(model: str) -> None:
    scenes = scenes_of(grid(5, 4, 8, 8))
    fine = driven(scenes, model, step=0.001)
    braked = (fine[:, columns.R_CONTACT] == 1.0) & (fine[:, columns.R_BRAKING_TIME] > 0.0)
    worst = []
    for step in (0.08, 0.04, 0.02, 0.01):
        coarse = driven(scenes, model, step=step)
        both = braked & (coarse[:, columns.R_CONTACT] == 1.0)
        assert both.sum() >= 3
        # Touching slowly, a small way is a large speed; the energy of the impact is smooth.
        column = columns.R_IMPACT_SPEED
        error = np.abs(coarse[both, column] ** 2 - fine[both, column] ** 2)
        worst.append(float(error.mean()))
    assert worst[-1] < 0.5 * worst[0]


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize("model", MODELS)
def test_both_integrators_meet_for_small_steps(model: str) -> None:
    scenes = scenes_of(grid(4, 3, 6, 6))
    exact, euler = (
        driven(scenes, model, step=0.002, integrator=integrator)[:, columns.R_CONTACT]
        for integrator in (columns.EXACT, columns.SEMI_IMPLICIT)
    )
    known = ~(np.isnan(exact) | np.isnan(euler))
    assert np.mean(exact[known] != euler[known]) <= 0.01
    assert known.mean() > 0.85


@pytest.mark.parametrize("model", MODELS)
def test_order_of_scenes_changes_no_bit(model: str) -> None:
    scenes = scenes_of(grid(FEW, FEW, FEW, FEW))
    there, back = driven(scenes, model), driven(scenes[::-1].copy(), model)[::-1]
    assert there.tobytes() == np.ascontiguousarray(back).tobytes()


@pytest.mark.parametrize("model", MODELS)
def test_mirrored_cut_in_is_the_same(model: str) -> None:
    scenes = scenes_of(grid(FEW, FEW, FEW, FEW))
    mirrored = scenes.copy()
    mirrored[:, columns.S_LATERAL_OFFSET] *= -1.0
    assert driven(scenes, model).tobytes() == driven(mirrored, model).tobytes()


@pytest.mark.parametrize("model", MODELS)
def test_vehicle_that_stays_in_its_lane_is_passed(model: str) -> None:
    result = driven(scenes_of([(30.0, 10.0, 50.0, 0.0)]), model)[0]
    assert result[columns.R_CONTACT] == 0.0
    assert result[columns.R_MIN_GAP] == math.inf
    assert math.isnan(result[columns.R_IMPACT_SPEED])


@pytest.mark.parametrize("model", MODELS)
def test_cut_in_right_before_a_much_faster_ego_cannot_be_mastered(model: str) -> None:
    result = driven(scenes_of([(36.0, 10.0, 12.0, 3.0)]), model)[0]
    assert result[columns.R_CONTACT] == 1.0
    assert 15.0 < result[columns.R_IMPACT_SPEED] <= 26.0
    assert result[columns.R_MIN_GAP] == 0.0


def test_rule_avoids_what_it_must_avoid_and_nothing_just_below() -> None:
    least = 10.0 * (1.1 + 10.0 / 12.0 + 0.35)
    avoided, touched = driven(
        scenes_of([(20.0, 10.0, least + 0.15, 1.0), (20.0, 10.0, least - 0.15, 1.0)]),
        "reg157",
        step=0.001,
    )
    assert avoided[columns.R_CONTACT] == 0.0
    assert avoided[columns.R_MIN_GAP] < 0.2
    assert touched[columns.R_CONTACT] == 1.0


def test_published_end_hides_a_contact_of_the_careful_driver() -> None:
    # At overlap the TTC is 2.4 s; 20 m/s faster, braking at 2 s comes too late.
    scenes = scenes_of([(30.0, 10.0, 80.0, 1.0)])
    whole, ended = (driven(scenes, "cc", ttc_end=end)[0] for end in (math.inf, 2.0))
    assert whole[columns.R_CONTACT] == 1.0
    assert whole[columns.R_IMPACT_SPEED] == pytest.approx(9.5, abs=0.2)
    assert ended[columns.R_CONTACT] == 0.0
    assert math.isnan(ended[columns.R_BRAKING_TIME])


def with_and_without(variant: str, model: str, lane: float) -> tuple[Any, Any]:
    """Return results by the text and by a variant in cut-ins from a lane of a width."""
    scenes = scenes_of(grid(6, 5, 8, 6))
    scenes[:, [columns.S_LANE_WIDTH, columns.S_LATERAL_OFFSET]] = lane
    end = 2.0 if variant == "jrc-ttc-end" else math.inf
    return (
        driven(scenes, model, step=0.02),
        driven(scenes, model, step=0.02, variant=(variant,), ttc_end=end),
    )


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize(
    ("variant", "model", "lane", "brakes", "touches"),
    [
        ("jrc-guard", "reg157", 3.5, "earlier", "less"),
        ("jrc-lateral", "reg157", 3.75, "later", "either"),
        ("jrc-raw-acceleration", "fsm", 3.5, "as before", "either"),
        ("jrc-ttc-end", "cc", 3.5, "later", "less"),
        ("jrc-coasting", "cc", 3.5, "earlier", "either"),
        ("jrc-perception", "cc", 3.5, "later", "either"),
        ("jrc-no-emergency", "cc", 3.5, "later", "more"),
        ("jrc-rss-lateral", "rss", 3.5, "later", "either"),
        ("jrc-beside", "cc", 3.5, "earlier", "either"),
        ("jrc-beside", "fsm", 3.5, "earlier", "either"),
        ("jrc-beside", "rss", 3.5, "earlier", "either"),
        ("jrc-beside", "reg157", 3.5, "earlier", "either"),
    ],
)
def test_variant_differs_from_the_text_in_its_direction(
    variant: str, model: str, lane: float, brakes: str, touches: str
) -> None:
    text, published = with_and_without(variant, model, lane)
    # Never is later than any time.
    before, after = (
        np.nan_to_num(result[:, columns.R_BRAKING_TIME], nan=math.inf)
        for result in (text, published)
    )
    assert bool(np.any(after < before)) == (brakes == "earlier")
    assert bool(np.any(after > before)) == (brakes == "later")
    without, instead = (result[:, columns.R_CONTACT] == 1.0 for result in (text, published))
    if touches != "either":
        assert bool(np.any(without & ~instead)) == (touches == "less")
        assert bool(np.any(instead & ~without)) == (touches == "more")


@compiled_only
def test_raw_acceleration_touches_where_the_text_just_does_not() -> None:
    # It matters to an ego that brakes hard and is nearly slow enough.
    gaps = np.linspace(36.0, 38.0, 101)
    scenes = scenes_of([(80.0 * KMH, 0.28 * 80.0 * KMH, float(gap), 1.5) for gap in gaps])
    text, published = (
        driven(scenes, "fsm", variant=variant)[:, columns.R_CONTACT] == 1.0
        for variant in ((), ("jrc-raw-acceleration",))
    )
    assert np.any(published & ~text)
    assert not np.any(text & ~published)


@compiled_only
def test_lateral_variant_is_the_text_for_the_usual_width() -> None:
    # 0.3 m inside a lane of 3.5 m is 0.5 m beside an ego of 1.9 m.
    text, published = with_and_without("jrc-lateral", "reg157", 3.5)
    assert text.tobytes() == published.tobytes()


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize(("variant", "sign"), [("jrc-coasting", 1.0), ("jrc-no-emergency", -1.0)])
def test_variant_changes_the_impact_of_the_careful_driver_one_way(
    variant: str, sign: float
) -> None:
    text, published = with_and_without(variant, "cc", 3.5)
    both = (text[:, columns.R_CONTACT] == 1.0) & (published[:, columns.R_CONTACT] == 1.0)
    column = columns.R_IMPACT_SPEED
    softer = sign * (text[both, column] - published[both, column])
    assert np.any(softer > 0.01)
    assert np.all(softer > -1e-9)


def scene_of_a_lead(speed: float, gap: float, braking: float, jerk: float = math.inf) -> Any:
    scenes = scenes_of([(speed, speed, gap, 0.0)])
    scenes[:, columns.S_BRAKING] = braking
    scenes[:, columns.S_BRAKING_JERK] = jerk
    return scenes


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("braking", [1.0, 3.0, 4.9, 5.0, 7.0, 7.5])
def test_lead_that_brakes_to_standstill_is_not_touched_from_the_own_distance(
    model: str, braking: float
) -> None:
    if model == "reg157" and braking > 6.0:
        pytest.skip("brakes by 6 m/s2 only")
    scenes = scene_of_a_lead(15.0, math.nan, braking)
    result = driven(scenes, model, kind=columns.BRAKING_LEAD)[0]
    assert result[columns.R_CONTACT] == 0.0


@pytest.mark.parametrize("model", MODELS)
def test_lead_that_brakes_right_ahead_is_touched(model: str) -> None:
    scenes = scene_of_a_lead(30.0, 5.0, 9.0, 12.0)
    assert driven(scenes, model, kind=columns.BRAKING_LEAD)[0, columns.R_CONTACT] == 1.0


def scene_of_a_cut_out(speed: float, front: float, lateral: float) -> Any:
    scenes = scenes_of([(speed, speed, math.nan, lateral)])
    scenes[:, columns.S_FRONT_GAP] = front
    return scenes


@pytest.mark.parametrize("model", MODELS)
def test_standing_vehicle_far_behind_a_cut_out_is_not_touched(model: str) -> None:
    scenes = scene_of_a_cut_out(15.0, 60.0, 1.5)
    result = driven(scenes, model, kind=columns.CUT_OUT)[0]
    assert result[columns.R_CONTACT] == 0.0
    assert 0.0 < result[columns.R_MIN_GAP] < 100.0


@pytest.mark.parametrize("model", ["fsm", "rss", "reg157"])
def test_standing_vehicle_right_behind_a_late_cut_out_is_touched(model: str) -> None:
    # The lead leaves so late that it hits the standing one, and the ego follows too near.
    scenes = scene_of_a_cut_out(36.0, 5.0, 0.5)
    scenes[:, columns.S_GAP] = 10.0
    assert driven(scenes, model, kind=columns.CUT_OUT)[0, columns.R_CONTACT] == 1.0


def test_variant_without_evaluation_answers_a_cut_out_by_0_4_seconds_earlier() -> None:
    scenes = scene_of_a_cut_out(25.0, 40.0, 1.5)
    text, published = (
        driven(scenes, "cc", kind=columns.CUT_OUT, variant=variant)[0, columns.R_BRAKING_TIME]
        for variant in ((), ("jrc-perception",))
    )
    # Shown at 0.375 m / 1.5 m/s = 0.25 s, or in the tick after it, and 0.75 s of delay.
    assert published == pytest.approx(1.0, abs=0.011)
    assert text - published == pytest.approx(0.4, abs=0.011)


@pytest.mark.parametrize("model", MODELS)
def test_vehicle_that_leaves_can_be_touched_when_it_has_shown_the_other(model: str) -> None:
    # Shown after 0.75 s; the gap to the slower one that leaves is closed before a brake answers,
    # and it is out of the path after 3.8 s.
    scenes = scene_of_a_cut_out(30.0, 200.0, 0.5)
    scenes[:, columns.S_OTHER_SPEED] = 10.0
    scenes[:, columns.S_GAP] = 17.0
    result = driven(scenes, model, kind=columns.CUT_OUT)[0]
    assert result[columns.R_CONTACT] == 1.0
    assert 10.0 < result[columns.R_IMPACT_SPEED] <= 20.0
    assert result[columns.R_MIN_GAP] == 0.0
