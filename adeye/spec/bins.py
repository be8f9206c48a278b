"""Bins in which the coverage of an ODD is counted."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from adeye.spec.misplaced import Loc, misplaced, repeated
from adeye.spec.quantity import Angle, Length, Many, Number, RainRate, Record, Speed
from adeye.spec.scenario import ActorKind


class CoverageBins(Record):
    """Edges of the bins of an attribute, in ascending order; without them there are default ones.

    A bin has its lower edge and not its upper one; the last one has both. Radius, sun and actors
    are counted only where edges or kinds stand here, or the attributes of the ODD limit them.
    """

    ego_speed: Annotated[Many[Speed], Field(min_length=2)] | None = None
    rain: Annotated[Many[RainRate], Field(min_length=2)] | None = None
    fog_visibility: Annotated[Many[Length], Field(min_length=2)] | None = None
    friction: Annotated[Many[Number], Field(min_length=2)] | None = None
    radius: Annotated[Many[Length], Field(min_length=2)] | None = None
    """Of a curve, to the left or to the right; a straight road is a bin of its own."""
    sun_elevation: Annotated[Many[Angle], Field(min_length=2)] | None = None
    """Of a sun above the horizon; no sun is a bin of its own."""
    actors: Annotated[Many[ActorKind], Field(min_length=1)] | None = None
    """Kinds, each a bin; a situation has those of all its actors."""

    @model_serializer(mode="wrap")
    def _leave_out_unused(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = write(self)
        return {name: edges for name, edges in content.items() if edges is not None}

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        kinds = self.actors or ()
        found: list[tuple[Loc, str]] = [
            (("actors", at), f"{kinds[at]!r} occurs twice") for at in repeated(kinds)
        ]
        for name in type(self).model_fields:
            edges = () if name == "actors" else getattr(self, name) or ()
            found += [
                ((name, at + 1), "edges of bins must ascend, and this is not above the one before")
                for at in range(len(edges) - 1)
                if not edges[at] < edges[at + 1]
            ]
        if found:
            raise misplaced(found)
        return self
