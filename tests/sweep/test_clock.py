"""Times and rates must fit the master clock; the message begins with the path of the first."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from adeye.errors import SpecError
from adeye.sweep.groups import check_rates, check_times, guilty_path

if TYPE_CHECKING:
    from adeye.spec.load import OddFiles

Load = Callable[..., "OddFiles"]


def test_shipped_files_fit_the_shipped_clock(load: Load) -> None:
    files = load()
    check_times(files.scenarios["cut_in"].spec, 0.05)
    check_rates(files.architectures["camera_radar"].spec, 0.05)


def test_horizon_that_is_no_whole_number_of_steps_is_told(load: Load) -> None:
    with pytest.raises(SpecError) as caught:
        check_times(load().scenarios["cut_in"].spec, 0.07)
    assert guilty_path(caught.value) == ("horizon",)


def test_rate_that_does_not_divide_the_clock_is_told(load: Load) -> None:
    with pytest.raises(SpecError) as caught:
        check_rates(load().architectures["camera_radar"].spec, 0.04)
    assert guilty_path(caught.value) == ("sensors", "front_camera", "rate")


def test_jitter_that_is_no_whole_number_of_steps_is_told(load: Load) -> None:
    spec = load().architectures["camera_radar"].spec
    radar = spec.sensors["front_radar"].model_copy(update={"jitter": 0.07})
    late = spec.model_copy(update={"sensors": {**spec.sensors, "front_radar": radar}})
    with pytest.raises(SpecError) as caught:
        check_rates(late, 0.05)
    assert guilty_path(caught.value) == ("sensors", "front_radar", "jitter")


def test_handover_that_is_no_whole_number_of_steps_is_told(load: Load) -> None:
    spec = load().architectures["camera_radar"].spec
    switch = spec.switch.model_copy(update={"handover": 0.07})
    with pytest.raises(SpecError) as caught:
        check_rates(spec.model_copy(update={"switch": switch}), 0.05)
    assert guilty_path(caught.value) == ("switch", "handover")
