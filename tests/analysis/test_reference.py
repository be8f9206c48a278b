"""Scenes from a file: threads change no bit, blocks cover everything, duties follow the edition."""

from pathlib import Path

import numpy as np
import pytest

from adeye.analysis.reference_cases import Question, check_question, drive, obligations, read
from adeye.errors import UsageError
from adeye.kernel.reference_drivers import reactions as columns
from tests.refusals import refused

HEADER = "ego_speed_mps,other_speed_mps,gap_m,lateral_speed_mps"


@pytest.fixture
def scenes(tmp_path: Path) -> np.ndarray:
    random = np.random.default_rng(1)
    path = tmp_path / "cases.csv"
    lines = [f"{HEADER},note"]
    for ego, share, gap, lateral in random.random((5000, 4)).tolist():
        lines.append(f"{10 + 20 * ego},{9 * share},{5 + 60 * gap},{0.5 + lateral},x")
    path.write_text("\n".join(lines), encoding="utf-8")
    rows, scenes = read(path, "cut_in")
    assert len(rows) == 5000
    assert rows[0]["note"] == "x"
    return scenes


def test_threads_change_no_bit_and_every_block_is_told(scenes: np.ndarray) -> None:
    told: list[int] = []
    question = Question(step=0.05)
    alone = drive(scenes, question, "fsm")
    several = drive(scenes, question, "fsm", threads=3, told=told.append)
    assert alone.tobytes() == several.tobytes()
    assert sum(told) == len(scenes)
    assert set(np.unique(alone[:, columns.R_CONTACT])) == {0.0, 1.0}


def test_published_end_hides_contacts_of_the_careful_driver(tmp_path: Path) -> None:
    # At overlap the TTC is 2.4 s; 20 m/s faster, braking at 2 s comes too late.
    path = tmp_path / "cases.csv"
    path.write_text(f"{HEADER}\n30,10,80,1\n", encoding="utf-8")
    scenes = read(path, "cut_in")[1]
    assert drive(scenes, Question(), "cc")[0][columns.R_CONTACT] == 1.0
    for variant in ("jrc-ttc-end", "jrc"):
        question = Question(variant=(variant,))
        assert drive(scenes, question, "cc")[0][columns.R_CONTACT] == 0.0
        assert drive(scenes, question, "rss")[0][columns.R_BRAKING_TIME] < 3.0


def test_standing_passengers_need_more_time(scenes: np.ndarray) -> None:
    by_edition = [
        obligations(scenes, name).sum()
        for name in ("eu-2022-1426-standing", "r157", "eu-2022-1426")
    ]
    assert by_edition == sorted(by_edition)
    assert by_edition[0] < by_edition[2]


def test_defaults_fill_what_the_file_does_not_say(scenes: np.ndarray) -> None:
    assert set(scenes[:, columns.S_LANE_WIDTH]) == {3.5}
    assert set(scenes[:, columns.S_EGO_WIDTH]) == {1.9}


def test_least_gap_of_a_scene_is_none_at_all(tmp_path: Path) -> None:
    path = tmp_path / "cases.csv"
    for scene, other in (
        ("cut_out", "front_gap_m,lateral_speed_mps"),
        ("deceleration", "max_deceleration_mps2"),
    ):
        header = f"ego_speed_mps,other_speed_mps,gap_m,{other}\n20,20"
        rest = ",6" * len(other.split(","))
        path.write_text(f"{header},0{rest}", "utf-8")
        scenes = read(path, scene)[1]
        assert scenes[0, columns.S_GAP] == 0.0
        assert drive(scenes, Question(scene), "cc")[0, columns.R_MIN_GAP] <= 0.0
        path.write_text(f"{header},-0.1{rest}", "utf-8")
        refused(UsageError, read, path, scene, says=r"gap_m is '-0\.1'")


def test_question_without_models_and_what_is_no_plain_number_are_refused(tmp_path: Path) -> None:
    refused(UsageError, check_question, Question(models=()), says="no model")
    path = tmp_path / "cases.csv"
    for speed in ("\uff11\uff10", "1_0", "nan"):
        path.write_text(f"{HEADER}\n30,{speed},80,1\n", "utf-8")
        refused(UsageError, read, path, "cut_in", says=r"cases\.csv:2: other_speed_mps")
