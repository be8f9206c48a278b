"""The channels of an architecture together: who sees what when, and whose failure came first."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.errors import SpecError
from adeye.plugins import load_part
from adeye.signals import (
    NO_CHANNEL,
    OK,
    SILENT,
    Authority,
    ControlCommand,
    Measurement,
    Observation,
)
from adeye.simulate.channels import make_channel
from adeye.simulate.channels.links import View, linked_channels, observe
from adeye.simulate.channels.rack import ChannelRack, ClockedChannel
from adeye.simulate.sensors.rig import Rig
from adeye.simulate.world.compile import ego_desired_speeds
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.sweep.case import TestCase
from adeye.testing import ScriptedChannel, channel_context, check_channel
from tests.project import Executed
from tests.simulate.faults import flows
from tests.simulate.sensors.scenes import scene, scene_context, sensor_spec
from tests.stored import stored

PLUGIN: str = stored("plugins")["recorders"]

SENSORS = {
    "pose": {"kind": "localisation", "rate": "20 Hz"},
    "truth": {"kind": "ground_truth", "rate": "20 Hz"},
}


class Bench:
    """A rack with plug-in channels, driven tick by tick."""

    def __init__(self, folder: Path, base: TestCase, channels: dict[str, Any]) -> None:
        for name, spec in channels.items():
            channels[name] = {"rate": "20 Hz", **spec}
        names = list(channels)
        content = {
            **base.architecture.model_dump(mode="json"),
            "sensors": {n: {**s, "rate": 20.0} for n, s in SENSORS.items()},
            "channels": {
                n: {**s, "rate": float(s["rate"].split()[0])} for n, s in channels.items()
            },
            "switch": {"policy": "fixed_priority", "priority": names, "default": names[0]},
        }
        (folder / "plugin.py").write_text(PLUGIN, "utf-8")
        module = sys.modules[load_part("./plugin.py:Recorder", folder).obj.__module__]
        self.seen: list[tuple[str, Any, Any]] = module.SEEN
        self.seen.clear()
        self.case = replace(
            base, architecture=Architecture.model_validate(content, context=SI), faults=()
        )
        self.context = scene_context(runs=2)
        self.rig = Rig([self.case] * 2, self.context, folder)
        self.rack = ChannelRack([self.case] * 2, self.context, folder)

    def tick(self, number: int) -> list[ControlCommand]:
        shown = scene(self.context, [(50.0, 5.25)], ego=(0.0, 5.25, 0.0, 20.0), tick=number)
        return self.rack.act(shown, self.rig.sense(shown))


@pytest.fixture
def base(mini: Executed) -> TestCase:
    return mini.plan.cases[0]


Making = Callable[[dict[str, Any]], Bench]


@pytest.fixture
def bench_of(tmp_path: Path, base: TestCase) -> Making:
    return partial(Bench, tmp_path, base)


def test_only_physical_lidars_are_clustered(base: TestCase, tmp_path: Path) -> None:
    content = base.architecture.model_dump(mode="json")
    lidar = sensor_spec("lidar/physical", mount={"z": "1 m"}, field_of_view="360 deg", range="80 m")
    content["sensors"]["lidar"] = lidar.model_dump(mode="json")
    changed = Architecture.model_validate(content, context=SI)
    cases = [replace(base, architecture=changed, faults=())] * 2
    context = scene_context(runs=2)
    readings = Rig(cases, context, tmp_path).sense(scene(context, [(30.0, 0.0)]))
    found = ChannelRack(cases, context, tmp_path).detect(readings)
    assert list(found) == list(readings)
    assert not readings["lidar"].mask.any()
    assert found["lidar"].mask.sum(axis=1).tolist() == [1, 1]
    assert found["lidar"].source[:, 0].tolist() == [0, 0]
    assert all(found[name] is readings[name] for name in found if name != "lidar")


def recorder(name: str = "Recorder", **changes: Any) -> dict[str, Any]:
    return {"kind": f"./plugin.py:{name}", **changes}


def test_every_channel_answers_at_every_tick_under_its_own_id(bench_of: Making) -> None:
    bench = bench_of({"one": recorder(), "two": recorder()})
    for number in range(3):
        proposals = bench.tick(number)
        assert [item.channel for item in proposals] == ["one", "two"]
        for item in proposals:
            assert item.acceleration == pytest.approx([1.0 + 0.05 * number] * 2)


def test_channel_acts_at_its_rate_and_computing_delays_the_command(bench_of: Making) -> None:
    bench = bench_of({"late": recorder(delay=0.1), "slow": recorder(rate="10 Hz")})
    proposals = [bench.tick(number) for number in range(5)]
    late, slow = zip(*proposals, strict=True)
    assert [float(item.stamp[0]) for item in slow] == pytest.approx([0.0, 0.0, 0.1, 0.1, 0.2])
    assert [float(item.stamp[0]) for item in late] == pytest.approx([-1.0, -1.0, 0.0, 0.05, 0.1])
    assert [int(item.status[0]) for item in late] == [SILENT, SILENT, OK, OK, OK]


def test_channel_sees_what_is_linked_to_it_and_nothing_else(bench_of: Making) -> None:
    eyes = recorder(links=["truth"])
    every = recorder(links=["pose", "truth", "channels.blind", "switch"])
    bench = bench_of({"blind": recorder(), "eyes": eyes, "all": every})
    bench.tick(0)
    shown = {name: item for name, time, item in bench.seen if time == 0.0}
    assert (dict(shown["blind"].measurements), dict(shown["blind"].commands)) == ({}, {})
    assert list(shown["eyes"].measurements) == ["truth"]
    assert list(shown["all"].measurements) == ["pose", "truth"]
    assert list(shown["all"].commands) == ["blind"]
    assert shown["blind"].authority is None
    # Which object is behind a detection is the recorder's knowledge alone.
    assert (shown["eyes"].measurements["truth"].source == -1).all()


def test_command_and_authority_of_others_are_seen_one_tick_later(bench_of: Making) -> None:
    bench = bench_of({"first": recorder(), "second": recorder(links=["channels.first", "switch"])})
    for number in range(3):
        proposals = bench.tick(number)
        numbers = np.full(2, number, dtype=np.int64)
        authority = Authority(numbers, numbers.copy())
        bench.rack.remember(proposals, authority)
        # What the switch does with its arrays later reaches nobody.
        authority.channel[:] = NO_CHANNEL
    shown = [item for name, time, item in bench.seen if name == "second" and time != "reset"]
    assert shown[0].authority is None
    assert int(shown[0].commands["first"].status[0]) == SILENT
    stamps = [float(item.commands["first"].stamp[0]) for item in shown[1:]]
    assert stamps == pytest.approx([0, 0.05])
    assert [int(item.authority.channel[0]) for item in shown[1:]] == [0, 1]


def test_context_holds_what_is_known_before_the_drive(bench_of: Making, base: TestCase) -> None:
    bench = bench_of({"one": recorder(links=["pose", "channels.one"], rate="10 Hz")})
    name, _, context = bench.seen[0]
    assert name == "one"
    assert (context.step, context.period, context.runs) == (0.05, 0.1, 2)
    assert dict(context.sensors) == {"pose": "localisation"}
    assert context.desired_speed.tolist() == [base.parameters["ego_speed"]] * 2


def test_monitors_stand_in_the_order_of_the_channels(bench_of: Making) -> None:
    safety = {"kind": "safety", "links": ["truth"], "parameters": {}}
    bench = bench_of({"safety": safety, "own": recorder("Watching")})
    proposals = bench.tick(0)
    # An architecture keeps its parts in the order of their names.
    assert [item.channel for item in proposals] == ["own", "safety"]
    assert bench.rack.monitor_ids[0] == "watched"
    assert "object_danger" in bench.rack.monitor_ids[1:]
    widths = [item.monitors.shape[1] for item in proposals if item.monitors is not None]
    assert widths == [1, len(bench.rack.monitor_ids) - 1]


def test_failing_channel_is_silent_and_the_others_go_on(bench_of: Making) -> None:
    bench = bench_of({"bad": recorder("Failing"), "good": recorder()})
    states = [[int(item.status[0]) for item in bench.tick(number)] for number in range(4)]
    assert states == [[OK, OK], [OK, OK], [SILENT, OK], [SILENT, OK]]


def test_earliest_failure_of_any_channel_is_the_runs_event(bench_of: Making) -> None:
    late, early = recorder("FailingLater"), recorder("Failing")
    bench = bench_of({"late": late, "good": recorder(), "early": early})
    assert bench.rack.events == [None, None]
    for number in range(6):
        bench.tick(number)
    events = [event for event in bench.rack.events if event]
    assert [(event.channel, round(event.time, 9)) for event in events] == [("early", 0.1)] * 2
    # The gate asks for every channel that failed, not for the first alone.
    assert [[item.channel for item in event.later] for event in events] == [["late"]] * 2
    # A run depends on the machine if any failure in it does.
    inner: Any = bench.rack._inner["late"]
    inner.events[1] = replace(inner.events[1], is_machine_dependent=True)
    found = [event and (event.channel, event.is_machine_dependent) for event in bench.rack.events]
    assert found == [("early", False), ("early", True)]


def test_ego_without_desired_speed_is_asked_to_keep_its_start_speed(base: TestCase) -> None:
    scenario = base.scenario.model_copy(
        update={"ego": base.scenario.ego.model_copy(update={"desired_speed": None})}
    )
    faster = replace(base, parameters={**base.parameters, "ego_speed": 33.0})
    cases = [replace(base, scenario=scenario), faster]
    assert ego_desired_speeds(cases).tolist() == [base.parameters["ego_speed"], 33.0]


STEP = 0.05


def clocked(commands: Any, every: int, delay: int) -> ClockedChannel:
    made = ClockedChannel(ScriptedChannel(commands), every, delay)
    made.reset(channel_context(None, links=(), sensors={}))
    return made


def observation(tick: int) -> Observation:
    return Observation(tick * STEP, {}, {}, None, np.ones(1, dtype=np.bool_))


def test_command_is_released_after_the_delay_and_held_between_the_channels_own_ticks() -> None:
    table: list[tuple[int, int, list[float], list[int | None]]] = [
        (3, 0, [1, 1, 1, 2, 2, 2, 3], [0, 0, 0, 3, 3, 3, 6]),
        (1, 2, [0, 0, 1, 2, 3], [None, None, 0, 1, 2]),
        # A delay longer than the period keeps every command.
        (2, 3, [0, 0, 0, 1, 1, 2, 2, 3], [None, None, None, 0, 0, 2, 2, 4]),
    ]
    for every, delay, expected, stamps in table:
        channel = clocked(np.arange(1.0, 20.0), every, delay)
        for tick, (acceleration, stamp) in enumerate(zip(expected, stamps, strict=True)):
            command = channel.act(observation(tick) if channel.is_due else None)
            assert command.acceleration[0] == acceleration, tick
            assert command.stamp[0] == (-1.0 if stamp is None else STEP * stamp), tick
            assert (command.status[0] == SILENT) == (stamp is None), tick


def test_due_channel_needs_an_observation() -> None:
    with pytest.raises(ValueError, match="needs an observation"):
        clocked([1.0], 2, 0).act(None)


def test_reset_forgets_what_was_on_the_way() -> None:
    channel = clocked([5.0], 1, 1)
    channel.act(observation(0))
    channel.reset(channel_context(None, links=(), sensors={}))
    assert channel.act(observation(0)).stamp[0] == -1.0


# --- From the kind of a channel to its class, and to that of a plug-in ----------------------------

SCALAR: str = stored("plugins")["kinds"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(SCALAR)
    return tmp_path


def answered(kind: str, folder: Path, **parameters: float) -> ControlCommand:
    """Make a channel, tell it its parameters, and ask it once."""
    channel = make_channel(kind, folder)
    channel.reset(channel_context(parameters, links=(), sensors={}))
    return channel.act(Observation(0.0, {}, {}, None, np.ones(1, dtype=np.bool_)))


def test_plugin_and_policy_are_contained_where_they_cannot_be_made(folder: Path) -> None:
    for kind in ("policy", "./mine.py:Failing"):
        assert answered(kind, folder).status.tolist() == [SILENT]
    with pytest.raises(SpecError, match=r"no act\(\)"):
        make_channel("./mine.py:NoChannel", folder)


def test_plugin_gets_its_parameters_and_keeps_its_monitors(folder: Path) -> None:
    assert answered("./mine.py:Mine", folder, gain=0.25).acceleration.tolist() == [0.25]
    with pytest.raises(SpecError, match=r"channels\.tested\.parameters\.gian"):
        answered("./mine.py:Mine", folder, gian=1.0)
    assert make_channel("./mine.py:Batch", folder).monitor_ids == ("own",)
    assert answered("./mine.py:Batch", folder).status.tolist() == [OK]


def test_plugins_conform(folder: Path) -> None:
    for name in ("Mine", "Batch"):
        check_channel(lambda name=name: make_channel(f"./mine.py:{name}", folder), {})


# --- What a channel is shown: what its links name, and nothing that it could alter ----------------

AUTHORITY = Authority(np.zeros(2, dtype=np.int64), np.ones(2, dtype=np.int64))
RUNNING = np.ones(2, dtype=np.bool_)


def measurement() -> Measurement:
    return flows.sample(0.0, things=1, with_estimate=True)


def command() -> ControlCommand:
    return replace(flows.command(1.0, channel="a", stamp=0.0), plan=np.zeros((2, 3, 4)))


READINGS = {"front": measurement(), "rear": measurement()}


def test_only_what_is_linked_is_seen() -> None:
    seen = observe(("front",), 1.0, READINGS, {"a": command()}, AUTHORITY, RUNNING, protect=False)
    assert set(seen.measurements) == {"front"}
    assert seen.commands == {}
    assert seen.authority is None


def test_source_of_a_detection_is_blanked_and_the_sensor_keeps_its_own() -> None:
    seen = observe(("front",), 1.0, READINGS, {}, None, RUNNING, protect=False)
    assert (seen.measurements["front"].source == -1).all()
    assert (READINGS["front"].source == 0).all()


def test_linked_channel_and_switch_are_seen() -> None:
    links = ("channels.a", "switch")
    seen = observe(links, 1.0, {}, {"a": command()}, AUTHORITY, RUNNING, protect=False)
    assert set(seen.commands) == {"a"}
    assert seen.authority is AUTHORITY


def test_channel_that_has_not_commanded_is_seen_silent() -> None:
    seen = observe(("channels.a",), 0.0, {}, {}, None, RUNNING, protect=False)
    assert (seen.commands["a"].status == SILENT).all()
    assert (seen.commands["a"].stamp == -1.0).all()


def test_fan_that_is_there_for_pictures_is_not_seen() -> None:
    given = command()
    given.candidates, given.candidate_costs = np.zeros((2, 5, 3, 2)), np.zeros((2, 5))
    given.chosen = np.zeros(2, dtype=np.int64)
    for protect in (False, True):
        seen = observe(("channels.a",), 0.0, {}, {"a": given}, None, RUNNING, protect=protect)
        heard = seen.commands["a"]
        assert (heard.candidates, heard.candidate_costs, heard.chosen) == (None, None, None)
        assert heard.plan is not None


def test_protected_observation_cannot_alter_the_truth() -> None:
    links, given = ("front", "channels.a", "switch"), command()
    seen = observe(links, 1.0, READINGS, {"a": given}, AUTHORITY, RUNNING, protect=True)
    front, heard, authority = seen.measurements["front"], seen.commands["a"], seen.authority
    assert authority is not None
    shown: list[Any] = [front.detections, front.estimate, heard.acceleration, heard.plan]
    for array in (*shown, authority.channel, seen.running):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert not np.shares_memory(heard.acceleration, given.acceleration)


def test_linked_channels_are_listed_in_order() -> None:
    assert linked_channels(("front", "channels.b", "switch", "channels.a")) == ("b", "a")


def test_view_shows_what_is_behind_each_link_and_another_thing_instead() -> None:
    view = View(READINGS, {"a": command()}, AUTHORITY)
    assert view.shown("front", 2) is READINGS["front"]
    assert view.shown("channels.a", 2) is view.commands["a"]
    assert view.shown("switch", 2) is AUTHORITY
    silent = view.shown("channels.b", 2)
    assert isinstance(silent, ControlCommand)
    assert silent.status.tolist() == [SILENT] * 2
    other = measurement()
    changed = view.instead("front", other)
    assert changed.measurements["front"] is other
    assert changed.measurements["rear"] is READINGS["rear"]
    assert view.measurements["front"] is READINGS["front"]
    assert view.instead("switch", None).authority is None
    assert view.instead("channels.b", silent).commands["b"] is silent


def test_health_link_shows_stamp_and_validity_of_its_sensor_and_nothing_else() -> None:
    readings = {"front": measurement()}
    readings["front"].alive[1] = False
    seen = observe(("health.front",), 1.0, readings, {}, None, RUNNING, protect=False)
    assert set(seen.measurements) == {"health.front"}
    health = seen.measurements["health.front"]
    assert (health.stamp == readings["front"].stamp).all()
    assert health.alive.tolist() == [True, False]
    assert health.mask.size == health.detections.size == health.source.size == 0
    for name in ("estimate", "points", "hits", "values"):
        assert getattr(health, name) is None


def test_what_stands_for_a_health_link_leaves_the_sensor_itself_alone() -> None:
    view = View({"front": measurement()}, {}, None)
    late = view.shown("health.front", 2)
    assert isinstance(late, Measurement)
    other = late.copy()
    other.stamp[:] = 7.0
    changed = view.instead("health.front", other)
    links = ("front", "health.front")
    seen = observe(
        links, 1.0, changed.measurements, {}, None, RUNNING, protect=True, health=changed.health
    )
    assert (seen.measurements["health.front"].stamp == 7.0).all()
    assert (seen.measurements["front"].stamp == 0.0).all()
    assert changed.shown("health.front", 2) is other
