import math

import pytest
from pydantic import ValidationError

from adeye.judge.verdict import Verdict
from adeye.report.model.part import Binding, Label, Margin, Part, RunVerdict


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_margin_is_finite(value: float) -> None:
    with pytest.raises(ValidationError, match="finite"):
        Margin(value=value, unit="m")


def test_misspelt_field_is_refused() -> None:
    with pytest.raises(ValidationError, match="Extra inputs"):
        Label.model_validate({"label": "a", "value": "b", "vlaue": "c"})


@pytest.mark.parametrize("value", [True, 1.5, "silent", None])
def test_binding_keeps_the_kind_of_its_value(value: object) -> None:
    binding = Binding.model_validate({"predicate": "p", "signal": "s", "value": value})
    again = Binding.model_validate_json(binding.model_dump_json())
    assert again.value == value
    assert type(again.value) is type(value)


def test_parts_compare_by_content() -> None:
    one, other = (RunVerdict(fsr="F", verdict=Verdict.PASS) for _ in range(2))
    assert one == other
    assert one is not other
    assert isinstance(one, Part)
