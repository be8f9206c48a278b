"""``map show|import``: what a map holds, what of it is lost, and what is written of it."""

from pathlib import Path
from typing import Any

import numpy as np

CONTENT = Path(__file__).parents[1] / "content" / "maps"
SMALL = str(CONTENT / "small.xodr")


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
