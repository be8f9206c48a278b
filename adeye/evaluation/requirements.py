"""FSRs checked against a plan: names and metrics are known, windows lie within the tails."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from adeye.errors import InputError, InputErrors, SourceLocation, SpecError, suggest
from adeye.evaluation.bounds import Bound, bound_of, check_side
from adeye.evaluation.measured import measured, nested_antecedents, reads_odd
from adeye.evaluation.metrics import METRICS
from adeye.evaluation.source import is_decision, plan_dictionary
from adeye.evaluation.stl.check import TRUTH_LABELS
from adeye.evaluation.stl.constancy import first_constant
from adeye.evaluation.stl.formula import Formula, parse_formula
from adeye.evaluation.stl.lexer import KEYWORDS
from adeye.evaluation.stl.syntax import (
    PREDICATES,
    Node,
    Temporal,
    Until,
    Window,
    children,
    names_in,
    needed_time,
    read_back,
    window_of,
    window_rows,
)
from adeye.identity import digest
from adeye.signals import SignalType

if TYPE_CHECKING:
    from adeye.spec.architecture import Architecture
    from adeye.spec.concept import Concept, Requirement
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario

Loc = tuple[str | int, ...]
Locate = Callable[[Loc], SourceLocation]
Dictionary = Mapping[str, SignalType]

JUDGE_VERSION = 3
"""Raised whenever a verdict or margin can change although formula and trace do not."""

_SLACK_S = 1e-9


@dataclass(frozen=True)
class JudgedPlan:
    """What the FSRs of a concept will be judged on.

    Attributes:
        scenarios: By the id under which the ODD uses them.
        architectures: By their own id.
        gate: Architectures that decide the exit code; an FSR must be applicable to them.
        step: Master clock [s].
        faults: Fault ids of the ODD.
        monitors: Monitor ids that the channels of an architecture declare, by architecture id.
        attributes: Attributes of the ODD, for FSRs about leaving it.
    """

    scenarios: Mapping[str, LogicalScenario]
    architectures: Mapping[str, Architecture]
    gate: Sequence[str]
    step: float
    faults: Sequence[str] = ()
    monitors: Mapping[str, Sequence[str]] = field(default_factory=dict)
    attributes: Attributes | None = None

    def dictionary(self, scenario: str, architecture: str) -> dict[str, SignalType]:
        """List what a formula may name in the runs of a scenario and an architecture."""
        return plan_dictionary(
            self.scenarios[scenario],
            self.architectures[architecture],
            self.faults,
            self.monitors.get(architecture, ()),
        )


@dataclass(frozen=True)
class CheckedRequirement:
    """An FSR that can be judged.

    Attributes:
        requirement: What the concept says.
        digest: Identity of what its verdict depends on beside the trace.
        formula: Its formula, parsed; None if it is a bound.
        bound: Its bound on a metric; None if it is a formula.
        not_applicable: Why it cannot be judged, by architecture id.
    """

    requirement: Requirement
    digest: str
    formula: Formula | None = None
    bound: Bound | None = None
    not_applicable: Mapping[str, str] = field(default_factory=dict)

    def concerns(self, scenario: str, *, is_inside: bool) -> bool:
        """Tell whether it is judged in a scenario, on runs inside or outside the ODD."""
        requirement = self.requirement
        if requirement.scenarios and scenario not in requirement.scenarios:
            return False
        wanted = {"inside": (True,), "outside": (False,), "everywhere": (True, False)}
        return is_inside in wanted[requirement.applies]


CheckedRequirements = tuple[CheckedRequirement, ...]
"""The FSRs of a concept, in its order."""


def requirement_digest(requirement: Requirement, attributes: Attributes | None = None) -> str:
    """Identify everything that a verdict depends on beside the trace, however it is spelt.

    Args:
        requirement: What the concept says.
        attributes: Attributes of the ODD; they count where a formula names ``in_odd``.

    Raises:
        ExpressionError: The formula cannot be read.
    """
    preimage: dict[str, Any] = {"requirement": measured(requirement), "judge": JUDGE_VERSION}
    if nested_antecedents(requirement.formula, requirement.constants):
        # Of these a verdict tells what no verdict told before.
        preimage["nested"] = 1
    if requirement.bound is not None and requirement.bound.metric in METRICS:
        preimage["metric"] = METRICS[requirement.bound.metric].uid
    if attributes is not None and reads_odd(requirement):
        preimage["attributes"] = attributes.model_dump(mode="json")
    return digest(preimage)


def compile_requirement(
    requirement: Requirement,
    where: SourceLocation | None = None,
    attributes: Attributes | None = None,
) -> CheckedRequirement:
    """Parse the formula or find the metric of an FSR, without a plan to check it against.

    Args:
        requirement: What the concept says.
        where: Place of its formula or bound in the concept's file.
        attributes: Attributes of the ODD.

    Raises:
        ExpressionError: The formula cannot be read.
        SpecError: There is no such metric, or the bound is not finite.
    """
    formula = bound = None
    if requirement.formula is not None:
        formula = parse_formula(requirement.formula, where, requirement.constants)
    else:
        bound = bound_of(requirement, where)
    identity = requirement_digest(requirement, attributes)
    return CheckedRequirement(requirement, identity, formula, bound)


def check_requirements(
    concept: Concept, plan: JudgedPlan, locate: Locate | None = None
) -> CheckedRequirements:
    """Check every FSR of a concept against what it will be judged on, before anything runs.

    Args:
        concept: The functional safety concept.
        plan: Scenarios, architectures and clock.
        locate: Finds file, line and column of a place in the concept.

    Returns:
        The FSRs in the concept's order, ready to judge with.

    Raises:
        InputError: A name, metric or scenario does not exist, a dimension does not fit, a part of
            a formula does not depend on its signals, a window exceeds a tail, or an architecture in
            the gate lacks a signal. Several errors come as ``InputErrors``.
    """
    checked: list[CheckedRequirement] = []
    errors: list[InputError] = []
    for number, requirement in enumerate(concept.requirements):
        check = _Check(requirement, number, plan, locate)
        try:
            checked.append(check.run())
        except InputError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise InputErrors(errors)
    return tuple(checked)


def _place_of(requirement: Requirement) -> tuple[str, ...]:
    """Name the key that says what is wrong, if anything is."""
    bound = requirement.bound
    if bound is None:
        return ("formula",)
    if bound.metric not in METRICS:
        return ("bound", "metric")
    return ("bound", "at_most" if bound.at_least is None else "at_least")


class _Check:
    """One FSR against the plan."""

    def __init__(
        self, requirement: Requirement, number: int, plan: JudgedPlan, locate: Locate | None
    ) -> None:
        self._requirement = requirement
        self._number = number
        self._plan = plan
        self._locate = locate

    def run(self) -> CheckedRequirement:
        scenarios = self._scenarios()
        self._check_parameter_names(scenarios)
        place = _place_of(self._requirement)
        compiled = compile_requirement(
            self._requirement, self._where(*place), self._plan.attributes
        )
        if compiled.bound is not None:
            check_side(self._requirement, compiled.bound, self._where(*place))
        if compiled.formula is None:
            return compiled
        self._check_names(compiled.formula, scenarios)
        self._check_truth(compiled.formula)
        self._check_parameters(compiled.formula, scenarios)
        self._check_windows(compiled.formula, scenarios)
        missing = self._not_applicable(compiled.formula, scenarios)
        return CheckedRequirement(
            compiled.requirement, compiled.digest, compiled.formula, not_applicable=missing
        )

    def _where(self, *loc: str | int) -> SourceLocation | None:
        if self._locate is None:
            return None
        return self._locate(("requirements", self._number, *loc))

    def _refuse(self, message: str, remedy: str, *loc: str | int) -> SpecError:
        text = f"requirement {self._requirement.id}: {message}"
        return SpecError(text, where=self._where(*(loc or ("formula",))), remedy=remedy)

    def _scenarios(self) -> tuple[str, ...]:
        for index, name in enumerate(self._requirement.scenarios):
            if name not in self._plan.scenarios:
                raise self._refuse(
                    f"the ODD has no scenario {name!r}",
                    suggest(name, self._plan.scenarios),
                    "scenarios",
                    index,
                )
        return self._requirement.scenarios or tuple(self._plan.scenarios)

    def _check_names(self, formula: Formula, scenarios: Sequence[str]) -> None:
        known = {name: self._union(name) for name in scenarios}
        anywhere = {name for dictionary in known.values() for name in dictionary}
        for name in formula.names:
            if name not in anywhere:
                words = sorted(anywhere) + sorted(self._requirement.parameters)
                near = difflib.get_close_matches(name, words, n=1)
                raise self._refuse(
                    f"no scenario and architecture has a signal {name!r}",
                    f"Did you mean {near[0]!r}?" if near else "See `adeye signals`.",
                )
            lacking = [scenario for scenario in scenarios if name not in known[scenario]]
            if lacking:
                having = [scenario for scenario in scenarios if name in known[scenario]]
                raise self._refuse(
                    f"scenario {lacking[0]!r} has no signal {name!r}",
                    f"Judge it where it exists: scenarios: [{', '.join(having)}].",
                )
        for dictionary in known.values():
            formula.check(dictionary)

    def _check_truth(self, formula: Formula) -> None:
        found = first_constant(formula.root)
        if found is not None:
            part, is_held = found
            raise self._refuse(
                f"'{formula.quote(part)}' (formula, character {part.span[0] + 1}) "
                f"{'always' if is_held else 'never'} holds, whatever its signals are",
                "Write a limit or condition that depends on them, or leave the part out.",
            )

    def _check_parameter_names(self, scenarios: Sequence[str]) -> None:
        for name in self._requirement.parameters:
            if name in KEYWORDS or name in TRUTH_LABELS:
                raise self._refuse_parameter(name, "is a word of the language")
            if any(name in self._union(scenario) for scenario in scenarios):
                raise self._refuse_parameter(name, "is the name of a signal, too")

    def _check_parameters(self, formula: Formula, scenarios: Sequence[str]) -> None:
        named = {name for name, _ in formula.parameters}
        words = {word for name in formula.names for word in self._labels(name, scenarios)}
        for name in self._requirement.parameters:
            if name in words:
                raise self._refuse_parameter(name, "is a value of a signal, too")
            if name not in named:
                text = f"the formula does not name parameter {name!r}"
                raise self._refuse(text, "Remove it or name it.", "parameters", name)

    def _refuse_parameter(self, name: str, reason: str) -> SpecError:
        text = f"parameter {name!r} {reason}"
        return self._refuse(text, "Give it another name.", "parameters", name)

    def _labels(self, signal: str, scenarios: Sequence[str]) -> Iterator[str]:
        """List the words that a signal can be compared with."""
        for scenario in scenarios:
            entry = self._union(scenario)[signal]
            yield from entry.labels

    def _union(self, scenario: str) -> dict[str, SignalType]:
        union: dict[str, SignalType] = {}
        for architecture in self._plan.architectures:
            union |= self._plan.dictionary(scenario, architecture)
        return union

    def _not_applicable(self, formula: Formula, scenarios: Sequence[str]) -> Mapping[str, str]:
        reasons: dict[str, str] = {}
        for architecture in self._plan.architectures:
            dictionaries = [self._plan.dictionary(name, architecture) for name in scenarios]
            lacking = [
                name
                for name in formula.names
                if any(name not in dictionary for dictionary in dictionaries)
            ]
            if lacking:
                reasons[architecture] = f"it has no signal {', '.join(lacking)}"
        for architecture in self._plan.gate:
            if architecture in reasons:
                raise self._refuse(
                    f"architecture {architecture!r} is in the gate, but {reasons[architecture]}",
                    "Take it out of the gate, or write the FSR over signals that it has.",
                )
        return reasons

    def _check_windows(self, formula: Formula, scenarios: Sequence[str]) -> None:
        step = self._plan.step
        for window in _windows(formula.root):
            window_rows(window, step)
        if not math.isfinite(formula.reach_s):
            raise self._refuse(
                "an operator below another one has no window, so that no trace is long enough",
                "Give it a window, for example eventually[0 s, 2 s].",
            )
        for name in scenarios:
            scenario = self._plan.scenarios[name]
            last = needed_time(formula.root, scenario.horizon)
            # Nothing is decided from the last row, so decisions must be read before it.
            last = max(last, last_decision(formula.root, scenario.horizon) + step)
            needed = last - scenario.horizon
            if needed > scenario.tail + _SLACK_S:
                raise self._refuse(
                    f"it looks {needed:g} s beyond the horizon, and scenario {name!r} has a tail "
                    f"of {scenario.tail:g} s",
                    f"Give the scenario a tail of {needed:g} s or shorten the window.",
                )


def last_decision(node: Node, horizon_s: float) -> float:
    """Give the last time at which a formula of finite reach reads what was decided [s].

    Args:
        node: The formula's root, evaluated at time 0.
        horizon_s: Last time at which an obligation of an outermost operator may start [s].

    Returns:
        The time; minus infinity if the formula reads scenes only.
    """
    if isinstance(node, PREDICATES):
        return 0.0 if any(is_decision(name) for name in names_in(node)) else -math.inf
    reads = (last_decision(child, horizon_s) - back for child, back in read_back(node))
    inner = max(reads, default=-math.inf)
    if isinstance(node, Temporal | Until):
        return inner + (horizon_s if node.window is None else node.window.last_s)
    return inner


def _windows(node: Node) -> Iterator[Window]:
    window = window_of(node)
    if window is not None:
        yield window
    for child in children(node):
        yield from _windows(child)
