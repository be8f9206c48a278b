"""Check what a scenario refers to: names and dimensions of its formulas, actors, events, lanes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.errors import ExpressionError, InputError, SpecError, suggest
from adeye.simulate.world.compile import EGO, compile_world, gap_circle
from adeye.simulate.world.formulas import Formulas, Situation
from adeye.simulate.world.storyboard import parameter_dimension, trigger_variables
from adeye.spec.expression import Expression, to_program
from adeye.spec.plausible import implausible, quantities
from adeye.spec.quantity import require_dimension
from adeye.spec.scenario import Cross, SpeedChange, Stop

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from adeye.spec.scenario import LogicalScenario
    from adeye.units import Dimension

Loc = tuple[str | int, ...]
Finding = tuple[Loc, str]


def check_scenario(scenario: LogicalScenario, lifted: Collection[str] = ()) -> list[Finding]:
    """Find what a scenario names that is not there, and formulas that measure the wrong thing.

    Values are looked at where they are plain; the others vary from test case to test case, see
    ``check_worlds``.

    Args:
        scenario: A valid record.
        lifted: Bounds of plausibility that do not count, beside those that it lifts itself.

    Returns:
        Place in the file and message of each finding; empty if all is well.
    """
    findings = [*_parameters(scenario)]
    if findings:
        # Without the parameters' dimensions every formula would be reported once more.
        return findings
    findings += _references(scenario)
    if findings:
        return findings
    names: dict[str, Dimension | None] = {
        name: parameter_dimension(item) for name, item in scenario.parameters.items()
    }
    variables: dict[str, Dimension | None] = {**trigger_variables(scenario)}
    for loc, expression, required in quantities(scenario, ()):
        if not isinstance(expression, Expression):
            continue
        is_trigger = loc[0] == "storyboard" and loc[-1] == "when"
        known = variables if is_trigger else names
        wrong = [*_wrong(expression, required, known)] or [*_not_compiled(expression, known)]
        findings += [(loc, text) for text in wrong]
    if not findings:
        lifted = {*scenario.beyond_plausible, *lifted}
        findings += [(loc, f"{text}. {todo}") for loc, text, todo in implausible(scenario, lifted)]
    return [*findings, *missing_lanes(scenario)]


def check_worlds(cases: Sequence[Situation], lifted: Collection[str] = ()) -> None:
    """Compute the initial worlds of a batch, and check that every value is plausible.

    Args:
        cases: Test cases that fit into one batch.
        lifted: Bounds of plausibility that do not count, beside those that a scenario lifts itself.

    Raises:
        SpecError: A value is not possible or not plausible; the message begins with its path.
    """
    formulas = Formulas.of(cases)
    compile_world(cases, formulas)
    for scenario, _, columns in formulas.parts:
        width = scenario.world.road.lane_width.evaluate(columns)
        limits = {"ego.offset": (-width, width)}
        off = {*scenario.beyond_plausible, *lifted}
        for item in implausible(scenario, off, limits, lambda text: text.evaluate(columns)):  # noqa: B023 - used up at once
            raise SpecError(item.text, remedy=item.remedy)


def check_purpose(scenario: LogicalScenario) -> list[Finding]:
    """Find what a scenario can do without, and so may lack without that anybody sees it.

    Args:
        scenario: One without findings of ``check_scenario``.

    Returns:
        As for ``check_scenario``: events that need not begin and do not say so, and parameters that
        nothing depends on.
    """
    findings: list[Finding] = []
    for name, event in scenario.storyboard.items():
        if (name in scenario.realised) == event.optional:
            text = (
                "is optional, and realised says that it must begin. Take one of them away"
                if event.optional
                else "need not begin, and nobody sees if it never does. Add it to realised, or "
                "write optional: true"
            )
            findings.append((("storyboard", name), f"event {name!r} {text}"))
    findings += _rivals(scenario)
    used = parameters_used(scenario)
    findings += [
        (("parameters", name), f"nothing that happens depends on parameter {name!r}. Remove it")
        for name in scenario.parameters
        if name not in used
    ]
    return findings


def _rivals(scenario: LogicalScenario) -> Iterator[Finding]:
    """Find events of which one is lost whenever both begin, for they do so at the same tick."""
    order = scenario.acting_order
    index = {name: column for column, name in enumerate(trigger_variables(scenario))}

    def begins(name: str) -> tuple[object, ...]:
        event = scenario.storyboard[name]
        program = to_program(event.when, index)
        delay = 0.0 if event.delay is None else event.delay.text
        return program.ops.tobytes(), program.args.tobytes(), delay

    for place, later in enumerate(order):
        for name in order[:place]:
            event, other = scenario.storyboard[name], scenario.storyboard[later]
            kinds = type(event.action), type(other.action)
            speeds = [kind in {SpeedChange, Stop} for kind in kinds]
            meet = speeds[0] == speeds[1] or (speeds[0] and kinds[1] is Cross)
            if event.actor == other.actor and meet and begins(name) == begins(later):
                text = f"event {name!r} does nothing: {later!r} takes its place at the same time"
                yield ("storyboard", name), f"{text}. Remove one, or let them begin apart"


def parameters_used(scenario: LogicalScenario) -> frozenset[str]:
    """Name what the formulas of a scenario use for what happens.

    Constraints only choose among its values, and a goal only ends what is looked at.
    """
    return frozenset[str]().union(*(item.names for item in formulas_used(scenario)))


def formulas_used(scenario: LogicalScenario) -> Iterator[Expression]:
    """Give the formulas of a scenario that say what happens, see ``parameters_used``."""
    for loc, item, _ in quantities(scenario, ()):
        is_aside = loc[0] == "constraints" or loc[:2] == ("ego", "goal")
        if isinstance(item, Expression) and not is_aside:
            yield item


def _parameters(scenario: LogicalScenario) -> Iterator[Finding]:
    for name, parameter in scenario.parameters.items():
        loc = ("parameters", name)
        if name == "time":
            yield loc, "'time' is the time of the run and cannot name a parameter"
        try:
            parameter_dimension(parameter)
        except InputError as error:
            yield (*loc, "default"), _text(error)


def _references(scenario: LogicalScenario) -> Iterator[Finding]:
    for name in scenario.actors:
        if name == EGO:
            yield ("actors", name), "'ego' is the vehicle under test and cannot name an actor"
        if name in scenario.world.objects:
            yield ("actors", name), f"{name!r} is a static object as well"
    if EGO in scenario.world.objects:
        yield ("world", "objects", EGO), "'ego' is the vehicle under test"
    yield from _starts(scenario)
    yield from _events(scenario)
    for number, event in enumerate(scenario.realised):
        if event not in scenario.storyboard:
            hint = suggest(event, scenario.storyboard)
            yield ("realised", number), f"there is no event {event!r}. {hint}"


def _starts(scenario: LogicalScenario) -> Iterator[Finding]:
    things = [EGO, *scenario.actors, *scenario.world.objects]
    unknown = False
    for name, actor in scenario.actors.items():
        base = actor.start.ahead_of
        if base is not None and base not in things:
            unknown = True
            loc = ("actors", name, "start", "ahead_of")
            yield loc, f"there is no actor {base!r}. {suggest(base, things)}"
        if not actor.takes_actions:
            how = "reactive" if actor.driver is None else "driven"
            if actor.start.lane is None:
                yield ("actors", name, "start"), f"a {how} actor starts in a lane"
            if actor.start.heading is not None:
                loc = ("actors", name, "start", "heading")
                yield loc, f"a {how} actor starts along the road, without a heading"
    circle = () if unknown else gap_circle(scenario)
    if circle:
        loc = ("actors", circle[0], "start", "ahead_of")
        yield loc, f"the starts form a circle: {' → '.join(circle)}"


def _events(scenario: LogicalScenario) -> Iterator[Finding]:
    for name, event in scenario.storyboard.items():
        loc = ("storyboard", name, "actor")
        actor = scenario.actors.get(event.actor)
        if actor is None:
            yield loc, f"there is no actor {event.actor!r}. {suggest(event.actor, scenario.actors)}"
        elif not actor.takes_actions:
            how = "reactive" if actor.driver is None else "driven by an FMU"
            yield loc, f"{event.actor!r} is {how} and takes no actions from the storyboard"
        base = event.speed and event.speed.relative_to
        things = [EGO, *scenario.actors, *scenario.world.objects]
        if base and base not in things:
            text = f"there is no actor {base!r}. {suggest(base, things)}"
            yield ("storyboard", name, "speed", "relative_to"), text


def _wrong(
    expression: Expression, required: Dimension, known: Mapping[str, Dimension | None]
) -> Iterator[str]:
    unknown = sorted(expression.names - known.keys())
    for name in unknown:
        yield f"'{expression.text}' uses {name!r}, which does not exist. {suggest(name, known)}"
    if unknown:
        return
    try:
        require_dimension(expression, required, known)
    except ExpressionError as error:
        yield _text(error)


def _not_compiled(
    expression: Expression, variables: Mapping[str, Dimension | None]
) -> Iterator[str]:
    try:
        to_program(expression, {name: column for column, name in enumerate(variables)})
    except ExpressionError as error:
        yield _text(error)


def missing_lanes(scenario: LogicalScenario) -> Iterator[Finding]:
    """Find the lanes that a scenario names and its road does not have."""
    lanes = scenario.world.road.lanes
    written: list[tuple[Loc, Expression | None]] = [(("ego", "lane"), scenario.ego.lane)]
    for name, actor in scenario.actors.items():
        written.append((("actors", name, "start", "lane"), actor.start.lane))
    for name, event in scenario.storyboard.items():
        if event.lane_change is not None:
            target = event.lane_change.to_lane
            written.append((("storyboard", name, "lane_change", "to_lane"), target))
    for place, expression in written:
        if expression is not None and expression.is_constant:
            lane = float(expression.evaluate({}))
            if lane not in range(lanes):
                yield place, f"{lane:g} is no lane of a road with lanes 0 to {lanes - 1}"


def _text(error: InputError) -> str:
    return f"{error.message}. {error.remedy}".rstrip()
