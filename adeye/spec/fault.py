"""A fault: what fails, how, from when and for how long."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from adeye.spec.quantity import TARGET, Condition, Duration, Identifier, Record

Target = Annotated[str, StringConstraints(pattern=TARGET)]


class Onset(Record):
    """When the fault begins: at a time, or when a condition over the scene first holds."""

    at: Annotated[Duration, Field(ge=0.0)] | None = None
    when: Condition | None = None

    @model_validator(mode="after")
    def _one_onset(self) -> Self:
        if (self.at is None) == (self.when is None):
            msg = "give either at or when"
            raise ValueError(msg)
        return self


class Fault(Record):
    """A scripted fault of a sensor (``drop_out``) or of a channel (``silent``)."""

    id: Identifier
    target: Target
    model: Literal["drop_out", "silent"]
    onset: Onset
    duration: Annotated[Duration, Field(ge=0.0)] | None = None
    """How long it lasts [s]; without it, to the end of the run."""
    text: str = ""

    @model_validator(mode="after")
    def _model_fits_target(self) -> Self:
        kind = self.target.split(".")[0]
        fits = {"drop_out": "sensors", "silent": "channels"}[self.model]
        if kind != fits:
            msg = f"{self.model} is a fault of {fits}, and {self.target} is not one of them"
            raise ValueError(msg)
        return self

    @property
    def target_id(self) -> str:
        """The id of the sensor or channel that fails."""
        return self.target.split(".", 1)[1]

    def executable(self) -> dict[str, object]:
        """The part that a run depends on."""
        return self.model_dump(mode="json", exclude={"text"})
