"""``preventability`` and ``reference``."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

# --- ``adeye preventability``: the table, the findings, and what it refuses


@pytest.mark.slow
def test_findings_are_listed_with_their_commands(adeye: Any, copied: str) -> None:
    done = adeye("preventability", "--db", copied, "--model", "cc,rss").ok
    assert "Only the model" in done.out
    assert "findings, avoided by the model only:" in done.out
    assert done.out.count("adeye replay ") == 2
    assert "m/s² required), without faults" in done.out
    drive = done.out.splitlines()[-3].split()[2]
    shown = adeye("show", drive, "--db", copied, "--json").document
    assert shown["architecture"] in {"reference_cc", "reference_rss"}


@pytest.mark.slow
def test_json_has_every_run(adeye: Any, copied: str) -> None:
    found = adeye("preventability", "1", "--db", copied, "--all", "--json").document
    assert found["edition"] == "r157-01"
    assert len(found["comparisons"]) == found["executed"] == found["looked_at"]["cc"] == 28
    cells = [item["cell"] for item in found["comparisons"]]
    assert "only_model" in cells
    assert "unknown" not in cells


@pytest.mark.slow
def test_without_a_conflict_it_says_so(adeye: Any, copied: str) -> None:
    sql = "SELECT run FROM v_runs WHERE contact = 0"
    one = adeye("query", sql, "--db", copied, "--format", "csv").out.split()[1]
    assert "No finding" in adeye("preventability", one, "--db", copied).out


def test_bad_input_is_refused(adeye: Any, copied: str) -> None:
    for options, text in (
        (["--model", "rrs"], "Did you mean 'rss'?"),
        (["--edition", "r157-1"], "Did you mean 'r157-01'?"),
        (["--threshold", "4"], "no unit"),
        (["--threshold=-4 m/s^2"], "Give a deceleration above zero"),
        (["ffff0000"], "there is none"),
    ):
        assert text in adeye("preventability", "--db", copied, *options).refused


# --- ``reference`` on small files: rows, JSON, and what it refuses


HEADER = "case,ego_speed_mps,other_speed_mps,gap_m,lateral_speed_mps"
ROWS = ("far,16,8,30,1", "near,36,10,12,3")


@pytest.fixture
def cases(tmp_path: Path) -> Path:
    path = tmp_path / "cases.csv"
    path.write_text("\n".join((HEADER, *ROWS)), encoding="utf-8")
    return path


def read(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_one_row_per_scene_is_written(adeye: Any, cases: Path) -> None:
    out = cases.with_name("out.csv")
    assert "A benchmark, not a proof" in adeye("reference", str(cases), "-o", str(out)).ok.out
    far, near = read(out)
    assert (far["case"], far["reg157_must_be_avoided"]) == ("far", "yes")
    for model in ("cc", "fsm", "rss", "reg157"):
        assert (far[f"{model}_contact"], near[f"{model}_contact"]) == ("no", "yes")
        assert far[f"{model}_impact_speed_mps"] == ""
        assert float(near[f"{model}_impact_speed_mps"]) > 0.0
        assert float(far[f"{model}_min_gap_m"]) > 0.0


def test_json_counts_and_lists_scenes(adeye: Any, cases: Path) -> None:
    document = adeye("reference", str(cases), "--models", "fsm,cc", "--json").document
    assert [item["model"] for item in document["models"]] == ["fsm", "cc"]
    assert [item["contacts"] for item in document["models"]] == [1, 1]
    assert [case["cc"]["contact"] for case in document["cases"]] == [False, True]
    assert document["cases"][0]["cc"]["impact_speed_mps"] is None


def test_variant_changes_the_answer(adeye: Any, cases: Path) -> None:
    cases.write_text(f"{HEADER}\nlate,33,20,36,1", encoding="utf-8")
    text, code = (
        adeye("reference", str(cases), "--models", "cc", "--json", *more).document["cases"][0]["cc"]
        for more in ((), ("--variant", "jrc"))
    )
    assert text != code


def test_speed_beyond_the_edition_is_told(adeye: Any, cases: Path) -> None:
    said = adeye("reference", str(cases), "--edition", "r157").err
    assert "1 of 2 scenes are faster than 60 km/h" in said


def test_missing_gap_is_the_own_following_distance(adeye: Any, cases: Path) -> None:
    for scene, content in (
        ("cut_out", "ego_speed_mps,other_speed_mps,front_gap_m,lateral_speed_mps\n20,20,60,1"),
        ("deceleration", "ego_speed_mps,other_speed_mps,gap_m,max_deceleration_mps2\n20,20,,6"),
    ):
        cases.write_text(content, encoding="utf-8")
        document = adeye("reference", str(cases), "--scene", scene, "--json").document
        assert all(item["undecided"] == 0 for item in document["models"])
        assert document["cases"][0]["cc"]["contact"] is False
        assert document["models"][0]["must_be_avoided"] is None


def test_bad_row_is_told_with_its_line(adeye: Any, cases: Path) -> None:
    for row, message in (
        ("a,-1,8,30,1", "cases.csv:2: ego_speed_mps is '-1'"),
        ("a,0,8,30,1", "cases.csv:2: ego_speed_mps is '0'"),
        ("a,16,nan,30,1", "cases.csv:2: other_speed_mps is 'nan'"),
        ("a,16,8,,1", "cases.csv:2: gap_m is ''"),
        ("a,16,8,far,1", "cases.csv:2: gap_m is 'far'"),
        ("a,16,8,30,inf", "cases.csv:2: lateral_speed_mps is 'inf'"),
        ("a,16,8,30", "cases.csv:2: the row has not as many cells"),
        ("", "holds no scene"),
    ):
        cases.write_text(f"{HEADER}\n{row}", encoding="utf-8")
        assert message in adeye("reference", str(cases)).refused.replace("\n", " ")


def test_unknown_option_is_refused(adeye: Any, cases: Path) -> None:
    for option, value, message in (
        ("--models", "idm", "there is no model 'idm'"),
        ("--models", ",", "no model is named"),
        ("--edition", "r79", "there is no edition 'r79'"),
        ("--variant", "x", "there is no variant 'x'"),
        ("--scene", "x", "there is no scene 'x'"),
        ("--integrator", "x", "there is no integrator 'x'"),
        ("--step", "1", "the step of 1 s is not allowed"),
    ):
        said = adeye("reference", str(cases), option, value).refused
        assert message in said.replace("\n", " ")


def test_missing_column_and_file_are_refused(adeye: Any, cases: Path) -> None:
    cases.write_text("gap_m\n1", encoding="utf-8")
    assert "has no column 'ego_speed_mps'" in adeye("reference", str(cases)).err
    cases.unlink()
    assert adeye("reference", str(cases)).code == 2


def test_misspelt_optional_column_is_refused(adeye: Any, cases: Path) -> None:
    required = {
        "cut_in": HEADER.removeprefix("case,"),
        "deceleration": "ego_speed_mps,other_speed_mps,max_deceleration_mps2",
    }
    for scene, name, meant in (
        ("cut_in", "lateral_offset", "lateral_offset_m"),
        ("cut_in", "ego_length", "ego_length_m"),
        ("cut_in", "latral_offset_m", "lateral_offset_m"),
        ("cut_in", "Ego_Width_m", "ego_width_m"),
        ("deceleration", "jerk", "jerk_mps3"),
        ("deceleration", "gap", "gap_m"),
        ("deceleration", "Ego_Speed_mps", "ego_speed_mps"),
    ):
        cells = ",".join(["8"] * (required[scene].count(",") + 2))
        cases.write_text(f"{required[scene]},{name}\n{cells}", encoding="utf-8")
        said = adeye("reference", str(cases), "--scene", scene).refused
        assert f"{cases}:1: column {name!r} is none that is read" in said
        assert f"Write {meant!r}" in said


def test_answers_are_not_written_twice_into_one_header(adeye: Any, cases: Path) -> None:
    one, two = cases.with_name("one.csv"), cases.with_name("two.csv")
    assert adeye("reference", str(cases), "--models", "cc", "-o", str(one)).code == 0
    again = ("reference", str(one), "--variant", "jrc")
    said = adeye(*again, "-o", str(two)).refused.replace("\n", " ")
    assert f"{one}:1: there is a column 'cc_contact' already" in said
    assert not two.exists()
    # Without an output nothing is written twice; other names are answered beside the old ones.
    assert adeye(*again).code == 0
    header, _, rest = one.read_text("utf-8").partition("\n")
    header = header.replace(",cc_", ",text_").replace(",reg", ",old_reg")
    one.write_text(f"{header}\n{rest}", "utf-8")
    assert adeye(*again, "-o", str(two)).code == 0
    names = two.read_text("utf-8").splitlines()[0].split(",")
    assert len(set(names)) == len(names)
    assert {"text_contact", "cc_contact"} <= set(names)


def test_growth_of_the_sideways_speed_is_a_column(adeye: Any, cases: Path) -> None:
    def answers(cells: str) -> Any:
        cases.write_text(f"{HEADER},lateral_acceleration_mps2\n{cells}", encoding="utf-8")
        return adeye("reference", str(cases), "--json")

    at_once, growing = answers("a,25,10,12,1.5,"), answers("a,25,10,12,1.5,1.5")
    assert at_once.document["cases"] != growing.document["cases"]
    # The scene begins a second earlier and the rule sees the movement for as long.
    assert at_once.document["cases"][0]["must_be_avoided"] is False
    assert "lateral_acceleration_mps2 is '0'" in answers("a,25,10,12,1.5,0").refused


def test_columns_of_others_are_handed_through(adeye: Any, cases: Path) -> None:
    theirs = {"id": "7", "name": "x", "ego_speed_kmh": "57.6", "front_gap_m": "9"}
    header, cells = (",".join(part) for part in (theirs, theirs.values()))
    cases.write_text(f"{HEADER},{header}\nfar,16,8,30,1,{cells}", encoding="utf-8")
    out = cases.with_name("out.csv")
    assert adeye("reference", str(cases), "-o", str(out)).code == 0
    (row,) = read(out)
    assert row.items() >= theirs.items()
