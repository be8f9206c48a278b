"""What a grid map shows: its window, its cells, and rules that make one number of its layers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Final, Literal

from pydantic import Field

from adeye.kernel.stops import CONTACT, RULE_NAMES
from adeye.spec.document import Problem, finds
from adeye.spec.quantity import Duration, Length, Many, Number, Record

if TYPE_CHECKING:
    from adeye.spec.channels import StopRatings

Cost = Annotated[Number, Field(ge=0.0, le=1000.0)]

MAX_CELLS: Final = 1_000_000
"""Largest number of cells of a map."""

RuleLayer = Literal[
    "static", "time_to_occupancy", "left_of_ego", "lane", "parking", "rest_area", "sensors", "ego"
]
"""What a rule may look at. ``static``: height of a static object [m]; ``time_to_occupancy`` [s];
``left_of_ego``: from the left side of the ego to the cell's centre [m]; ``lane``, ``parking``,
``rest_area``: which of them, -1 for none; ``sensors``: how many cover it; ``ego``: 1 under the ego,
else 0."""


class CellRule(Record):
    """Changes the number of the cells in which a layer is within limits."""

    layer: RuleLayer
    above: Number | None = None
    """The layer is greater than this; None for no limit."""
    up_to: Number | None = None
    """The layer is at most this."""
    set: Cost | None = None
    add: Cost | None = None

    @finds
    def _does_one_thing(self) -> Iterator[Problem]:
        low, high = self.limits
        if (self.set is None) == (self.add is None):
            yield (), "a rule has either `set` or `add`"
        elif not low < high:
            yield ("above",), f"no value is above {low:g} and up to {high:g}"

    @property
    def limits(self) -> tuple[float, float]:
        """What the layer is greater than, and what it is at most."""
        low = -math.inf if self.above is None else float(self.above)
        return low, math.inf if self.up_to is None else float(self.up_to)


class CellCosts(Record):
    """One number for each cell: that of the worst ground in it, then the rules in their order."""

    default: Cost
    """Of a place that is not listed."""
    places: dict[str, Cost] = {}
    """By kind of place, the words of the ratings of a planned stop."""
    rules: Many[CellRule] = ()
    outside: Cost
    """Of whatever lies outside of the window."""
    blocked: Cost
    """Number from which a cell counts as blocked."""

    @finds
    def _places_are_known(self) -> Iterator[Problem]:
        unknown = next((name for name in self.places if name not in RULE_NAMES), None)
        if unknown is not None:
            text = f"{unknown!r} is no kind of place; allowed: {', '.join(RULE_NAMES)}"
            yield ("places", unknown), text

    def table(self) -> list[float]:
        """List the number of each kind of place, in the order of ``RULE_NAMES``."""
        return [float(self.places.get(name, self.default)) for name in RULE_NAMES]


_OCCUPIED: Final = ({"layer": "static", "above": 0.0}, {"layer": "time_to_occupancy", "up_to": 0.0})


def rating_costs(ratings: StopRatings) -> CellCosts:
    """Give the ratings of a planned stop as costs of cells; what is occupied counts as contact.

    Args:
        ratings: Of the safety channel.
    """
    rules = [CellRule.model_validate(item | {"set": CONTACT}) for item in _OCCUPIED]
    return CellCosts(
        default=CONTACT,
        places={name: float(getattr(ratings, name)) for name in RULE_NAMES},
        rules=tuple(rules),
        outside=CONTACT,
        blocked=CONTACT,
    )


_LANES: Final = ("slow_lane_in_sight", "slow_lane", "fast_lane", "curve")

ADEYE_COSTS: Final = CellCosts(
    default=50.0,
    places=dict.fromkeys(_LANES, 25.0) | {"refuge": 5.0},
    rules=(
        CellRule(layer="rest_area", above=-1.0, set=0.0),
        CellRule(layer="left_of_ego", above=0.0, add=40.0),
        CellRule(layer="static", above=0.2, set=100.0),
        CellRule(layer="time_to_occupancy", up_to=0.0, set=100.0),
    ),
    outside=99.0,
    blocked=90.0,
)
"""The costs of cells in AD-EYE: lane 25, parking bay 5, rest area 0, everything else 50, 40 more to
the left of the ego, so that the ground beside the road on that side is blocked, and 100 for an
obstacle."""


class GridSettings(Record):
    """Window and cells of a grid map, and how its cells are rated."""

    width: Length = Field(default=35.0, gt=0.0)
    """Across, half of it on each side of the ego [m]."""
    ahead: Length = Field(default=50.0, gt=0.0)
    behind: Length = Field(default=25.0, ge=0.0)
    cell: Length = Field(default=0.5, ge=0.05, le=5.0)
    """Edge of a cell [m]."""
    horizon: Duration = Field(default=16.0, ge=0.0, le=60.0)
    """How far ahead occupancy is predicted [s]; as far as a planned stop looks."""
    costs: CellCosts | None = None
    """None for the ratings of the architecture's own safety channel."""

    @finds
    def _fits(self) -> Iterator[Problem]:
        cells = math.ceil((self.ahead + self.behind) / self.cell) * math.ceil(
            self.width / self.cell
        )
        if cells > MAX_CELLS:
            text = f"the window has {cells} cells of this size, and at most {MAX_CELLS} are allowed"
            yield ("cell",), text
