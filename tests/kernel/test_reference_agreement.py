"""Reference drivers and a second implementation of them agree scene by scene."""

import math
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

from adeye.kernel.reference_drivers import reactions as columns
from adeye.kernel.reference_drivers.reactions import MODELS
from tests import reference_scenes as second
from tests.driven_scenes import driven, scenes_of
from tests.reference_models import NO_VARIANT

KMH = 1.0 / 3.6
INF = math.inf

Scene = second.CutIn | second.CutOut | second.Braking
Result = tuple[Scene, second.Outcome, second.Outcome]

KINDS = {
    second.CutIn: columns.CUT_IN,
    second.CutOut: columns.CUT_OUT,
    second.Braking: columns.BRAKING_LEAD,
}

SAME = 1e-6
"""Impact speeds that differ by less are the same [m/s]."""

# Interpreted, the product is as slow as the second implementation, and a small sample has to do.
SPARSE = 50 if os.environ.get("NUMBA_DISABLE_JIT") else 1


def line(first: float, last: float, count: int) -> list[float]:
    return [float(value) for value in np.linspace(first, last, count)]


def cut_ins(*axes: Iterable[float]) -> list[Scene]:
    """Return cut-ins of speeds [km/h], shares of them that the other has, gaps, lateral speeds."""
    return [
        second.CutIn(speed * KMH, speed * KMH * share, gap, lateral)
        for speed, share, gap, lateral in product(*axes)
    ]


def sample_of_cut_ins() -> list[Scene]:
    return cut_ins(
        line(10, 130, 8), line(0.0613, 0.9371, 5), line(1.0137, 119.771, 10), line(0.2, 3.0, 10)
    )


def many_cut_ins() -> list[Scene]:
    """Return 104,000 cut-ins without round numbers, in which rounding decides next to nothing."""
    return cut_ins(
        line(10, 130, 13), line(0.0613, 0.9371, 8), line(1.0137, 119.771, 25), line(0.2, 3.0, 40)
    )


def round_cut_ins() -> list[Scene]:
    """Return 52,650 cut-ins of round numbers, of which many are ties at the end of a step."""
    return cut_ins(line(10, 130, 13), line(0.1, 0.9, 9), line(1, 120, 30), line(0.2, 3.0, 15))


def cut_outs() -> list[Scene]:
    """Return 6,240 cut-outs; without a gap, the driver begins at its own."""
    return [
        second.CutOut(speed * KMH, speed * KMH * share, gap, front, lateral)
        for speed, share, gap, front, lateral in product(
            line(10, 130, 13),
            (1.0, 0.81, 0.53, 1.17),
            (None, 3.7, 21.3, 60.1),
            line(2.3, 97.0, 6),
            line(0.31, 2.9, 5),
        )
    ]


def braking_leads() -> list[Scene]:
    """Return 5,200 leads that brake at once or ever harder."""
    return [
        second.Braking(speed * KMH, speed * KMH * share, gap, braking, jerk)
        for speed, share, gap, braking, jerk in product(
            line(10, 130, 13),
            (1.0, 0.83),
            (None, 3.7, 11.3, 34.9, 80.3),
            line(0.5, 9.5, 10),
            (INF, 1.7, 4.9, 12.65),
        )
    ]


def row_of(scene: Scene) -> tuple[float, ...]:
    """Return ego speed, other speed, gap, lateral speed, gap to the front, braking, jerk."""
    gap = math.nan if scene.gap is None else scene.gap
    match scene:
        case second.CutIn():
            return (scene.ego, scene.other, gap, scene.sideways, 0.0, 0.0, 0.0)
        case second.CutOut():
            return (scene.ego, scene.lead, gap, scene.sideways, scene.front, 0.0, 0.0)
    return (scene.ego, scene.lead, gap, 0.0, 0.0, scene.braking, scene.jerk)


def table_of(scenes: Sequence[Scene]) -> Any:
    """Return scenes of one kind as rows of the product."""
    rows = np.array([row_of(scene) for scene in scenes])
    table = scenes_of(rows[:, :4])
    table[:, [columns.S_FRONT_GAP, columns.S_BRAKING, columns.S_BRAKING_JERK]] = rows[:, 4:]
    for row, scene in zip(table, scenes, strict=True):
        if isinstance(scene, second.CutIn):
            row[[columns.S_LANE_WIDTH, columns.S_LATERAL_OFFSET]] = scene.lane
            row[columns.S_LATERAL_ACCELERATION] = INF if scene.grows is None else scene.grows
    return table


def ours(scenes: Sequence[Scene], model: str, step: float) -> list[second.Outcome]:
    """Return what comes of scenes of one kind by the product."""
    results = driven(table_of(scenes), model, kind=KINDS[type(scenes[0])], step=step)
    return [outcome_of(row) for row in results]


def outcome_of(row: Any) -> second.Outcome:
    if math.isnan(row[columns.R_CONTACT]):
        return None
    if row[columns.R_CONTACT] == 0.0:
        return second.APART
    return float(row[columns.R_IMPACT_SPEED])


def is_same(one: second.Outcome, other: second.Outcome) -> bool:
    """Tell whether verdict and impact speed are the same."""
    if one is None or other is None:
        return one is other
    return one == other or abs(one - other) <= SAME


def is_at_the_boundary(
    scene: Scene,
    model: str,
    step: float,
    outcome: second.Outcome,
    variant: second.Variant = NO_VARIANT,
) -> bool:
    """Tell whether the second implementation comes to an outcome within one step of the scene.

    A verdict must be that of a neighbour: the delay one step shorter or longer, or the gap by the
    way of one step. An impact speed must lie between theirs.
    """
    own = second.outcome(scene, model, step, 0, variant)
    near = [own, *second.neighbours(scene, model, step, variant)]
    if outcome is None or outcome == second.APART:
        return outcome in near
    speeds = [speed for speed in near if speed is not None and speed != second.APART]
    slowest = second.APART if second.APART in near else min(speeds, default=INF)
    return bool(speeds) and slowest - SAME <= outcome <= max(speeds) + SAME


def compare(
    scenes: Sequence[Scene], model: str, step: float, theirs: Sequence[second.Outcome]
) -> None:
    """Assert equal verdicts and impact speeds in all scenes but those at the boundary."""
    found = ours(scenes, model, step)
    contacts = sum(outcome not in {None, second.APART} for outcome in found)
    assert 0.01 * len(scenes) < contacts < 0.9 * len(scenes)
    differing = [
        (scene, mine, other)
        for scene, mine, other in zip(scenes, found, theirs, strict=True)
        if not is_same(mine, other)
    ]
    unlike = sum((mine == second.APART) != (other == second.APART) for _, mine, other in differing)
    print(  # noqa: T201 - shown with -s
        f"\n{model}: {len(scenes)} {type(scenes[0]).__name__} scenes of {step} s, {contacts} with "
        f"contact; at the boundary {len(differing)}, {unlike} of them with another verdict"
    )
    wrong = [case for case in differing if not is_at_the_boundary(case[0], model, step, case[1])]
    assert wrong == []


def compare_on_both_cores(scenes: Sequence[Scene], model: str, step: float) -> None:
    blocks = [(list(scenes[k : k + 500]), model, step) for k in range(0, len(scenes), 500)]
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        theirs = [outcome for block in pool.map(second.outcomes, blocks) for outcome in block]
    compare(scenes, model, step, theirs)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_cut_ins_agree(model: str) -> None:
    scenes = many_cut_ins()
    assert len(scenes) >= 100_000
    compare_on_both_cores(scenes, model, 0.1)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_cut_ins_of_round_numbers_agree_but_for_ties(model: str) -> None:
    compare_on_both_cores(round_cut_ins(), model, 0.1)


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("scenes_of_a_kind", [cut_outs, braking_leads])
def test_scenes_with_a_lead_agree(model: str, scenes_of_a_kind: Any) -> None:
    scenes = scenes_of_a_kind()
    assert len(scenes) >= 5_000
    scenes = scenes[::SPARSE]
    compare(scenes, model, 0.1, second.outcomes((scenes, model, 0.1)))


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_cut_ins_whose_sideways_speed_grows_agree(model: str) -> None:
    scenes: list[Any] = [
        scene._replace(grows=grows)
        for grows in (0.4, 1.5, 7.0)
        for scene in sample_of_cut_ins()[:: max(3, SPARSE - 3)]
        if isinstance(scene, second.CutIn)
    ]
    compare(scenes, model, 0.1, second.outcomes((scenes, model, 0.1)))


def test_growth_that_takes_no_time_is_none() -> None:
    rows = table_of(sample_of_cut_ins()[:: max(3, SPARSE - 3)])
    fast, none = rows.copy(), rows.copy()
    fast[:, columns.S_LATERAL_ACCELERATION], none[:, columns.S_LATERAL_ACCELERATION] = 1e12, 0.0
    for model in MODELS:
        at_once = driven(rows, model)
        assert np.array_equal(driven(none, model), at_once, equal_nan=True)
        if model in {"cc", "reg157"}:
            # The others look at the sideways speed, which is still 0 at the first look.
            found = driven(fast, model)
            unlike = found[:, columns.R_CONTACT] != at_once[:, columns.R_CONTACT]
            # A picosecond decides where the way to the lane ends at a tick.
            assert np.mean(unlike) < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("model", ["cc", "fsm", "rss"])
def test_verdicts_in_scenes_as_published_are_those_of_the_published_code(model: str) -> None:
    scenes = [
        scene._replace(grows=1.5)
        for scene in cut_ins(
            line(10.3, 130, 8), line(0.0613, 0.9371, 6), line(1.0137, 99.77, 8), line(0.07, 1.77, 8)
        )[::SPARSE]
        if isinstance(scene, second.CutIn)
    ]
    found = driven(
        table_of(scenes), model, variant=("jrc",), step=0.1, integrator=columns.SEMI_IMPLICIT,
        ttc_end=2.0 if model == "cc" else INF,
    )  # fmt: skip
    touches = [second.published_cut_in(scene, model) for scene in scenes]
    assert sum(touches) > 0.05 * len(scenes)
    unlike = [
        scene
        for scene, row, touched in zip(scenes, found, touches, strict=True)
        if (row[columns.R_CONTACT] == 1.0) != touched
    ]
    assert len(unlike) <= len(scenes) // 1000


def test_longer_delay_of_the_second_implementation_is_found() -> None:
    # The comparison must fail for a driver that is three steps late.
    scenes = sample_of_cut_ins()[::7]
    late = [second.outcome(scene, "rss", 0.1, 3) for scene in scenes]
    on_time = ours(scenes, "rss", 0.1)
    wrong = [
        scene
        for scene, outcome, mine in zip(scenes, late, on_time, strict=True)
        if not is_same(mine, outcome) and not is_at_the_boundary(scene, "rss", 0.1, outcome)
    ]
    assert len(wrong) > 10
