"""Which objects are missed, made up, split or taken for others."""

import math
from typing import Any

import numpy as np
import pytest

from adeye.signals import EGO_SPEED, EGO_YAW_RATE, OBJECT_CLASSES
from tests.motorway import ARCHITECTURE
from tests.simulate.faults.streams import CONTEXT, END, ONSET, STEP, at_onset, made, played, scenes

LEAD, NEIGHBOUR, WALL = range(3)
REACH = float(ARCHITECTURE["vehicle"]["wheelbase"].removesuffix(" m"))


def sources(parameters: dict[str, Any]) -> list[list[int]]:
    """Return which objects are left of the truth where some are missed, by run."""
    _, faulty = at_onset("miss", "truth", parameters)
    return [sorted(row[row >= 0].tolist()) for row in faulty.source]


def test_only_the_classes_that_are_named_or_what_is_in_the_sector_is_missed() -> None:
    every = [LEAD, NEIGHBOUR, WALL]
    names = [OBJECT_CLASSES[number] for number in CONTEXT.object_classes]
    found = sources({"classes": [names[NEIGHBOUR], names[WALL]]})
    assert found == [[LEAD], every, [LEAD]]
    # The wall is at the right, the neighbour at the left.
    found = sources({"right": "-90 deg", "left": "-1 deg"})
    assert found == [[LEAD, NEIGHBOUR], every, [LEAD, NEIGHBOUR]]


def test_class_is_that_of_the_object_where_the_sensor_tells_none() -> None:
    given, faulty = at_onset("miss", "cell_radar", {"classes": ["truck"]})
    assert NEIGHBOUR in given.source[0]
    assert NEIGHBOUR not in faulty.source[0]
    assert (faulty.source[0] >= 0).sum() == (given.source[0] >= 0).sum() - 1


def test_what_is_beyond_is_missed() -> None:
    given, faulty = at_onset("miss", "truth", {"beyond": "45 m"})
    far = np.linalg.norm(given.detections[0, :, :2], axis=1) >= 45.0
    assert far.any()
    assert not far.all()
    assert faulty.source[0, faulty.mask[0]].tolist() == given.source[0, ~far].tolist()


def test_share_of_misses_is_the_probability() -> None:
    fault = made("miss", "truth", {"probability": 0.3})
    pairs = played(fault, "truth", lambda _: np.ones(3, dtype=np.bool_), onset=0)
    missed = [3 - int(item.mask[run].sum()) for _, item in pairs for run in range(3)]
    share = sum(missed) / (3 * len(missed))
    assert abs(share - 0.3) < 4.0 * math.sqrt(0.3 * 0.7 / (3 * len(missed)))


def test_taken_for_another_class() -> None:
    taken = {"classes": ["car"], "taken_for": "pedestrian"}
    _, faulty = at_onset("misclassify", "truth", taken)
    classes = [OBJECT_CLASSES[int(number)] for number in faulty.detections[0, :, 6]]
    assert sorted(classes) == sorted(["pedestrian", "truck", "barrier"])


def test_halves_lie_side_by_side_and_fill_the_whole() -> None:
    given, faulty = played(made("split", "truth", {"classes": ["truck"]}), "truth")[ONSET]
    whole = given.detections[0][given.source[0] == NEIGHBOUR][0]
    halves = faulty.detections[0][faulty.detections[0, :, 5] == whole[5] / 2]
    assert len(halves) == 2
    assert sorted(halves[:, 1]) == pytest.approx([whole[1] - whole[5] / 4, whole[1] + whole[5] / 4])
    assert faulty.mask.sum(axis=1).tolist() == [4, 3, 4]
    assert (faulty.source[0] == NEIGHBOUR).sum() == 1


GHOST = {"x": "30 m", "y": "2 m", "speed": "0 m/s"}


def test_standing_ghost_comes_nearer_as_the_ego_drives() -> None:
    pairs = played(made("ghost", "truth", GHOST), "truth")
    for tick in range(ONSET, END):
        _, faulty = pairs[tick]
        here, then = scenes()[tick].ego[0], scenes()[ONSET].ego[0]
        row = faulty.detections[0][faulty.mask[0] & (faulty.source[0] < 0)][0]
        sine, cosine = math.sin(then[2]), math.cos(then[2])
        x = then[0] + 30.0 * cosine - 2.0 * sine - here[0]
        y = then[1] + 30.0 * sine + 2.0 * cosine - here[1]
        assert math.hypot(row[0], row[1]) == pytest.approx(math.hypot(x, y))
        # The box centre swings around the rear axle, half a wheelbase behind it.
        aside = here[EGO_YAW_RATE] * 0.5 * REACH
        rate = -here[EGO_SPEED] * (math.cos(here[2]) * x + math.sin(here[2]) * y)
        rate -= aside * (math.cos(here[2]) * y - math.sin(here[2]) * x)
        assert row[2] == pytest.approx(rate / math.hypot(x, y))
        assert row[[3, 4, 5, 6]].tolist() == [1.0, 4.5, 1.8, 0.0]


def test_ghost_appears_where_it_is_written_and_moves_with_its_speed() -> None:
    pairs = played(made("ghost", "truth", {**GHOST, "speed": "10 m/s"}), "truth")
    first, later = (pairs[tick][1] for tick in (ONSET, END - 1))
    places = [item.detections[0][item.mask[0] & (item.source[0] < 0)][0] for item in (first, later)]
    assert places[0][:2] == pytest.approx([30.0, 2.0])
    # The ego of run 0 drives 10 m/s, so it stays where it is but for the ego's heading in the map.
    moved = (END - 1 - ONSET) * STEP * 10.0
    assert np.linalg.norm(places[1][:2] - places[0][:2]) < 0.02 * moved
    assert pairs[ONSET][1].mask.sum(axis=1).tolist() == [4, 3, 4]


def test_ghost_of_a_late_sample_is_where_it_was_when_that_was_made() -> None:
    pairs = played(made("ghost", "radar", GHOST), "radar")
    given, faulty = pairs[ONSET]
    row = faulty.detections[0][faulty.mask[0] & (faulty.source[0] < 0)][0]
    late = ONSET * STEP - given.stamp[0]
    assert late == pytest.approx(0.1)
    ahead = 30.0 + late * scenes()[ONSET].ego[0, EGO_SPEED]
    assert row[0] == pytest.approx(ahead, abs=0.05)
    assert pairs[ONSET + 1][1].detections.tobytes() == faulty.detections.tobytes()
