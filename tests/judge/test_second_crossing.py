"""Post-encroachment times of random crossings are those of a second implementation."""

import math
import os
from typing import Any

import numpy as np
import pytest

from adeye.judge.metrics import METRICS
from adeye.judge.series import TraceSeries
from tests.judge.conftest import HandMade
from tests.second import crossing, plane, scene

ROWS, STEP = 51, 0.1
FEW = 20 if os.environ.get("NUMBA_DISABLE_JIT") else 300
MANY = 2_000
"""Runs: a hundred thousand states of an actor that crosses."""

SAME = 1e-9
SEAM = 1e-9
"""Time within which an entry, an exit and a row may be in either order [s]."""


def drawn(generator: Any, runs: int) -> list[tuple[scene.Body, scene.Body]]:
    even, pick = generator.uniform, generator.choice
    found = []
    for _ in range(runs):
        ego = scene.Body(0.0, even(3.0, 7.0), 0.0, even(2.0, 30.0), 0.0, 4.0, 2.0)
        side = pick([-1.0, 1.0])
        heading = side * 0.5 * math.pi + pick([0.0, 1.0]) * even(-0.7, 0.7)
        length, width = pick([0.5, 4.0, 12.0]), pick([0.5, 2.0])
        place = even(-10.0, 90.0), ego.d - side * even(-4.0, 25.0)
        found.append((ego, scene.Body(*place, heading, even(0.5, 15.0), 0.0, length, width)))
    return found


def moved(body: scene.Body, time: float) -> scene.Body:
    return body._replace(s=body.s + body.along * time, d=body.d + body.across * time)


def made_of(pairs: list[tuple[scene.Body, scene.Body]]) -> HandMade:
    """Put the runs into a trace; each ends at its first contact."""
    made = HandMade(rows=ROWS, runs=len(pairs), step=STEP)
    for run, (ego, other) in enumerate(pairs):
        for name, body in (("ego", ego), ("objects", other)):
            place = "ego_place" if name == "ego" else "object_places"
            rows = made.columns[name][run].reshape(ROWS, -1)
            rows[:, 0] = body.s + body.along * made.time
            rows[:, 1] = body.d + body.across * made.time
            rows[:, 2:5] = body.heading, body.speed, 0.0
            made.columns[place][run].reshape(ROWS, -1)[:, :2] = rows[:, :2]
        made.sizes[run, 0, :2] = other.length, other.width
        touching = plane.ttc(
            ego.box(), other.box(), (other.along - ego.along, other.across - ego.across)
        )
        for row in range(ROWS if touching < ROWS * STEP else 0):
            time = row * STEP
            if (
                time >= touching
                and plane.distance(*(moved(x, time).box() for x in (ego, other))) == 0.0
            ):
                made.columns["contact"][run, row] = 0
                made.length[run] = row + 1
                made.complete[run] = False
                break
    made.horizon_row = np.minimum(made.horizon_row, made.length - 1)
    return made


def on_a_seam(ego: scene.Body, other: scene.Body, end: float) -> bool:
    """Whether two moments that parted what is said are the same but for rounding."""
    enter, leave = crossing.in_corridor(ego, other)
    first, gone = crossing.area(ego, other, max(enter, 0.0), min(leave, end))
    moments = [0.0, end, enter, leave, first, gone]
    return any(
        abs(one - two) <= SEAM for k, one in enumerate(moments) for two in moments[:k] if one != two
    )


def differing(runs: int, seed: int) -> list[Any]:
    pairs = drawn(np.random.default_rng(seed), runs)
    made = made_of(pairs)
    series = TraceSeries(made.trace())
    names = ("min_pet_s", "pet_overlap_s", "max_encroachment_time_s")
    found = {name: METRICS[name].measure(series) for name in (*names, "min_predicted_pet_s")}
    wrong = []
    for run, (ego, other) in enumerate(pairs):
        rows = int(made.length[run])
        is_contact = bool(made.columns["contact"][run, rows - 1] >= 0)
        end = STEP * (rows - 1)
        second = crossing.judged(ego, other, end, is_contact=is_contact)
        least = min(
            crossing.predicted(*(moved(body, STEP * row) for body in (ego, other)))
            for row in range(rows)
        )
        forecast = (least, "value") if least < math.inf else crossing.NOTHING
        for name, expected in zip(found, (*second, forecast), strict=True):
            own = float(found[name].value[run]), str(found[name].status[run])
            is_same = own[1] == expected[1] and (
                own[1] != "value" or abs(own[0] - expected[0]) <= SAME * (1.0 + abs(own[0]))
            )
            if not is_same and not on_a_seam(ego, other, end):
                wrong.append((name, own, expected, ego, other, rows))
    return wrong


@pytest.mark.slow
def test_crossings_are_those_of_a_second_implementation() -> None:
    assert differing(FEW, 3) == []


@pytest.mark.slow
def test_a_hundred_thousand_crossings_are_those_of_a_second_implementation() -> None:
    assert differing(MANY, 100) == []


def test_drawn_crossings_have_every_status() -> None:
    series = TraceSeries(made_of(drawn(np.random.default_rng(3), 300)).trace())
    words = list(METRICS["min_pet_s"].measure(series).status)
    for status in ("value", "undefined", "incomplete", "no_conflict"):
        assert words.count(status) > 5, status
