"""FSRs checked against a plan: names and metrics are known, windows lie within the tails."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np

from adeye.errors import (
    ExpressionError,
    SourceLocation,
    SpecError,
    Together,
    suggest,
)
from adeye.identity import digest
from adeye.judge.first_row import Rows, asked_of_first_row
from adeye.judge.metrics import METRICS, MetricDefinition
from adeye.judge.short_runs import uncounted
from adeye.judge.stl import syntax
from adeye.judge.stl.counterexample import Runs, first_constant
from adeye.judge.stl.formula import (
    TRUTH_LABELS,
    Formula,
    parse_formula,
    read_formula,
    unit_exponents,
)
from adeye.judge.stl.parser import KEYWORDS
from adeye.judge.trace_signals import is_decision, plan_dictionary
from adeye.kernel.relation import differences
from adeye.signals import SignalType
from adeye.units import UNITS, Dimension, read_quantity, shown

if TYPE_CHECKING:
    from adeye.signals import Bools, Floats
    from adeye.spec.architecture import Architecture
    from adeye.spec.concept import Concept, Requirement
    from adeye.spec.odd import Attributes
    from adeye.spec.scenario import LogicalScenario

T = TypeVar("T")
Played: TypeAlias = "tuple[str, LogicalScenario, bool]"
"""A scenario as it is executed: its id, what it is then, and whether that is inside the ODD."""

# --- What an FSR measures, apart from how it is spelt: the part of its identity that a user
# writes.


def measured(requirement: Requirement) -> dict[str, Any]:
    """Give what an FSR asks for and where, in the one way that does not tell how it is spelt.

    Formula and bound are in SI with the values of their parameters, see ``stl.canonical``; the
    order of its scenarios does not matter.

    Raises:
        ExpressionError: The formula cannot be read.
    """
    part: dict[str, Any] = requirement.judged()
    part.pop("parameters", None)
    part["scenarios"] = sorted(set(requirement.scenarios))
    if requirement.formula is not None:
        text, _, _, is_of_the_past = _formula(requirement)
        part["formula"] = text
        if is_of_the_past:
            # Verdicts from before rows at which nothing lay in the window counted are others.
            part["told"] = 1
    elif requirement.bound is not None:
        limit = requirement.bound.limit
        value = requirement.constants[limit][0] if isinstance(limit, str) else limit
        # A whole number may be written without a fraction, and is no other bound for it.
        part["bound"] = {
            **part["bound"],
            requirement.bound.side: None if value is None else float(value),
        }
        part["bound"].pop("unusual_side", None)
    return part


def reads_odd(requirement: Requirement) -> bool:
    """Tell whether a verdict depends on the attributes of the ODD: the formula names ``in_odd``."""
    return requirement.formula is not None and "in_odd" in _formula(requirement)[1]


def _formula(requirement: Requirement) -> tuple[str, tuple[str, ...], tuple[str, ...], bool]:
    constants = tuple(sorted(requirement.constants.items()))
    return read_formula(requirement.formula or "", constants)


# --- A bound on a metric: what an FSR without a formula asks for ----------------------------------


@dataclass(frozen=True, slots=True)
class Bound:
    """A bound on a metric.

    Attributes:
        column: Id of the metric.
        limit: In the metric's unit.
        is_lower: Whether the metric has to be at least, not at most, the limit.
    """

    column: str
    limit: float
    is_lower: bool

    @property
    def metric(self) -> MetricDefinition:
        """The metric, as registered in this process."""
        return METRICS[self.column]

    def margins(self, values: Floats, is_free: Bools) -> tuple[Floats, Bools]:
        """Give the distances (R,) to the limit in the metric's unit, negative when violated.

        What differs from the limit by rounding only lies on it, with the margin 0; a conflict that
        is farther from the limit than the cap is none.

        Args:
            values: (R,) of the metric.
            is_free: (R,) whether there was no conflict, so that the value is not read.

        Returns:
            The distances, and whether there was no conflict, or one beyond the cap.
        """
        measured = np.where(is_free, 0.0, values)
        ends = (measured, self.limit) if self.is_lower else (self.limit, measured)
        margin, cap = differences(*ends), self.metric.cap
        if cap is None:
            return margin, is_free
        is_free = is_free | (measured - self.limit > cap)
        return np.where(is_free, cap if self.is_lower else -cap, margin), is_free

    @property
    def text(self) -> str:
        """Write it as a predicate."""
        relation = ">=" if self.is_lower else "<="
        unit = "" if self.metric.unit == "1" else f" {self.metric.unit}"
        return f"{self.column} {relation} {self.limit:g}{unit}"


def _refusal(
    requirement: Requirement, what: str, where: SourceLocation | None, remedy: str
) -> SpecError:
    return SpecError(f"requirement {requirement.id}: {what}", where=where, remedy=remedy)


def bound_of(requirement: Requirement, where: SourceLocation | None = None) -> Bound:
    """Find the metric of an FSR with a bound.

    Args:
        requirement: What the concept says.
        where: Place of the bound in the concept's file.

    Raises:
        SpecError: There is no such metric, the bound is not finite, or it was written with a unit
            of something else than the metric's.
    """
    written = requirement.bound
    name = "" if written is None else written.metric
    if written is None or name not in METRICS:
        what = f"there is no metric {name!r}"
        raise _refusal(requirement, what, where, suggest(name, METRICS))
    limit, text = written.limit, written.written
    if isinstance(limit, str):
        # A parameter without a unit is in the metric's own, like a plain number.
        value = requirement.parameters[limit]
        limit, text = requirement.constants[limit][0], value if isinstance(value, str) else None
    if text is not None:
        _check_unit(requirement, name, text, where)
    is_lower = written.at_least is not None
    if limit is None or not math.isfinite(limit):
        raise _refusal(requirement, f"the bound is {limit}", where, "Give a finite number.")
    return Bound(name, float(limit), is_lower)


def _check_unit(
    requirement: Requirement, column: str, text: str, where: SourceLocation | None
) -> None:
    """Refuse a bound that was written with a unit of something else than its metric."""
    unit = METRICS[column].unit
    wanted, (_, found) = unit_exponents(unit), read_quantity(text)
    known = UNITS.get(unit)
    is_si = known is not None and known.numerator == known.denominator
    if wanted == found and (is_si or found == Dimension.NONE.exponents):
        return
    remedy = "Write a plain number."
    measured = "is a plain number" if wanted == Dimension.NONE.exponents else f"is in {unit}"
    if is_si:
        names = ", ".join(item for item, other in UNITS.items() if other.exponents == wanted)
        remedy = f"Write a plain number in {unit}, or one with a unit ({names})."
    what = f"{shown(text)} does not fit metric {column}, which {measured}"
    raise _refusal(requirement, what, where, remedy)


# --- FSRs checked against a plan: names and metrics are known, windows lie within the tails -------

Loc = tuple[str | int, ...]
Locate = Callable[[Loc], SourceLocation]
Dictionary = Mapping[str, SignalType]

JUDGE_VERSION = 7
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

    def dictionary(self, scenario: str, architecture: str) -> Mapping[str, SignalType]:
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
    if requirement.formula is not None and _formula(requirement)[2]:
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
        InputError: A name, metric or scenario does not exist, a dimension does not fit, a window
            has no end, or an architecture in the gate lacks a signal. Several errors come as
            ``InputErrors``.
    """
    checks = (_Check(item, place, plan, locate) for place, item in enumerate(concept.requirements))
    return tuple(_all_of(check.run for check in checks))


def check_demands(
    concept: Concept, plan: JudgedPlan, played: Sequence[Played], locate: Locate | None = None
) -> None:
    """Check of FSRs that are ready that each demands something of the runs that it is judged on.

    Args:
        concept: The functional safety concept.
        plan: What they were checked against.
        played: The scenarios as they are executed.
        locate: Finds file, line and column of a place in the concept.

    Raises:
        InputError: A bound is on the harmless side, or cannot be missed; a window exceeds a tail; a
            part of a formula does not depend on its signals. Several come as ``InputErrors``.
    """
    checks = (_Check(item, place, plan, locate) for place, item in enumerate(concept.requirements))
    _all_of(partial(check.check_demand, played) for check in checks)


def _all_of(acts: Iterable[Callable[[], T]]) -> list[T]:
    """Call all, and raise together what they raise."""
    found: list[T] = []
    together = Together()
    for act in acts:
        with together:
            found.append(act())
    together.finish()
    return found


def _place_of(requirement: Requirement) -> tuple[str, ...]:
    """Name the key that says what is wrong, if anything is."""
    bound = requirement.bound
    if bound is None:
        return ("formula",)
    if bound.metric not in METRICS:
        return ("bound", "metric")
    return ("bound", "at_most" if bound.at_least is None else "at_least")


def _weak_part(root: syntax.Condition, rows: Rows) -> tuple[syntax.Node, str, str] | None:
    """Find what asks for less than it seems; how, and what to write instead."""
    first = asked_of_first_row(root, rows)
    if first is not None:
        return first, "is asked of the first row alone", "Write always(...) or eventually(...)"
    for part in syntax.walk(root):
        if syntax.head_of(part) in {"eventually", "once", "until", "since"}:
            last = syntax.children(part)[-1]
            if syntax.head_of(last) == "implies":
                how = f"holds for {syntax.head_of(part)} at any row where its left side does not"
                return last, how, "Write and for implies"
    return None


def _idle_part(root: syntax.Condition, rows: Rows) -> tuple[syntax.Node, str, str] | None:
    """Find what decides nothing beside the other parts; how, and what to write instead."""
    if (found := uncounted(root, rows)) is None:
        return None
    part, at_first = found
    if at_first:
        how = "counts at the first row alone, for what the other parts say"
        return part, how, "Write what it shall demand later on"
    return part, "never counts, for what the other parts say", "Leave it out"


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
        if compiled.formula is None:
            return compiled
        self._check_names(compiled.formula, scenarios)
        self._check_parameters(compiled.formula, scenarios)
        self._check_windows(compiled.formula)
        missing = self._not_applicable(compiled.formula, scenarios)
        return CheckedRequirement(
            compiled.requirement, compiled.digest, compiled.formula, not_applicable=missing
        )

    def _where(self, *loc: str | int) -> SourceLocation | None:
        if self._locate is None:
            return None
        return self._locate(("requirements", self._number, *loc))

    def _refuse(self, message: str, remedy: str, *loc: str | int) -> SpecError:
        return _refusal(self._requirement, message, self._where(*(loc or ("formula",))), remedy)

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

    def _check_side(self, bound: Bound, played: Sequence[LogicalScenario]) -> None:
        """Refuse a bound that keeps a metric from being good, or that no value violates."""
        metric, written = bound.metric, self._requirement.bound
        if written is None or written.unusual_side:
            return
        end, among = metric.least if bound.is_lower else metric.most, ""
        if end is not None and metric.most_per and not bound.is_lower:
            # What a run that ends too soon leaves open is tested by each run that is long enough.
            choose = max if metric.settles else min
            lasts = choose(item.horizon + item.tail for item in played)
            end *= lasts if metric.most_per == "s" else lasts / self._plan.step + 1.0
            among = f" in a run of {lasts:g} s"
        from adeye.spec.plausible import farthest

        sign, side = (-1.0, "below") if bound.is_lower else (1.0, "above")
        limit = sign * farthest(unit_exponents(metric.unit) or (0, 0, 0)) if end is None else end
        cannot_fail = (bound.limit - limit) * sign >= 0.0
        if cannot_fail:
            value = "value" if end is not None else "plausible value"
            what = f"'{bound.text}' cannot fail: no {value} is {side} {limit:g}{among}"
        elif bound.is_lower is (metric.worse == "higher"):
            what = f"'{bound.text}' bounds the harmless side: the {metric.worse} it is, the worse"
        else:
            return
        other = "at_most" if bound.is_lower else "at_least"
        remedy = "Write a limit that can be missed" if cannot_fail else f"Write {other}"
        remedy += ", or unusual_side: true in the bound if it is meant."
        raise self._refuse(what, remedy, "bound", written.side)

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

    def check_demand(self, played: Sequence[Played]) -> None:
        """Refuse what asks for nothing unless it is meant, and what is meant without need."""
        compiled = compile_requirement(self._requirement)
        own = [
            (name, spec)
            for name, spec, is_inside in played
            if compiled.concerns(name, is_inside=is_inside)
        ]
        if own and compiled.bound is not None:
            self._check_side(compiled.bound, [spec for _, spec in own])
        if own and compiled.formula is not None:
            self._check_ends(compiled.formula, own)
            self._check_truth(compiled.formula, own)

    def _check_truth(self, formula: Formula, played: Sequence[tuple[str, LogicalScenario]]) -> None:
        runs = [
            Runs(self._union(name, spec), self._plan.step, spec.horizon, spec.tail)
            for name, spec in played
        ]
        longest = max(spec.horizon + spec.tail for _, spec in played)
        rows = Rows(self._plan.step, longest)
        found = _weak_part(formula.root, rows)
        if found is None and (constant := first_constant(formula, runs)) is not None:
            part, is_held = constant
            how = f"{'always' if is_held else 'never'} holds, whatever its signals are"
            remedy = "Write a limit or condition that depends on them, or leave the part out"
            found = part, how, remedy
        found = found or _idle_part(formula.root, rows)
        is_meant = self._requirement.unusual_formula
        if found is not None and not is_meant:
            part, how, remedy = found
            raise self._refuse(
                f"'{formula.quote(part)}' (formula, character {part.span[0] + 1}) {how}",
                f"{remedy}; or write unusual_formula: true in the FSR if it is meant.",
            )
        if is_meant and found is None:
            raise self._refuse(
                "every part of the formula holds on some runs and fails on others",
                "Leave unusual_formula out.",
                "unusual_formula",
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

    def _union(self, scenario: str, spec: LogicalScenario | None = None) -> dict[str, SignalType]:
        plan = self._plan if spec is None else replace(self._plan, scenarios={scenario: spec})
        union: dict[str, SignalType] = {}
        for architecture in self._plan.architectures:
            union |= plan.dictionary(scenario, architecture)
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

    def _check_windows(self, formula: Formula) -> None:
        for window in _windows(formula.root):
            try:
                syntax.window_rows(window, self._plan.step)
            except ExpressionError as error:
                raise self._refuse(error.message, error.remedy) from error
        if not math.isfinite(formula.reach_s):
            raise self._refuse(
                "an operator below another one has no window, so that no trace is long enough",
                "Give it a window, for example eventually[0 s, 2 s].",
            )

    def _check_ends(self, formula: Formula, played: Sequence[tuple[str, LogicalScenario]]) -> None:
        """Refuse what looks beyond the ends of the runs that it is judged on."""
        for name, scenario in played:
            self._check_past(formula, name, scenario.horizon)
            last = syntax.needed_time(formula.root, scenario.horizon)
            # Nothing is decided from the last row, so decisions must be read before it.
            last = max(last, last_decision(formula.root, scenario.horizon) + self._plan.step)
            needed = last - scenario.horizon
            if needed > scenario.tail + _SLACK_S:
                raise self._refuse(
                    f"it looks {needed:g} s beyond the horizon, and scenario {name!r} has a tail "
                    f"of {scenario.tail:g} s",
                    f"Give the scenario a tail of {needed:g} s or shorten the window.",
                )

    def _check_past(self, formula: Formula, scenario: str, horizon: float) -> None:
        """Refuse what looks behind the beginning of every run of a scenario, where nothing is."""
        found = next(_empty_past(formula.root, 0.0, horizon), None)
        if found is not None:
            part, latest = found
            raise self._refuse(
                f"'{formula.quote(part)}' is asked up to {latest:g} s of scenario {scenario!r}, "
                "and looks back to before its beginning, where there is nothing",
                "Shorten the window, or judge the FSR where the horizon is longer.",
            )


def _empty_past(
    node: syntax.Node, latest: float, horizon: float
) -> Iterator[tuple[syntax.Node, float]]:
    """Find the operators whose window lies before the beginning of a run wherever they are asked.

    Args:
        node: What is asked.
        latest: Last time at which it is [s].
        horizon: Last time at which an outermost obligation may start [s].

    Yields:
        Each of them, with the last time at which it is asked [s].
    """
    window = syntax.window_of(node)
    if isinstance(node, syntax.Temporal | syntax.Until):
        latest += horizon if window is None else window.last_s
    elif window is not None and window.first_s > latest + _SLACK_S:
        yield node, latest
    for child, back in syntax.read_back(node):
        yield from _empty_past(child, latest - back, horizon)


def last_decision(node: syntax.Node, horizon_s: float) -> float:
    """Give the last time at which a formula of finite reach reads what was decided [s].

    Args:
        node: The formula's root, evaluated at time 0.
        horizon_s: Last time at which an obligation of an outermost operator may start [s].

    Returns:
        The time; minus infinity if the formula reads scenes only.
    """
    if isinstance(node, syntax.PREDICATES):
        return 0.0 if any(is_decision(name) for name in syntax.names_in(node)) else -math.inf
    reads = (last_decision(child, horizon_s) - back for child, back in syntax.read_back(node))
    inner = max(reads, default=-math.inf)
    if isinstance(node, syntax.Temporal | syntax.Until):
        return inner + (horizon_s if node.window is None else node.window.last_s)
    return inner


def _windows(node: syntax.Node) -> Iterator[syntax.Window]:
    window = syntax.window_of(node)
    if window is not None:
        yield window
    for child in syntax.children(node):
        yield from _windows(child)
