"""Boxes in an image, against rays through every pixel and closed forms."""

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel import raster

if TYPE_CHECKING:
    from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
COLUMNS, ROWS = 40, 20


class Picture:
    """An image of boxes from one camera."""

    def __init__(
        self,
        place: tuple[float, float, float] = (0.0, 0.0, 1.5),
        heading: float = 0.0,
        pitch: float = 0.0,
        focal: float = 40.0,
    ) -> None:
        self.place, self.heading, self.pitch, self.focal = place, heading, pitch, focal
        self.pinhole = np.zeros(raster.VIEW_WIDTH)
        turn = math.sin(pitch), math.cos(pitch)
        raster.aim(place, heading, turn, focal, (COLUMNS, ROWS), self.pinhole)
        self.nearness: Floats = np.zeros((COLUMNS, ROWS))
        self.owner: Ints = np.full((COLUMNS, ROWS), raster.NOTHING, dtype=np.int64)
        self.span: Ints = np.zeros((COLUMNS, 2), dtype=np.int64)
        self.span[:, 0] = ROWS
        self.forms: Floats = np.zeros((raster.FORMS, raster.FORM_WIDTH))
        self.lines = 0
        self.count = 0

    def add(self, box: tuple[float, float, float], size: tuple[float, float, float]) -> int:
        """Draw a box; returns how many pixels it covers now."""
        lines, least, most = raster.trace(self.pinhole, np.array(box), np.array(size), self.forms)
        self.lines = lines
        if lines >= 0:
            image = self.nearness, self.owner, self.span
            raster.fill(self.forms, lines, least, most, self.count, *image)
        self.count += 1
        return int((self.owner == self.count - 1).sum())

    def cast(self, box: tuple[float, float, float], size: tuple[float, float, float]) -> Floats:
        """Inverse depth of a box in every pixel, by the intersection of each ray with its slabs."""
        s, c = math.sin(self.heading), math.cos(self.heading)
        ps, pc = math.sin(self.pitch), math.cos(self.pitch)
        forward = np.array([pc * c, pc * s, -ps])
        right, down = np.array([s, -c, 0.0]), np.array([-ps * c, -ps * s, -pc])
        u = (np.arange(COLUMNS) + 0.5 - 0.5 * COLUMNS) / self.focal
        v = (np.arange(ROWS) + 0.5 - 0.5 * ROWS) / self.focal
        rays = forward + u[:, None, None] * right + v[None, :, None] * down
        s, c = math.sin(box[2]), math.cos(box[2])
        axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        origin = axes @ (np.array(self.place) - np.array([box[0], box[1], 0.5 * size[2]]))
        speed = rays @ axes.T
        near, far = np.full((COLUMNS, ROWS), raster.NEAR), np.full((COLUMNS, ROWS), np.inf)
        for k in range(3):
            with np.errstate(divide="ignore", invalid="ignore"):
                ends = [(sign * 0.5 * size[k] - origin[k]) / speed[..., k] for sign in (-1, 1)]
            level = speed[..., k] == 0.0
            inside = abs(origin[k]) <= 0.5 * size[k]
            near = np.where(level & inside, near, np.maximum(near, np.minimum(*ends)))
            far = np.where(level & inside, far, np.minimum(far, np.maximum(*ends)))
            far = np.where(level & (not inside), -np.inf, far)
        return np.where(near <= far, 1.0 / near, 0.0)


@pytest.mark.parametrize("distance", [1.0, 3.0, 10.0, 30.0])
@pytest.mark.parametrize("pitch", [0.0, 0.1, -0.3])
def test_pixels_and_depths_are_those_of_rays(distance: float, pitch: float) -> None:
    draw = np.random.default_rng(int(10 * distance) + round(100 * abs(pitch)))
    covered = 0
    for _ in range(25):
        heading = draw.uniform(-3.0, 3.0)
        picture = Picture((*draw.uniform(-5.0, 5.0, 2), draw.uniform(0.3, 3.0)), heading, pitch)
        bearing = heading + draw.uniform(-0.6, 0.6)
        x = picture.place[0] + distance * math.cos(bearing)
        y = picture.place[1] + distance * math.sin(bearing)
        # As often along the view as not, where forms lose a coefficient.
        turn = heading if draw.random() < 0.3 else draw.uniform(-3.0, 3.0)
        length, width, height = draw.uniform(0.3, 6.0, 3)
        picture.add((x, y, turn), (length, width, height))
        expected = picture.cast((x, y, turn), (length, width, height))
        assert ((picture.owner == 0) == (expected > 0.0)).all()
        np.testing.assert_allclose(picture.nearness, expected, rtol=1e-9, atol=1e-12)
        covered += int((expected > 0.0).sum())
    assert covered > 100


def test_camera_inside_a_box_or_on_its_face_sees_its_cut_everywhere() -> None:
    for box in ((0.0, 0.0, 0.3), (2.0, 0.0, 0.0)):
        picture = Picture()
        assert picture.add(box, (4.0, 2.0, 3.0)) == COLUMNS * ROWS
        assert (picture.nearness == 1.0 / raster.NEAR).all()


@pytest.mark.parametrize("box", [(-20.0, 0.0, 0.0), (10.0, 60.0, 0.0), (10.0, -60.0, 0.0)])
def test_box_behind_or_beside_the_image_takes_no_pixel(box: tuple[float, float, float]) -> None:
    picture = Picture()
    assert picture.add(box, (4.0, 2.0, 1.5)) == 0
    assert (picture.span == [ROWS, 0]).all()


@pytest.mark.parametrize("place", range(3))
def test_box_that_is_no_number_takes_no_pixel(place: int) -> None:
    for what in range(2):
        box, size = [10.0, 0.0, 0.0], [4.0, 2.0, 1.5]
        (box, size)[what][place] = math.nan
        picture = Picture()
        assert picture.add((box[0], box[1], box[2]), (size[0], size[1], size[2])) == 0


def test_nearest_box_wins_in_any_order() -> None:
    near, far = ((10.0, 0.0, 0.0), (2.0, 2.0, 1.5)), ((20.0, 0.5, 0.2), (4.0, 6.0, 3.0))
    one, other = Picture(), Picture()
    for picture, order in ((one, (near, far)), (other, (far, near))):
        for box in order:
            picture.add(*box)
    assert np.array_equal(one.nearness, other.nearness)
    assert np.array_equal(one.owner == 0, other.owner == 1)
    assert {0, 1} <= set(one.owner.ravel().tolist())


def test_span_holds_every_pixel_that_is_in_use() -> None:
    picture = Picture()
    picture.add((8.0, -1.0, 0.4), (2.0, 2.0, 1.5))
    picture.add((20.0, 3.0, 0.2), (4.0, 4.0, 3.0))
    rows = np.arange(ROWS)[None, :]
    inside = (rows >= picture.span[:, :1]) & (rows < picture.span[:, 1:])
    assert (inside | (picture.owner == raster.NOTHING)).all()
    assert inside.sum() < 0.5 * inside.size


def test_covers_tells_what_is_drawn() -> None:
    picture = Picture(pitch=0.05)
    picture.add((9.0, 0.5, 0.7), (3.0, 2.0, 2.5))
    drawn = picture.owner == 0
    for column in range(COLUMNS):
        for row in range(ROWS):
            inside = raster.covers(picture.forms, picture.lines, float(column), float(row))
            assert inside == drawn[column, row]


def test_covers_reaches_beyond_the_image() -> None:
    picture = Picture((0.0, 0.0, 1.0))
    # 20 m high and 10 m away: its top is 76 rows above the horizon.
    picture.add((10.5, 0.0, 0.0), (1.0, 2.0, 20.0))
    assert raster.covers(picture.forms, picture.lines, 0.5 * COLUMNS, 0.5 * ROWS - 70.0)
    assert not raster.covers(picture.forms, picture.lines, 0.5 * COLUMNS, 0.5 * ROWS - 80.0)


# --- Connected parts of small images that are written down as text --------------------------------

CLASSES = np.array([0, 0, 6, 0], dtype=np.int64)
"""Objects 0, 1 and 3 are of one class, 2 of another."""
DEPTHS = {0: 10.0, 1: 20.0, 2: 15.0, 3: 10.5}


class Parts:
    """The parts of an image: '.' shows nothing, '?' a ghost, digits are objects."""

    def __init__(self, *lines: str) -> None:
        signs = {".": raster.NOTHING, "?": raster.GHOST}
        rows = [[signs[sign] if sign in signs else int(sign) for sign in line] for line in lines]
        self.owner: NDArray[np.int64] = np.array(rows, dtype=np.int64).T.copy()
        columns, height = self.owner.shape
        nearness = np.zeros(self.owner.shape)
        for thing, depth in DEPTHS.items():
            nearness[self.owner == thing] = 1.0 / depth
        span = np.tile(np.array([0, height], dtype=np.int64), (columns, 1))
        self.runs: NDArray[np.int64] = np.zeros((self.owner.size, raster.RUN_WIDTH), dtype=np.int64)
        self.count = raster.find_parts(0, columns, span, self.owner, nearness, CLASSES, self.runs)
        self.numbers = [k for k in range(self.count) if self.runs[k, raster.RUN_PARENT] == k]

    def column(self, column: int) -> list[int]:
        return [int(self.runs[part, column]) for part in self.numbers]

    def owners(self) -> list[int]:
        votes = np.zeros(len(CLASSES), dtype=np.int64)
        return [
            raster.main_owner(part, self.count, self.owner, self.runs, votes)
            for part in self.numbers
        ]


def test_box_is_one_part_with_its_extent() -> None:
    assert Parts("....", "....").numbers == []
    parts = Parts("....", ".00.", ".00.", "....")
    assert len(parts.numbers) == 1
    assert parts.column(raster.PART_FIRST) + parts.column(raster.PART_LAST) == [1, 2]
    assert parts.column(raster.PART_TOP) + parts.column(raster.PART_STOP) == [1, 3]
    assert (parts.column(raster.PART_PIXELS), parts.column(raster.PART_CONTACT)) == ([4], [2])
    assert parts.owners() == [0]


def test_pixels_of_a_part_are_connected_by_their_sides() -> None:
    images: dict[str, tuple[tuple[str, ...], list[int]]] = {
        "two that meet at a corner": (("0..", ".0.", "..."), [1, 1]),
        "a U, which begins as two": (("0.0", "0.0", "000", "..."), [7]),
        "a comb": (("00000", "0.0.0", "0.0.0", "....."), [11]),
        "a comb upside down": (("0.0.0", "0.0.0", "00000", "....."), [11]),
        "a ring, whose hole is nobody's": (("000", "0.0", "000", "..."), [8]),
    }
    for what, (lines, pixels) in images.items():
        assert Parts(*lines).column(raster.PART_PIXELS) == pixels, what
    u = Parts("0.0", "0.0", "000", "...")
    assert u.column(raster.PART_FIRST) + u.column(raster.PART_LAST) == [0, 2]


def test_owner_of_a_part_is_whose_pixels_are_most() -> None:
    assert 1.0 - DEPTHS[0] / DEPTHS[1] > raster.EDGE > 1.0 - DEPTHS[0] / DEPTHS[3]
    images: dict[str, tuple[tuple[str, ...], list[int]]] = {
        "classes that touch are two parts": (("0022", "0022", "...."), [0, 2]),
        "so are depths that jump": (("0011", "0011", "...."), [0, 1]),
        "objects of one class at one depth melt together": (("0033", "0033", "...3"), [3]),
        "above each other, too": (("333", "333", "000", "..."), [3]),
        "equal shares name the first": (("0033", "0033", "...."), [0]),
        "a ghost has none": (("??00", "??00", "...."), [-1, 0]),
    }
    for what, (lines, owners) in images.items():
        assert Parts(*lines).owners() == owners, what
    assert sorted(Parts("1111", "1001", ".00.", "....").owners()) == [0, 1]
    assert Parts("0022", "0022", "....").column(raster.RUN_CLASS) == [0, 6]
    assert Parts("??00", "??00", "....").column(raster.RUN_CLASS) == [-1, 0]
    assert Parts("0033", "0033", "...3").column(raster.PART_PIXELS) == [9]


def test_contact_is_the_foot_of_the_columns_in_which_it_is_seen() -> None:
    images: dict[str, tuple[tuple[str, ...], list[int]]] = {
        "hidden behind what is below": (("1111", "2222", "...."), [-1, 1]),
        "free in some columns": (("1111", "1122", "..22", "...."), [1, 2]),
        "below the image": (("....", "0000"), [-1]),
        "missing pixels do not lift it": (("000", "0.0", "000", "..."), [2]),
    }
    for what, (lines, contacts) in images.items():
        assert Parts(*lines).column(raster.PART_CONTACT) == contacts, what


def test_nearest_columns_of_a_part_are_the_first_and_the_last_whose_foot_is_nearest() -> None:
    images = {
        ("333", "303", "..."): (1, 1),
        ("33", "00", ".."): (0, 1),
        ("3300", "3300", "...."): (2, 3),
        ("0030", "0030", "...."): (0, 3),
    }
    for lines, columns in images.items():
        parts = Parts(*lines)
        for part, column in zip(
            (raster.PART_NEAREST, raster.PART_NEAREST_LAST), columns, strict=True
        ):
            assert parts.runs[parts.column(part), raster.RUN_COLUMN] == [column], lines


def test_mirrored_image_has_mirrored_parts() -> None:
    draw = np.random.default_rng(5)
    signs = np.array(list("...0123?"))
    for _ in range(40):
        lines = ["".join(signs[draw.integers(0, 8, 9)]) for _ in range(6)] + ["." * 9]
        one, other = Parts(*lines), Parts(*(line[::-1] for line in lines))
        for column in (raster.PART_PIXELS, raster.PART_TOP, raster.PART_STOP, raster.PART_CONTACT):
            assert sorted(one.column(column)) == sorted(other.column(column))
        assert sum(one.column(raster.PART_PIXELS)) == sum(9 - line.count(".") for line in lines)
