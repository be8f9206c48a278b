"""Evaluate the formulas of a batch of test cases: one column over the runs each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from adeye.errors import ExpressionError, SpecError
from adeye.spec.expression import Expression
from adeye.spec.scenario import Actor, Event, LogicalScenario

if TYPE_CHECKING:
    from adeye.signals import Floats, Ints
    from adeye.spec.architecture import Architecture

Pick = Callable[[LogicalScenario], Expression | None]

BELOW_ZERO: Final = -1e-12
"""A limit that zero is above, and rounding errors of zero too."""


class Situation(Protocol):
    """What the world needs of a test case."""

    @property
    def scenario(self) -> LogicalScenario:
        """The scenario, overrides applied."""

    @property
    def parameters(self) -> Mapping[str, float]:
        """Resolved scenario parameters in SI."""

    @property
    def architecture(self) -> Architecture:
        """The architecture, whose vehicle is the ego."""

    @property
    def step(self) -> float:
        """Master clock [s]."""

    @property
    def stream_seed(self) -> int:
        """Seed of the random streams."""


@dataclass(frozen=True)
class Formulas:
    """The scenarios of a batch with the runs that they stand for and their parameter columns.

    Attributes:
        runs: Number of runs B.
        parts: Scenario, its rows in the batch, its parameters as columns over these rows.
    """

    runs: int
    parts: tuple[tuple[LogicalScenario, Ints, dict[str, Floats]], ...]

    @classmethod
    def of(cls, cases: Sequence[Situation]) -> Formulas:
        """Sort the test cases by their scenario record; overrides make records of their own.

        Raises:
            SpecError: The scenarios differ in structure, so they cannot run in one batch.
        """
        rows: dict[int, list[int]] = {}
        for run, case in enumerate(cases):
            rows.setdefault(id(case.scenario), []).append(run)
        parts = []
        for members in rows.values():
            scenario = cases[members[0]].scenario
            names = cases[members[0]].parameters
            columns = {
                name: np.array([cases[run].parameters[name] for run in members], dtype=np.float64)
                for name in names
            }
            parts.append((scenario, np.array(members, dtype=np.int64), columns))
        first = structure(parts[0][0])
        if any(structure(scenario) != first for scenario, _, _ in parts):
            raise SpecError(
                "test cases whose scenarios differ in structure cannot run in one batch",
                remedy="Group them by scenario, actors and storyboard.",
            )
        return cls(len(cases), tuple(parts))

    @property
    def scenario(self) -> LogicalScenario:
        """The scenario of the first part; the others have its structure."""
        return self.parts[0][0]

    def values(self, what: str, pick: Pick, default: float = np.nan) -> Floats:
        """Evaluate one formula of every scenario over its runs.

        Args:
            what: Name of the quantity, for the message.
            pick: Takes the formula from a scenario, None for the default.
            default: Value where there is no formula.

        Returns:
            (B,) in SI.

        Raises:
            SpecError: A name is unknown, or a value is not finite.
        """
        column = np.full(self.runs, default)
        # At many places scenarios are many, but most of what they say is the same.
        sorted_out: dict[Expression, list[int]] = {}
        for number, (scenario, _, _) in enumerate(self.parts):
            expression = pick(scenario)
            if expression is not None:
                sorted_out.setdefault(expression, []).append(number)
        for expression, numbers in sorted_out.items():
            parts = [self.parts[number] for number in numbers]
            runs = np.concatenate([rows for _, rows, _ in parts])
            names = () if expression.is_constant else parts[0][2]
            columns = {name: np.concatenate([own[name] for _, _, own in parts]) for name in names}
            try:
                column[runs] = expression.evaluate(columns)
            except ExpressionError as error:
                raise SpecError(f"{what}: {error.message}", remedy=error.remedy) from error
        return column

    def limited(
        self, what: str, pick: Pick, *, above: float, default: float = np.nan, unit: str = "m"
    ) -> Floats:
        """Evaluate one formula that must stay above a limit.

        Args:
            what: Name of the quantity, for the message.
            pick: Takes the formula from a scenario, None for the default.
            above: Values must be greater.
            default: Value where there is no formula.
            unit: SI unit, for the message.

        Raises:
            SpecError: A value is not finite or not above the limit.
        """
        column = self.values(what, pick, default)
        bad = column <= above
        if bad.any():
            raise SpecError(
                f"{what}: {column[bad][0]:g} {unit} is not above {above:g} {unit}",
                remedy="Narrow the range of the parameters that it is computed from.",
            )
        return column


def structure(scenario: LogicalScenario) -> tuple[object, ...]:
    """What must be equal in the scenarios of one batch; values and conditions may differ."""
    return (
        scenario.world.road.kind,
        # Places of a map are values: their roads differ in numbers only.
        0 if scenario.world.road.kind == "imported" else scenario.world.road.lanes,
        scenario.world.road.opposite_lanes,
        tuple(end.side for end in scenario.world.road.lane_ends.values()),
        tuple((name, bay.kind) for name, bay in scenario.world.road.bays.items()),
        scenario.ego.goal is None,
        tuple((name, item.kind) for name, item in scenario.world.objects.items()),
        tuple((name, *_actor_structure(actor)) for name, actor in scenario.actors.items()),
        tuple((name, *_event_structure(event)) for name, event in scenario.storyboard.items()),
        tuple(scenario.parameters),
        scenario.acting_order,
        scenario.realised,
        scenario.horizon,
        scenario.tail,
    )


def _actor_structure(actor: Actor) -> tuple[object, ...]:
    reactive = actor.reactive and actor.reactive.lane_changes
    start = actor.start
    is_driven = actor.driver is not None
    return actor.kind, reactive, start.ahead_of, start.lane is None, start.off_road, is_driven


def _event_structure(event: Event) -> tuple[object, ...]:
    change = event.lane_change
    shape = change and (change.shape, change.to_lane is None)
    relative = event.speed and event.speed.relative_to
    return event.actor, type(event.action).__name__, shape, relative
