"""Every kind has a class number, a plausible size and a reflectivity."""

from typing import get_args

import pytest

from adeye.signals import OBJECT_CLASSES
from adeye.simulate.world.objects import (
    DEFAULT_REFLECTIVITY,
    DEFAULT_SIZES,
    class_index,
    class_indices,
)
from adeye.spec.scenario import ActorKind, ObjectKind


def test_every_actor_kind_has_a_default_size() -> None:
    assert set(DEFAULT_SIZES) == set(get_args(ActorKind))


@pytest.mark.parametrize("kind", DEFAULT_SIZES)
def test_size_keeps_the_legal_limits_of_width_and_height(kind: str) -> None:
    length, width, height = DEFAULT_SIZES[kind]
    assert 0.0 < length <= 12.0
    assert 0.0 < width <= 2.55
    assert 0.0 < height <= 4.0


def test_every_kind_has_a_reflectivity_between_nothing_and_everything() -> None:
    kinds = {*get_args(ActorKind), *get_args(ObjectKind)}
    assert set(DEFAULT_REFLECTIVITY) == kinds
    assert all(0.0 < share <= 1.0 for share in DEFAULT_REFLECTIVITY.values())


def test_every_kind_of_actor_and_object_has_a_class() -> None:
    kinds = (*get_args(ActorKind), *get_args(ObjectKind))
    assert [OBJECT_CLASSES[number] for number in class_indices(kinds)] == list(kinds)


def test_an_unknown_kind_has_no_class() -> None:
    with pytest.raises(ValueError, match="not in tuple"):
        class_index("hovercraft")
