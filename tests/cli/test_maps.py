"""Verbs of maps: what they show, what they write, what they refuse, how they end."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.maps.opendrive_reader import read_opendrive
from adeye.maps.opendrive_writer import write_opendrive
from adeye.spec.load import catalogue_files
from tests.cli.conftest import Verb
from tests.drawn_roads import WIDE, crossing, lane, network, piece, road, section
from tests.stored import write_yaml

MALFORMED = Path(__file__).parents[1] / "malformed"
SMALL = str(MALFORMED / "small.xodr")


def test_show_counts_what_a_map_holds(adeye: Any) -> None:
    document = adeye("map", "show", SMALL, "--json").ok.document
    assert {key: document[key] for key in ("roads", "length_m", "junctions", "lanes")} == {
        "roads": 5,
        "length_m": 140.0,
        "junctions": 1,
        "lanes": 11,
    }
    assert (document["driving_lanes"], document["signals"], document["losses"]) == (11, 1, [])
    kinds = {"line": 5, "spiral": 1, "arc": 1, "poly3": 1, "paramPoly3": 1}
    assert document["geometry"] == kinds
    out = adeye("map", "show", SMALL).ok.out
    for part in ("OpenDRIVE 1.6", "5, 0.140 km", "+proj=utm", "taken as it is written"):
        assert part in out


def test_losses_are_a_table_and_refused_if_strict(adeye: Any, folder: Path) -> None:
    text = Path(SMALL).read_text("utf-8")
    (folder / "map.xodr").write_text(text.replace('rule="RHT"', 'rule="RHT" fun="1"'), "utf-8")
    out = adeye("map", "show", "map.xodr").ok.out
    assert out.splitlines()[-1].split() == ["ignored", "road@fun", "5", "7", "is", "not", "read"]
    refused = adeye("map", "show", "map.xodr", "--strict").refused
    assert "map.xodr:7:3: road@fun: is not read, 5 times" in refused


def test_import_gives_the_same_files_again(adeye: Any, folder: Path) -> None:
    written = []
    for name in ("one", "two"):
        document = adeye("map", "import", SMALL, "-o", name, "--json").ok.document
        assert [Path(path).parent.name for path in document["written"]] == [name, name]
        written.append({path.name: path.read_bytes() for path in (folder / name).iterdir()})
    assert written[0] == written[1]
    assert sorted(written[0]) == ["small.losses.json", "small.network.npz"]
    with np.load(folder / "one" / "small.network.npz") as arrays:
        assert len(arrays["lane"]) == 11
        assert arrays["first_segment"][-1] == len(arrays["segments"])


def test_import_writes_over_nothing_else(adeye: Any, folder: Path) -> None:
    (folder / "small.network.npz").symlink_to(SMALL)
    assert "would be overwritten" in adeye("map", "import", SMALL, "-o", ".").refused


def test_steep_road_is_told_apart(adeye: Any, folder: Path) -> None:
    text = Path(SMALL).read_text("utf-8")
    leans = '<lateralProfile><superelevation s="0" a="0" b="0.01" c="0" d="0"/></lateralProfile>'
    (folder / "map.xodr").write_text(text.replace("<lanes>", f"{leans}<lanes>", 1), "utf-8")
    said = adeye("map", "show", "map.xodr", "--json").ok.err
    assert "note: map.xodr:19: road '1': superelevation of up to 100 % is not driven" in said


@pytest.fixture
def sound(folder: Path) -> Path:
    """Return a map that holds together, drawn by somebody."""
    path = folder / "sound.xodr"
    path.write_bytes(write_opendrive(crossing()).replace(b'vendor="adeye"', b'vendor="other"'))
    return path


def test_check_ends_well_with_notes_and_badly_with_errors(
    adeye: Verb, sound: Path, folder: Path
) -> None:
    good = adeye("map", "check", str(sound), "--json")
    document = json.loads(good.out)
    assert (good.code, document["errors"], document["notes"]) == (0, 0, 2)
    tight = road([piece("arc", 5.0, -0.3)], section(lane(0), lane(-1, WIDE)))
    bad = folder / "tight.xodr"
    bad.write_bytes(write_opendrive(network(tight)))
    outcome = adeye("map", "check", str(bad))
    assert outcome.code == 1
    assert "tight.xodr:18: error: tight: road 1, section 0, lane -1, s " in outcome.out
    assert adeye("map", "check", str(folder / "none.xodr")).code == 2


def test_draw_writes_a_picture(adeye: Verb, sound: Path, folder: Path) -> None:
    assert adeye("map", "draw", str(sound), "-o", "map.svg").code == 0
    assert "</svg>" in (folder / "map.svg").read_text()


def test_export_writes_lanes_and_a_map_that_reads_the_same(
    adeye: Verb, sound: Path, folder: Path
) -> None:
    verb = "map", "export", str(sound), "--xodr", "out.xodr", "--lanes", "lanes.csv", "--step", "50"
    assert adeye(*verb).code == 0
    first = (folder / "out.xodr").read_bytes()
    assert read_opendrive(folder / "out.xodr")[0].roads.keys() == crossing().roads.keys()
    lanes = (folder / "lanes.csv").read_text().splitlines()
    assert lanes[0] == "road,lane,s_m,x_m,y_m,heading_rad,width_m"
    assert len(lanes) == 1 + 2 * 2 * 3 + 2 * 2
    assert adeye(*verb).code == 0
    assert (folder / "out.xodr").read_bytes() == first


def test_export_of_a_scenario_is_its_road(adeye: Verb, folder: Path) -> None:
    scenario = catalogue_files(None)["motorway_bay_curve"]
    assert adeye("map", "export", str(scenario), "--xodr", "out.xodr").code == 0
    (only,) = read_opendrive(folder / "out.xodr")[0].roads.values()
    assert [lane.type for lane in only.sections[0].lanes].count("parking") == 1


def test_export_of_a_scenario_in_left_hand_traffic_is_where_it_is(
    adeye: Verb, folder: Path
) -> None:
    content = {
        "extends": "free_driving_curve",
        "scenario": "left",
        "world": {"road": {"traffic": "left"}},
    }
    write_yaml(folder / "left.yaml", content)
    assert adeye("map", "export", "left.yaml", "--xodr", "out.xodr").code == 0
    (only,) = read_opendrive(folder / "out.xodr")[0].roads.values()
    assert only.left_hand
    assert min(lane.id for lane in only.sections[0].lanes) == 0
    assert only.geometries[-1].y < 0.0


def test_export_of_a_scenario_on_a_map_is_refused(adeye: Verb) -> None:
    scenario = catalogue_files(None)["rural_bends"]
    outcome = adeye("map", "export", str(scenario), "--xodr", "out.xodr")
    assert outcome.code == 2
    assert "its roads are those of a map" in outcome.err


@pytest.mark.parametrize("options", [(), ("--lanes", "a.csv", "--step", "0")])
def test_export_of_nothing_is_refused(adeye: Verb, sound: Path, options: tuple[str, ...]) -> None:
    assert adeye("map", "export", str(sound), *options).code == 2


def test_map_that_somebody_drew_is_not_written_over(adeye: Verb, sound: Path, folder: Path) -> None:
    other = folder / "other.xodr"
    other.write_bytes(sound.read_bytes())
    outcome = adeye("map", "export", str(sound), "--xodr", str(other))
    assert (outcome.code, other.read_bytes()) == (2, sound.read_bytes())
    assert "is a map that adeye has not written" in outcome.err
    assert adeye("map", "export", str(sound), "--xodr", str(sound)).code == 2


def test_show_names_the_places_of_a_scenario_and_counts_the_others(adeye: Any) -> None:
    document = adeye("scenario", "show", "works_queue", "--json").ok.document
    keys = [item["key"] for item in document["places"]]
    assert (len(keys), keys[0], document["places"][0]["lanes"]) == (7, "ramp:13+110", 3)
    out = adeye("scenario", "show", "works_queue").ok.out
    assert "Places: 7 of 7, 0 refused" in out
    assert all(key in out for key in keys)


def test_a_place_that_is_listed_twice_is_told_with_its_line(adeye: Any, folder: Path) -> None:
    assert adeye("init", "--example", "ramp").ok
    path = folder / "odd" / "ramp.yaml"
    text = path.read_text("utf-8")
    begin = text.index("place: [") + len("place: [")
    first = text[begin : text.index(",", begin)]
    path.write_text(f"{text[:begin]}{first}, {text[begin:]}", "utf-8")
    line = text[:begin].count("\n") + 1
    said = adeye("plan", "odd/ramp.yaml").refused
    assert f"odd/ramp.yaml:{line}:" in said
    assert f"place: a value occurs twice, as '{first}'" in said
