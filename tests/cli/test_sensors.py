"""``sensors`` on the shipped files: tables, JSON, page, and what it refuses."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.spec.load import shipped

ODD = str(shipped("odd") / "motorway_chauffeur.yaml")
FILES = shipped("odd") / "architectures"
CANDIDATE = str(FILES / "camera_radar.yaml")
LEGACY = str(FILES / "legacy_camera.yaml")


def changed(folder: Path, **sensors: Any) -> str:
    """Write the candidate with more sensors."""
    content = yaml.safe_load(Path(CANDIDATE).read_text("utf-8"))
    content["sensors"] |= sensors
    path = folder / "changed.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(path)


@pytest.mark.slow
def test_json_holds_the_whole_analysis(adeye: Any) -> None:
    ended = adeye("sensors", CANDIDATE, LEGACY, "--json")
    assert ended.code == 0, ended.err
    document = ended.document
    assert document["schema"] == "adeye/sensors@1"
    assert document["odd"] is None
    candidate, legacy = document["suites"]
    assert (candidate["architecture"], legacy["architecture"]) == ("camera_radar", "legacy_camera")
    assert [item["id"] for item in candidate["conditions"]] == ["dry_day", "rain", "night"]
    assert candidate["critical"] == "front_radar"
    assert {item["id"] for item in candidate["not_analysed"]} == {"localisation", "truth"}
    assert set(candidate) >= {
        "bearings", "blind_spots", "chains", "coverage", "forward", "notes", "removals", "sensors",
        "slacks", "speeds", "whole", "zones",
    }  # fmt: skip
    share = candidate["coverage"][0]
    assert 0.0 <= share["seen_by_3"] <= share["seen_by_2"] <= share["seen_by_1"] <= 1.0


def test_odd_gives_conditions_speed_architectures_and_resources(adeye: Any) -> None:
    document = adeye("sensors", "--odd", ODD, "--json").document
    assert document["odd"] == "motorway_chauffeur"
    suites = {suite["architecture"]: suite for suite in document["suites"]}
    assert list(suites) == ["legacy_camera", "camera_radar"]
    candidate = suites["camera_radar"]
    assert [item["id"] for item in candidate["conditions"]] == ["best", "rain"]
    assert candidate["conditions"][1]["friction"] == 0.5
    assert candidate["odd_speed_mps"] == pytest.approx(130.0 / 3.6)
    assert candidate["forward"][0]["needed_m"] == 150.0
    resources = {item["what"] for item in candidate["removals"] if item["kind"] == "resource"}
    assert resources == {"power_a"}


def test_named_architecture_is_put_into_the_odd(adeye: Any) -> None:
    document = adeye("sensors", CANDIDATE, "--odd", ODD, "--json").document
    assert [suite["architecture"] for suite in document["suites"]] == ["camera_radar"]


@pytest.mark.slow
def test_tables_fit_a_hundred_columns(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    ended = adeye("sensors", CANDIDATE, LEGACY, str(FILES / "lidar.yaml"))
    assert ended.code == 0, ended.err
    tables = ended.out.split("\nConditions:")[0]
    assert max(map(len, tables.splitlines())) <= 100
    for title in ("Highest speed", "Range to spare", "Coverage", "Blind spots", "Loss of parts"):
        assert title in ended.out
    assert "Each target stands alone" in ended.out


def test_speed_below_that_of_the_odd_is_marked(adeye: Any) -> None:
    lines = adeye("sensors", "--odd", ODD).out.splitlines()
    stopped = next(line for line in lines if "stopped car" in line)
    legacy, _, candidate = stopped.partition("front_camera")
    assert "!" in legacy
    assert "!" not in candidate


def test_page_is_written(adeye: Any, folder: Path) -> None:
    ended = adeye("sensors", CANDIDATE, "--html", "out/suites.html")
    assert ended.code == 0, ended.err
    assert ended.err == "wrote out/suites.html\n"
    assert "<svg" in (folder / "out" / "suites.html").read_text("utf-8")


def test_plug_in_sensor_is_named_as_not_analysed(adeye: Any, folder: Path) -> None:
    path = changed(folder, sonar={"kind": "./own.py:Sonar", "rate": "10 Hz"})
    ended = adeye("sensors", path)
    assert ended.code == 0, ended.err
    line = next(line for line in ended.out.splitlines() if "plug-ins" in line)
    assert line.startswith("Not analysed")
    assert line.endswith("camera_radar.sonar.")


def test_what_cannot_be_analysed_is_an_input_error(adeye: Any, folder: Path) -> None:
    broken = Path(changed(folder))
    text = broken.read_text("utf-8")
    for arguments, parts in (
        (("missing.yaml",), ("missing.yaml",)),
        ((), ("Name architecture files, or an ODD with --odd.",)),
        ((ODD,), ()),
        ((CANDIDATE, str(broken)), ("camera_radar.yaml", "changed.yaml:")),
    ):
        ended = adeye("sensors", *arguments)
        assert all(part in ended.refused for part in parts)
        assert "Traceback" not in ended.err
        assert ended.out == ""
    broken.write_text(text.replace("range: 120 m", "range: 120 s"))
    ended = adeye("sensors", str(broken), "--json")
    assert "changed.yaml:" in ended.refused
    assert ended.out == ""
