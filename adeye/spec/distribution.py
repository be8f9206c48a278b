"""What a sweep declares about how a quantity is distributed."""

from __future__ import annotations

from typing import Annotated, Any, Final, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from adeye.spec.misplaced import misplaced
from adeye.spec.quantity import Many, Record, Text
from adeye.spec.scenario import Value

WEIGHT_SLACK: Final = 1e-9
"""How far the weights of a choice may sum up beside 1, so that thirds can be written."""


class _Sparse(Record):
    """A record that is written without the keys that it does not use."""

    @model_serializer(mode="wrap")
    def _leave_out_unused(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = write(self)
        return {name: value for name, value in content.items() if value is not None}


class Normal(_Sparse):
    """A normal distribution, cut off at the ends that are given."""

    mean: Value
    sd: Value
    min: Value | None = None
    max: Value | None = None


class Lognormal(_Sparse):
    """A quantity whose logarithm is normal, cut off at the ends that are given."""

    median: Value
    sigma: Annotated[float, Field(gt=0.0, le=10.0)]
    """Standard deviation of the logarithm."""
    min: Value | None = None
    max: Value | None = None


class Distribution(_Sparse):
    """How an axis of a sample is distributed: exactly one of the kinds."""

    uniform: Annotated[Many[Value], Field(min_length=2, max_length=2)] | None = None
    normal: Normal | None = None
    lognormal: Lognormal | None = None
    empirical: Text | None = None
    """File with a line of headers, relative to the ODD; each of its values is as likely."""
    column: Text | None = None
    unit: str | None = None
    """Unit of the numbers in the file; without it they are plain numbers."""
    choice: Annotated[dict[str, Annotated[float, Field(gt=0.0, le=1.0)]], Field(min_length=1)] | (
        None
    ) = None
    """Weight of each value; they sum up to 1."""

    @property
    def kind(self) -> str:
        """Which one it is."""
        return next(name for name in KINDS if getattr(self, name) is not None)

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = [name for name in KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            msg = f"give exactly one of {', '.join(KINDS)}, not {', '.join(given) or 'none'}"
            raise ValueError(msg)
        if (self.empirical is None) != (self.column is None):
            msg = "empirical and column go together"
            raise ValueError(msg)
        if self.unit is not None and self.empirical is None:
            raise misplaced([(("unit",), "unit belongs to empirical")])
        total = sum(self.choice.values()) if self.choice is not None else 1.0
        if abs(total - 1.0) > WEIGHT_SLACK:
            text = f"the weights sum up to {total:.10g}, not to 1"
            raise misplaced([(("choice",), text)])
        return self


KINDS: Final = ("uniform", "normal", "lognormal", "empirical", "choice")
"""Kinds of distribution, as a sweep writes them."""
