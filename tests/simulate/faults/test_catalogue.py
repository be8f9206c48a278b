"""Every model has its injector for every kind of target that it fits, and obeys the laws."""

import pytest

from adeye.simulate.faults.catalogue import INJECTORS
from adeye.spec.fault import MODELS, Fault, model_of


@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_an_injector_for_each_target_that_it_fits(model: type[Fault]) -> None:
    name = model_of(model)
    assert model.fits
    assert {(port, name) for port in model.fits} <= set(INJECTORS)


def test_every_injector_has_its_model() -> None:
    fits = {(port, model_of(model)) for model in MODELS for port in model.fits}
    assert set(INJECTORS) == fits
