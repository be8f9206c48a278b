"""Every model has its injector for every kind of target that it fits, and obeys the laws."""

from typing import get_args

import pytest

from adeye.faults.catalogue import INJECTORS
from adeye.spec.fault import MODELS, Fault


@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_an_injector_for_each_target_that_it_fits(model: type[Fault]) -> None:
    name = get_args(model.model_fields["model"].annotation)[0]
    assert model.fits
    assert {(port, name) for port in model.fits} <= set(INJECTORS)


def test_every_injector_has_its_model() -> None:
    fits = {
        (port, get_args(model.model_fields["model"].annotation)[0])
        for model in MODELS
        for port in model.fits
    }
    assert set(INJECTORS) == fits
