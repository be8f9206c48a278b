"""What every fault has, whatever its model."""

from __future__ import annotations

from typing import Any, get_args

import pytest
from pydantic import ValidationError

from adeye.spec.fault import FAULT, MODELS
from adeye.spec.fault_base import Fault, Onset


def test_onset_keeps_the_one_way_that_it_is_given() -> None:
    onset = Onset.model_validate({"between": ["1 s", "2 s"]})
    assert (onset.at, onset.when, onset.between) == (None, None, (1.0, 2.0))


def test_port_and_id_are_parts_of_the_target() -> None:
    fault = FAULT.validate_python(
        {
            "id": "a",
            "target": "links.safety.channels.nominal",
            "model": "drop",
            "onset": {"at": "1 s"},
        }
    )
    assert (fault.port, fault.target_id) == ("links", "safety.channels.nominal")


@pytest.mark.parametrize("model", MODELS)
def test_every_model_says_what_it_is_and_what_it_is_for(model: type[Fault]) -> None:
    assert model.__doc__
    assert model.fits
    assert len(get_args(model.model_fields["model"].annotation)) == 1


@pytest.mark.parametrize(
    "onset", [{}, {"at": "1 s", "when": "time >= 1 s"}, {"between": ["2 s", "1 s"]}]
)
def test_onset_is_one_of_three_and_in_order(onset: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Onset.model_validate(onset)


def test_onset_is_read_in_si() -> None:
    assert Onset.model_validate({"between": ["500 ms", "2 s"]}).between == (0.5, 2.0)
