"""Every model has its injector for every kind of target that it fits, and obeys the laws."""

from adeye.simulate.faults.schedule import INJECTORS
from adeye.spec.fault import MODELS, model_of


def test_every_model_has_an_injector_for_each_target_that_it_fits_and_none_is_more() -> None:
    assert all(model.fits for model in MODELS)
    fits = {(port, model_of(model)) for model in MODELS for port in model.fits}
    assert set(INJECTORS) == fits
