"""``sensors`` on the shipped files: tables, JSON, page, and what it refuses."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.analysis.suite.analyse import analyse
from adeye.cli.sensors import print_suites
from adeye.spec.load import shipped
from tests.analysis.suite.rigs import all_around, architecture, radar

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


def test_json_holds_the_whole_analysis(adeye: Any) -> None:
    ended = adeye("sensors", CANDIDATE, LEGACY, "--json").ok
    document = ended.document
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


def test_tables_fit_a_hundred_columns(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    ended = adeye("sensors", CANDIDATE, LEGACY, str(FILES / "lidar.yaml")).ok
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
    ended = adeye("sensors", CANDIDATE, "--html", "out/suites.html").ok
    assert ended.err == "wrote out/suites.html\n"
    assert "<svg" in (folder / "out" / "suites.html").read_text("utf-8")


def test_plug_in_sensor_is_named_as_not_analysed(adeye: Any, folder: Path) -> None:
    path = changed(folder, sonar={"kind": "./own.py:Sonar", "rate": "10 Hz"})
    ended = adeye("sensors", path).ok
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
    broken.write_text(text.replace("range: 120 m", "range: 120 s"))
    ended = adeye("sensors", str(broken), "--json")
    assert "changed.yaml:" in ended.refused


# --- tables of suites: several side by side, and a suite that sees nothing


pytestmark = pytest.mark.usefixtures("folder")


def printed(capfd: pytest.CaptureFixture[str], *sensors: dict[str, Any]) -> str:
    print_suites(
        [
            analyse(architecture(each, architecture=f"suite_{number}"))
            for number, each in enumerate(sensors)
        ]
    )
    return capfd.readouterr().out


def test_suites_stand_side_by_side(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"eye": radar()}, {"roof": all_around(range=70.0)})
    heads = [line for line in text.splitlines() if "Zone" in line]
    assert heads
    assert all("suite_0" in line and "suite_1" in line for line in heads)


def test_suite_without_eyes_supports_no_speed(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"truth": {"kind": "ground_truth", "rate": 20.0}})
    line = next(line for line in text.splitlines() if "stopped car" in line)
    assert line.split()[-1] == "none"
    assert "Not analysed (no devices): suite_0.truth." in text


def test_suite_that_sees_everything_has_no_blind_spot(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"roof": all_around(range=300.0)})
    assert "No blind spot in any zone." in text
    assert "100/0/0 | 0" in text


def test_critical_sensor_and_shared_element_are_marked(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(
        capfd, {"a": radar(realises="radars"), "b": radar(range=50.0, realises="radars")}
    )
    assert "  a (critical)" in text
    assert "radars (element, 2 sensors)" in text


def test_speed_from_which_a_pedestrian_is_seen_is_told(capfd: pytest.CaptureFixture[str]) -> None:
    text = printed(capfd, {"eye": radar(field_of_view=0.3)})
    line = next(line for line in text.splitlines() if "crossing pedestrian" in line)
    assert "(from 34)" in line
