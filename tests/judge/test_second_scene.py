"""Metrics of random runs are those of a second implementation, values and statuses."""

import math
import os
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.series import TraceSeries
from tests.judge.conftest import HandMade
from tests.second import plane, scene

ROWS, OBJECTS = 5, ("first", "second")
FEW = 20 if os.environ.get("NUMBA_DISABLE_JIT") else 200
MANY = 10_000
"""Runs: a hundred thousand states of an object beside the ego."""

SAME = 1e-9


def drawn(generator: Any, runs: int) -> list[list[scene.Body]]:
    """Draw bodies at the first row: the ego and two others, in following, meeting and crossing."""

    def pick(*choices: float) -> Any:
        return generator.choice(np.array(choices), runs)

    even = generator.uniform
    ego = [
        0.0 * even(size=runs), even(1.0, 9.0, runs), pick(0.0, 0.0, 0.05, -0.1),
        pick(0.0, 5.0, 20.0) + even(0.0, 20.0, runs) * pick(0.0, 1.0, 1.0, 1.0),
        even(-6.0, 2.0, runs) * pick(0.0, 1.0), np.full(runs, 4.0), np.full(runs, 2.0),
    ]  # fmt: skip
    bodies = [ego]
    for _ in OBJECTS:
        heading = pick(0.0, 0.0, 0.0, 0.1, math.pi, math.pi / 2, -math.pi / 2) + pick(
            0.0, 1.0
        ) * even(-0.6, 0.6, runs)
        bodies.append(
            [
                pick(-1.0, 1.0, 1.0) * even(0.0, 70.0, runs),
                ego[1] + even(-9.0, 9.0, runs) * pick(0.0, 0.2, 1.0),
                heading,
                even(0.0, 30.0, runs) * pick(0.0, 1.0, 1.0),
                even(-7.0, 2.0, runs) * pick(0.0, 1.0),
                pick(0.5, 4.0, 12.0),
                pick(0.5, 2.0, 2.5),
            ]
        )
    return [
        [scene.Body(*(float(column[run]) for column in body)) for body in bodies]
        for run in range(runs)
    ]


def moved(body: scene.Body, time: float) -> scene.Body:
    way = body.speed * time
    return body._replace(
        s=body.s + way * math.cos(body.heading), d=body.d + way * math.sin(body.heading)
    )


def made_of(runs: list[list[scene.Body]]) -> tuple[HandMade, list[list[list[scene.Body]]]]:
    """Put the runs into a trace; each ends at its first contact."""
    made = HandMade(rows=ROWS, runs=len(runs), objects=OBJECTS, tail_rows=1)
    for name in ("ego", "objects", "ego_place", "object_places"):
        made.columns[name][:] = 0.0
    whole = []
    for run, bodies in enumerate(runs):
        rows = [[moved(body, 0.1 * row) for body in bodies] for row in range(ROWS)]
        kept = []
        for row, (own, *others) in enumerate(rows):
            kept.append(rows[row])
            for place, body in enumerate((own, *others)):
                state = [body.s, body.d, body.heading, body.speed, body.acceleration]
                if place:
                    made.columns["objects"][run, row, place - 1] = state
                    made.columns["object_places"][run, row, place - 1, :2] = state[:2]
                else:
                    made.columns["ego"][run, row, :5] = state
                    made.columns["ego_place"][run, row, :2] = state[:2]
            near = [plane.distance(own.box(), other.box()) for other in others]
            if min(near) == 0.0:
                made.columns["contact"][run, row] = near.index(0.0)
                made.length[run] = row + 1
                made.complete[run] = False
                break
        whole.append(kept)
        made.sizes[run, :, :2] = [[body.length, body.width] for body in bodies[1:]]
    made.horizon_row = np.minimum(made.horizon_row, made.length - 1)
    return made, whole


def differing(runs: int, seed: int) -> dict[str, list[Any]]:
    """Give what differs, metric by metric."""
    made, whole = made_of(drawn(np.random.default_rng(seed), runs))
    trace = made.trace()
    friction = trace.layout.context.surroundings.friction
    series = TraceSeries(trace)
    names = [name for name in (*scene.COLUMNS, *EXTRA) if name in METRICS]
    found = {name: METRICS[name].measure(series) for name in names}
    wrong: dict[str, list[Any]] = {name: [] for name in names}
    for run, rows in enumerate(whole):
        touched = made.columns["contact"][run].tolist()
        measured = [
            scene.measure(own, others, touched[row], float(friction[run]))
            for row, (own, *others) in enumerate(rows)
        ]
        egos = [own for own, *_ in rows]
        second = scene.run_metrics(measured, egos, touched[: len(rows)], float(friction[run]))
        for name in names:
            value, status = float(found[name].value[run]), found[name].status[run]
            other = second[name]
            least = second["wide"].value if name == "min_wttc_s" else other.value
            within = SAME * max(1.0, abs(other.value))
            if status != other.status or (
                status == "value" and not least - within <= value <= other.value + within
            ):
                wrong[name].append((rows, touched, (value, status), other))
    return {name: cases for name, cases in wrong.items() if cases}


EXTRA = (
    "max_btn", "tet_s", "tit_s2", "tet_share", "tit_mean_s", "crash_potential", "rss_violation_s",
    "min_time_gap_s", "min_psd", "time_to_accident_s",
)  # fmt: skip


@pytest.mark.slow
def test_metrics_of_runs_are_those_of_a_second_implementation() -> None:
    assert differing(FEW, 1) == {}


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_metrics_of_a_hundred_thousand_states_are_those_of_a_second_implementation(
    part: int,
) -> None:
    assert differing(MANY // 4, 10 + part) == {}


def test_drawn_runs_have_every_status_and_value() -> None:
    made, _ = made_of(drawn(np.random.default_rng(2), 400))
    series = TraceSeries(made.trace())
    for name in scene.COLUMNS.keys() & METRICS.keys():
        words = list(METRICS[name].measure(series).status)
        assert words.count("value") > 20, name
    assert "undefined" in METRICS["max_dst_mps2"].measure(series).status
    assert "no_conflict" in METRICS["min_ttb_s"].measure(series).status
