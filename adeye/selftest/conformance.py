"""Does a channel from outside keep to what is asked of one, whatever language it is written in.

It is shown the same observations each time, recorded once in a drive of a built-in channel in its
place: what it answers changes nothing of what it is shown. So two answers can be compared.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.campaign.parts import load_parts
from adeye.errors import SpecError, UsageError, amount, placed, suggest
from adeye.ports import ChannelContext
from adeye.selftest.bench import SCENARIO
from adeye.signals import NO_FAULT, SILENT, ControlCommand, Floats, Measurement, Observation
from adeye.simulate import engine
from adeye.simulate.bridges.middleware import MIDDLEWARE
from adeye.simulate.channels.factory import HOSTED, make_channel
from adeye.simulate.channels.process.channel import find_program
from adeye.simulate.channels.process.protocol import Witness
from adeye.spec.architecture import Architecture
from adeye.spec.channels import OutsideChannel
from adeye.spec.load import load_architecture, load_scenario, shipped
from adeye.spec.odd import Attributes
from adeye.spec.quantity import SI
from adeye.sweep.axes import default_values
from adeye.sweep.case import TestCase
from adeye.sweep.groups import check_rates

if TYPE_CHECKING:
    from adeye.trace import ChannelEvent

OBSERVATIONS: Final = 100
"""How many are recorded."""
LONG: Final = 2_000
"""How many the long run has."""
PAUSE_S: Final = 1.0
"""How long nobody asks, in the middle of a run [s]."""
LINGERING: Final = 10
LINGER_S: Final = 0.02
"""Before so many questions that much time is left [s], for what would come before its question."""
ENDING_S: Final = 2.0
"""How long it may take to end after the end of its input [s]."""
SPEEDS: Final = (20.0, 25.0, 30.0)
"""Of the ego, in the runs that are recorded [m/s]."""
STEPS: Final = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
"""Master clocks that are tried, until the rates of the architecture fit one [s]."""
DYING: Final = range(20, OBSERVATIONS, 10)
"""Observations at which one sensor more has died."""

CASES: Final[Mapping[str, str]] = {
    "begins": "It answers the first line within its start deadline.",
    "answers": "It answers every observation within its step deadline, and does not end.",
    "in_step": "An answer is of the tick that was asked, alone, finite, with no key of its own.",
    "in_bounds": "No command is beyond what the actuators of the vehicle take.",
    "repeats": "A second run with the same observations gets the same answers, to the bit.",
    "several": "Three runs at once get the answers that each of them gets alone.",
    "pause": f"After {PAUSE_S:g} s without a question it answers as before, and says nothing else.",
    "no_object": "It goes on when no sensor sees an object.",
    "many_objects": "It goes on when every sensor reports as many objects as it can.",
    "dead_sensors": "It goes on while sensors die one by one, and linked channels are silent.",
    "long": f"It goes on for {LONG:,} observations.",
    "ends": f"It ends by itself within {ENDING_S:g} s after its input, with code 0, and leaves"
    " nothing.",
}
"""What is asked of a channel, by the id of the case."""


@dataclass(frozen=True, slots=True)
class Case:
    """What came of one case.

    Attributes:
        id: See ``CASES``.
        text: What is asked for.
        passed: None where it was not tried.
        reason: Why it did not pass, or was not tried.
    """

    id: str
    text: str
    passed: bool | None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Conformance:
    """What came of all cases.

    Attributes:
        channel: Id.
        kind: As the architecture has it.
        cases: In the order of ``CASES``.
    """

    channel: str
    kind: str
    cases: tuple[Case, ...]

    @property
    def conforms(self) -> bool:
        """Whether no case failed."""
        return all(case.passed is not False for case in self.cases)


@dataclass(frozen=True, slots=True)
class Subject:
    """A channel to be checked.

    Attributes:
        architecture: That it is in.
        channel: Its id.
        base_dir: Folder that its files are relative to.
    """

    architecture: Architecture
    channel: str
    base_dir: Path

    @property
    def kind(self) -> str:
        """Of the channel."""
        return self.architecture.channels[self.channel].kind


def subject_of(path: Path, channel: str | None = None) -> Subject:
    """Take a channel of an architecture.

    Args:
        path: The architecture's file.
        channel: Id; by default its only channel from outside the package.

    Raises:
        SpecError: The file is wrong, or what it names is not there.
        UsageError: There is no such channel, or several from outside.
    """
    loaded = load_architecture(path)
    load_parts(loaded)
    channels = loaded.spec.channels
    outside = [name for name, item in channels.items() if isinstance(item, OutsideChannel)]
    if channel is None and len(outside) == 1:
        channel = outside[0]
    if channel is None:
        listed = ", ".join(outside or channels)
        count = f"{len(outside)} channels" if outside else "no channel"
        raise UsageError(
            f"{path} has {count} from outside", remedy=f"Take one by --channel: {listed}."
        )
    if channel not in channels:
        raise UsageError(f"{path} has no channel {channel!r}", remedy=suggest(channel, channels))
    return Subject(loaded.spec, channel, path.parent)


def subject_of_command(words: Sequence[str]) -> Subject:
    """Take a command as the nominal channel of the shipped candidate, without values.

    Args:
        words: Program and arguments; files begin with ``./``, from the present folder.

    Raises:
        SpecError: There is no such program.
    """
    with placed(None, "the command: "):
        find_program(words, Path())
    content = load_architecture(shipped("odd") / "architectures" / "camera_radar.yaml").content
    nominal = content["channels"]["nominal"]
    given = {**nominal, "kind": "process", "parameters": {"command": list(words)}}
    channels = {**content["channels"], "nominal": given}
    architecture = Architecture.model_validate({**content, "channels": channels})
    return Subject(architecture, "nominal", Path())


def check(subject: Subject) -> Conformance:
    """Try every case.

    Args:
        subject: The channel.

    Raises:
        SpecError: What it names does not load, or its rates fit no master clock.
        PlatformError: No program can be started, or nobody listens at its address.
    """
    return Conformance(subject.channel, subject.kind, tuple(_cases(subject)))


# --- What is shown --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Script:
    """What a channel is shown: the same each time, whatever it answers."""

    context: ChannelContext
    observations: Sequence[Observation]

    def changed(self, change: Callable[[int, str, Measurement], Measurement]) -> _Script:
        """Change what sensors deliver, by the number of the observation and the link."""
        return replace(
            self,
            observations=[
                replace(
                    item,
                    measurements={
                        name: change(number, name, seen.copy())
                        for name, seen in item.measurements.items()
                    },
                )
                for number, item in enumerate(self.observations)
            ],
        )

    def prolonged(self, count: int) -> Iterator[Observation]:
        """Repeat the last observation, with times that go on."""
        yield from self.observations
        last = self.observations[-1]
        for number in range(1, count - len(self.observations) + 1):
            later = number * self.context.period
            seen = {
                name: replace(item, stamp=np.where(item.stamp < 0.0, -1.0, item.stamp + later))
                for name, item in last.measurements.items()
            }
            yield replace(last, time=last.time + later, measurements=seen)


class _Stimuli(Witness):
    """Keeps what a channel is shown in all runs of a batch."""

    def __init__(self, channel: str) -> None:
        self.channel = channel
        self.context: ChannelContext | None = None
        self.observations: list[Observation] = []

    def begin(self, context: ChannelContext, kind: str) -> None:
        del kind
        self.context = context

    def take(self, observation: Observation) -> None:
        self.observations.append(_copied(observation))


def _copied(item: Observation) -> Observation:
    authority = item.authority
    if authority is not None:
        authority = replace(
            authority, channel=authority.channel.copy(), reason=authority.reason.copy()
        )
    return Observation(
        item.time,
        {name: seen.copy() for name, seen in item.measurements.items()},
        {name: heard.copy() for name, heard in item.commands.items()},
        authority,
        item.running.copy(),
    )


def _record(subject: Subject, speeds: Sequence[float]) -> _Script:
    """Drive with built-in channels in place of those from outside, and keep what is shown."""
    content = subject.architecture.model_dump(mode="json")
    content["vehicle"].pop("plant", None)
    kept = ("links", "rate", "delay")
    for name, channel in subject.architecture.channels.items():
        if isinstance(channel, OutsideChannel):
            own = content["channels"][name]
            content["channels"][name] = {"kind": "nominal", **{key: own[key] for key in kept}}
    architecture = Architecture.model_validate(content, context=SI)
    script = _stimuli(Subject(architecture, subject.channel, subject.base_dir), tuple(speeds))
    parameters = [subject.architecture.channels[subject.channel].parameters] * len(speeds)
    context = replace(script.context, parameters=parameters, shows_candidates=True)
    return replace(script, context=context)


def _stimuli(subject: Subject, speeds: tuple[float, ...]) -> _Script:
    """Keep what a channel is shown that drives."""
    architecture = subject.architecture
    scenario = load_scenario(Path(__file__).with_name("project") / SCENARIO).spec
    step = _step(architecture)
    stimuli = _Stimuli(subject.channel)
    engine.run(
        [
            TestCase(
                scenario_id=scenario.scenario,
                scenario=scenario,
                parameters={**default_values(scenario), "ego_speed": speed},
                architecture=architecture,
                faults=(),
                fault_entry=NO_FAULT,
                replicate=0,
                seed=1,
                step=step,
                point={},
                inside_odd=True,
                attributes=Attributes(),
            )
            for speed in speeds
        ],
        base_dirs={architecture.architecture: subject.base_dir},
        witness=stimuli,
        most_ticks=round(OBSERVATIONS / (architecture.channels[subject.channel].rate * step)),
    )
    assert stimuli.context is not None
    return _Script(stimuli.context, stimuli.observations)


def _step(architecture: Architecture) -> float:
    """Find a master clock that all rates and delays fit."""
    for step in STEPS[:-1]:
        try:
            check_rates(architecture, step)
        except SpecError:
            continue
        return step
    check_rates(architecture, STEPS[-1])
    return STEPS[-1]


def _empty(_number: int, _name: str, seen: Measurement) -> Measurement:
    seen.mask[:], seen.detections[:] = False, 0.0
    return seen


def _full(_number: int, _name: str, seen: Measurement) -> Measurement:
    """Report cars on all sides, the nearest first."""
    count = np.arange(seen.mask.shape[1])
    rows = [10.0 + 2.0 * count, 3.5 * (count % 5 - 2.0), 0.0 * count, 0.0 * count]
    rows += [4.5 + 0.0 * count, 1.8 + 0.0 * count, 0.0 * count]
    seen.mask[:], seen.detections[:] = True, np.stack(rows, axis=1)
    return seen


def _dying(script: _Script) -> _Script:
    """Let sensors die one after the other, as a dropout has it, and channels be silent at last."""
    links = [name for name in script.context.links if name in script.context.sensors]
    dead = dict(zip(links, DYING, strict=False))
    last: dict[str, Measurement] = {}

    def die(number: int, name: str, seen: Measurement) -> Measurement:
        if number < dead.get(name.removeprefix("health."), DYING[-1]):
            last[name] = seen
            return seen
        stale = last[name].copy()
        stale.fresh[:] = stale.alive[:] = stale.mask[:] = False
        return stale

    changed = script.changed(die)
    observations = []
    for number, item in enumerate(changed.observations):
        heard = {name: command.copy() for name, command in item.commands.items()}
        for command in heard.values() if number >= DYING[0] else ():
            command.status[:] = SILENT
        observations.append(replace(item, commands=heard))
    return replace(changed, observations=observations)


# --- The cases ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Played:
    """What a channel answered in the runs of a script.

    Attributes:
        began: Whether it did, in all runs.
        event: First failure in any run, or None.
        commands: Of each observation, up to the failure.
        left: What is wrong with its end.
    """

    began: bool
    event: ChannelEvent | None
    commands: tuple[ControlCommand, ...]
    left: str = ""

    @property
    def reason(self) -> str:
        """Why it failed; empty if it did not."""
        event = self.event
        return "" if event is None else f"{event.outcome} at {event.time:g} s: {event.detail}"


def _play(
    subject: Subject,
    context: ChannelContext,
    observations: Iterator[Observation] | Sequence[Observation],
    *,
    pause_at: int = -1,
    lingers: bool = False,
    ends: bool = False,
) -> _Played:
    """Show a channel observations until it fails."""
    parameters = context.parameters[0]
    files = getattr(subject.architecture.channels[subject.channel], "files", ())
    channel: Any = make_channel(subject.kind, subject.base_dir, parameters, [files] * context.runs)
    commands: list[ControlCommand] = []
    try:
        channel.reset(context)
        event = _first(channel)
        began, left = event is None, ""
        for number, item in enumerate(observations):
            if event is not None:
                break
            if number == pause_at:
                time.sleep(PAUSE_S)
            if lingers and number < LINGERING:
                time.sleep(LINGER_S)
            command = channel.act(_copied(item)).copy()
            event = _first(channel)
            if event is None:
                commands.append(command)
        if ends and event is None:
            left = _left(subject, *channel.finish(ENDING_S))
    finally:
        getattr(channel, "close", lambda: None)()
    return _Played(began, event, tuple(commands), left)


def _first(channel: Any) -> ChannelEvent | None:
    return next((event for event in channel.events if event is not None), None)


def _left(subject: Subject, wrong: Mapping[int, str], strays: int) -> str:
    # What a launcher of a middleware starts apart is ended by adeye's own program, not by itself.
    if strays and not wrong and subject.kind not in MIDDLEWARE:
        left = amount(strays, "process", "processes")
        return f"it left {left} behind, out of its session"
    return next((f"it {text}" for text in wrong.values()), "")


def _cases(subject: Subject) -> Iterator[Case]:
    """Try one case after the other; what never answers is not asked again."""
    script = _record(subject, SPEEDS)
    context = script.context
    first = _play(subject, context, script.observations, lingers=True)
    is_nonsense = first.event is not None and first.event.outcome == "channel_invalid_output"
    told = {"begins": "" if first.began else first.reason}
    if first.began:
        told["answers"] = "" if is_nonsense else first.reason
        told["in_step"] = first.reason if is_nonsense else ""
        told["in_bounds"] = _beyond(context, first.commands)
    for name, reason in told.items():
        yield Case(name, CASES[name], not reason, reason)
    rest = [name for name in CASES if name not in told]
    if first.event is not None:
        yield from (Case(name, CASES[name], None, "it failed before") for name in rest)
        return
    trials: dict[str, Callable[[], str]] = {
        "repeats": lambda: _unlike(first, _play(subject, context, script.observations)),
        "several": lambda: _alone(subject, first),
        "pause": lambda: _unlike(
            first, _play(subject, context, script.observations, pause_at=OBSERVATIONS // 2)
        ),
        "no_object": lambda: _goes_on(subject, script.changed(_empty)),
        "many_objects": lambda: _goes_on(subject, script.changed(_full)),
        "dead_sensors": lambda: _goes_on(subject, _dying(script)),
        "long": lambda: _goes_on(subject, script, script.prolonged(LONG)),
        "ends": lambda: _play(subject, context, script.observations, ends=True).left,
    }
    for name in rest:
        if name == "ends" and subject.kind not in HOSTED:
            yield Case(name, CASES[name], None, f"kind {subject.kind} has no input that ends")
            continue
        reason = trials[name]()
        yield Case(name, CASES[name], not reason, reason)


def _goes_on(
    subject: Subject, script: _Script, observations: Iterator[Observation] | None = None
) -> str:
    played = _play(subject, script.context, observations or script.observations)
    return played.reason or _beyond(script.context, played.commands)


def _alone(subject: Subject, together: _Played) -> str:
    for run, speed in enumerate(SPEEDS):
        script = _record(subject, [speed])
        alone = _play(subject, script.context, script.observations)
        reason = _unlike(together, alone, run)
        if reason:
            return f"run {run + 1} of {len(SPEEDS)}: {reason}"
    return ""


_COMPARED: Final = ("acceleration", "steering_angle", "status")


def _unlike(one: _Played, other: _Played, run: int | None = None) -> str:
    """Say where the answers of two plays differ; of one run of the first if it is named."""
    if other.reason:
        return other.reason
    place = slice(None) if run is None else slice(run, run + 1)
    for mine, theirs in zip(one.commands, other.commands, strict=True):
        for name in _COMPARED:
            this, that = getattr(mine, name)[place], getattr(theirs, name)
            if not np.array_equal(this, that):
                at = int(np.flatnonzero(this != that)[0])
                return f"{name} {this[at]!r} and {that[at]!r} at {_time(mine):g} s"
    return ""


def _time(command: ControlCommand) -> float:
    return float(np.max(command.stamp))


def _beyond(context: ChannelContext, commands: Sequence[ControlCommand]) -> str:
    """Say which command is more than the actuators take."""
    car = context.vehicles[0]
    bounds = {
        "acceleration": (-car.max_deceleration, car.max_acceleration, "m/s²"),
        "steering_angle": (-car.max_steering_angle, car.max_steering_angle, "rad"),
    }
    for command in commands:
        for name, (low, high, unit) in bounds.items():
            values: Floats = getattr(command, name)
            wrong = values[~((values >= low) & (values <= high))]
            if wrong.size:
                at = f"{name} {wrong[0]:.6g} {unit} at {_time(command):g} s"
                return f"{at} is outside of {low:.6g} to {high:.6g} {unit}"
    return ""
