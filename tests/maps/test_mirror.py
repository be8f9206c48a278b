"""Left-hand roads are mirror images of right-hand ones: of records, places and what is checked."""

from pathlib import Path
from typing import Any

import pytest

from adeye.maps.carriageway import Lanes
from adeye.maps.mirror import mirrored
from adeye.maps.opendrive import OpenDrive
from adeye.maps.opendrive_reader import read_opendrive
from adeye.maps.places import Asked, places_of
from adeye.maps.topology import check_topology
from tests.maps.test_opendrive_writer import content, everything
from tests.maps.test_own_maps import CATALOGUE, CONTENT
from tests.mirroring import mirror

ANCHORS = {"rural": "carriageway", "ramp": "entry", "town": "carriageway"}


def both(name: str, folder: Path) -> tuple[OpenDrive, OpenDrive]:
    path = CATALOGUE / f"{name}.xodr"
    image = mirror(path, folder / path.name)
    return read_opendrive(path)[0], read_opendrive(image)[0]


def test_the_image_of_the_image_is_the_map() -> None:
    drive = everything()
    image = mirrored(drive)
    assert [road.left_hand for road in image.roads.values()] == [False]
    assert content(image) != content(drive) == content(mirrored(image))


@pytest.mark.parametrize("name", ["borders", "direct", "param_poly3", "poly3", "sections"])
def test_the_image_of_the_records_is_that_of_the_file(name: str, tmp_path: Path) -> None:
    path = CONTENT / f"{name}.xodr"
    image = read_opendrive(mirror(path, tmp_path / path.name))[0]
    assert content(image) == content(mirrored(read_opendrive(path)[0]))


@pytest.mark.parametrize(("name", "anchor"), ANCHORS.items())
def test_a_left_hand_map_has_the_places_of_its_image_to_the_bit(
    name: str, anchor: Any, tmp_path: Path
) -> None:
    found = [
        places_of(Lanes.of(drive), name, Asked(anchor, 50.0, 150.0))
        for drive in both(name, tmp_path)
    ]
    right, left = (item.places for item in found)
    assert right
    assert [place.key for place in left] == [place.key for place in right]
    assert [place.road for place in left] == [place.road for place in right]
    assert {place.left_hand for place in left} == {True}
    assert found[0].refused == found[1].refused


@pytest.mark.parametrize("name", ANCHORS)
def test_a_left_hand_map_is_found_as_sound_as_its_image(name: str, tmp_path: Path) -> None:
    right, left = (check_topology(drive) for drive in both(name, tmp_path))
    assert sorted(item.kind for item in left) == sorted(item.kind for item in right)
    assert {(item.x, -item.y) for item in left} == {(item.x, item.y) for item in right}
