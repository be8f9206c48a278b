"""Boxes in an image, against rays through every pixel and closed forms."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel.raster import (
    FORM_WIDTH,
    FORMS,
    NEAR,
    NOTHING,
    VIEW_WIDTH,
    aim,
    covers,
    fill,
    trace,
)

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
        self.pinhole = np.zeros(VIEW_WIDTH)
        sine, cosine = math.sin(pitch), math.cos(pitch)
        aim(*place, heading, sine, cosine, focal, COLUMNS, ROWS, self.pinhole)
        self.nearness: Floats = np.zeros((COLUMNS, ROWS))
        self.owner: Ints = np.full((COLUMNS, ROWS), NOTHING, dtype=np.int64)
        self.span: Ints = np.zeros((COLUMNS, 2), dtype=np.int64)
        self.span[:, 0] = ROWS
        self.forms: Floats = np.zeros((FORMS, FORM_WIDTH))
        self.lines = 0
        self.count = 0

    def add(self, box: tuple[float, float, float], size: tuple[float, float, float]) -> int:
        """Draw a box; returns how many pixels it covers now."""
        lines, least, most = trace(self.pinhole, np.array(box), np.array(size), self.forms)
        self.lines = lines
        if lines >= 0:
            fill(
                self.forms,
                lines,
                least,
                most,
                self.count,
                self.nearness,
                self.owner,
                self.span,
            )
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
        near, far = np.full((COLUMNS, ROWS), NEAR), np.full((COLUMNS, ROWS), np.inf)
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


def test_camera_inside_a_box_sees_its_cut_everywhere() -> None:
    picture = Picture()
    assert picture.add((0.0, 0.0, 0.3), (4.0, 2.0, 3.0)) == COLUMNS * ROWS
    assert (picture.nearness == 1.0 / NEAR).all()


@pytest.mark.slow
def test_camera_on_a_face_neither_fails_nor_sees_through_it() -> None:
    picture = Picture((0.0, 0.0, 1.5))
    assert picture.add((2.0, 0.0, 0.0), (4.0, 2.0, 3.0)) == COLUMNS * ROWS


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
    one.add(*near)
    one.add(*far)
    other.add(*far)
    other.add(*near)
    assert np.array_equal(one.nearness, other.nearness)
    assert np.array_equal(one.owner == 0, other.owner == 1)
    assert {0, 1} <= set(one.owner.ravel().tolist())


def test_span_holds_every_pixel_that_is_in_use() -> None:
    picture = Picture()
    picture.add((8.0, -1.0, 0.4), (2.0, 2.0, 1.5))
    picture.add((20.0, 3.0, 0.2), (4.0, 4.0, 3.0))
    rows = np.arange(ROWS)[None, :]
    inside = (rows >= picture.span[:, :1]) & (rows < picture.span[:, 1:])
    assert (inside | (picture.owner == NOTHING)).all()
    assert inside.sum() < 0.5 * inside.size


def test_height_in_the_image_is_focal_length_times_height_over_depth() -> None:
    for depth in (5.0, 8.0, 13.0, 21.0):
        picture = Picture((0.0, 0.0, 1.0))
        picture.add((depth + 0.5, 0.0, 0.0), (1.0, 2.0, 2.0))
        rows = int((picture.owner == 0).any(axis=0).sum())
        assert abs(rows - 40.0 * 2.0 / depth) <= 1.0


def test_covers_tells_what_is_drawn() -> None:
    picture = Picture(pitch=0.05)
    picture.add((9.0, 0.5, 0.7), (3.0, 2.0, 2.5))
    drawn = picture.owner == 0
    for column in range(COLUMNS):
        for row in range(ROWS):
            inside = covers(picture.forms, picture.lines, float(column), float(row))
            assert inside == drawn[column, row]


def test_covers_reaches_beyond_the_image() -> None:
    picture = Picture((0.0, 0.0, 1.0))
    # 20 m high and 10 m away: its top is 76 rows above the horizon.
    picture.add((10.5, 0.0, 0.0), (1.0, 2.0, 20.0))
    assert covers(picture.forms, picture.lines, 0.5 * COLUMNS, 0.5 * ROWS - 70.0)
    assert not covers(picture.forms, picture.lines, 0.5 * COLUMNS, 0.5 * ROWS - 80.0)
