import numpy as np
import pytest

from adeye.signals import parameter_record, spec_columns


def test_parameter_record_repeats_scalars_and_keeps_columns() -> None:
    packed = parameter_record({"gain": 2, "range": np.array([80.0, 120.0])})
    assert packed["gain"].tolist() == [2.0, 2.0]
    assert packed["range"].tolist() == [80.0, 120.0]
    assert packed.dtype.names == ("gain", "range")


def test_parameter_record_of_scalars_is_one_run() -> None:
    assert parameter_record({"gain": 2}).shape == (1,)


def test_parameter_record_of_unequal_columns_is_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        parameter_record({"a": np.zeros(2), "b": np.zeros(3)})


def test_columns_of_specs_follow_the_runs_and_shared_specs_are_read_once() -> None:
    near, far = {"range": 80.0, "rate": 10}, {"range": 120.0, "rate": 20}
    read: list[float] = []

    def numbers(spec: dict[str, float]) -> dict[str, float]:
        read.append(spec["range"])
        return spec

    found = spec_columns([near, far, near, near, far], numbers)
    assert found["range"].tolist() == [80.0, 120.0, 80.0, 80.0, 120.0]
    assert found["rate"].tolist() == [10.0, 20.0, 10.0, 10.0, 20.0]
    assert found["rate"].dtype == np.float64
    assert read == [80.0, 120.0]


def test_equal_specs_that_are_two_objects_are_two_rows() -> None:
    found = spec_columns([{"range": 80.0}, {"range": 80.0}], lambda spec: spec)
    assert found["range"].tolist() == [80.0, 80.0]
