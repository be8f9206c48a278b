"""What a section shares: the records of its variant, made once for all that have it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from adeye.errors import SweepError
from adeye.sweep.expand import expand

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]

RANGE = "architecture.sensors.front_camera.range"
ONE = ["architectures/camera_radar.yaml"]


def test_files_that_nothing_is_written_into_are_shared_as_they_are(load: Load) -> None:
    files = load()
    expansion = expand(files)
    for section in expansion.sections:
        shared = expansion.shared(section)
        assert shared.scenario is files.scenarios["cut_in"].spec
        assert shared.architecture is section.group.architecture.spec


def test_each_section_has_its_variant_and_gets_it_again(load: Load) -> None:
    expansion = expand(load({"parameters": {RANGE: ["90 m", "110 m"]}}, architectures=ONE))
    made = [expansion.shared(section).architecture for section in expansion.sections]
    assert [item.sensors["front_camera"].range for item in made] == [90.0, 110.0]  # type: ignore[union-attr]
    assert expansion.shared(expansion.sections[0]).architecture is made[0]


def test_parameters_are_the_defaults_with_what_the_use_fixes(load: Load) -> None:
    expansion = expand(load(use={"parameters": {"rain": "5 mm/h"}}))
    parameters = expansion.shared(expansion.sections[0]).parameters
    assert parameters["rain"] == 5e-3 / 3600
    assert list(parameters) == list(expansion.files.scenarios["cut_in"].spec.parameters)


def test_value_that_is_not_valid_in_the_file_is_refused_at_its_axis(load: Load) -> None:
    expansion = expand(load({"parameters": {RANGE: ["90 m", "-1 m"]}}, architectures=ONE))
    expansion.shared(expansion.sections[0])
    with pytest.raises(SweepError, match=r"example\.yaml:\d+:\d+: with sensors\.front_camera"):
        expansion.shared(expansion.sections[1])
