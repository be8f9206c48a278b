"""Bins in which the coverage of an ODD is counted."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from adeye.spec.misplaced import Loc, misplaced
from adeye.spec.quantity import Length, Many, Number, RainRate, Record, Speed


class CoverageBins(Record):
    """Edges of the bins of an attribute, in ascending order; without them there are default ones.

    A bin has its lower edge and not its upper one; the last one has both.
    """

    ego_speed: Annotated[Many[Speed], Field(min_length=2)] | None = None
    rain: Annotated[Many[RainRate], Field(min_length=2)] | None = None
    fog_visibility: Annotated[Many[Length], Field(min_length=2)] | None = None
    friction: Annotated[Many[Number], Field(min_length=2)] | None = None

    @model_serializer(mode="wrap")
    def _leave_out_unused(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = write(self)
        return {name: edges for name, edges in content.items() if edges is not None}

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        found: list[tuple[Loc, str]] = []
        for name in type(self).model_fields:
            edges = getattr(self, name) or ()
            found += [
                ((name, at + 1), "edges of bins must ascend, and this is not above the one before")
                for at in range(len(edges) - 1)
                if not edges[at] < edges[at + 1]
            ]
        if found:
            raise misplaced(found)
        return self
