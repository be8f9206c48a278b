"""The safety channel shares no state with the nominal one: its stop is the same without that."""

from collections.abc import Iterator
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, Final

import numpy as np
import pytest

from adeye.signals import EGO_SPEED, ControlCommand, RoadMap, Scene
from adeye.simulate import engine
from adeye.simulate.channels.rack import ChannelRack
from adeye.trace import Trace
from tests.motorway import fault
from tests.project import CANDIDATE, CONCEPT, MINI, Project

STEP: Final = 0.05
ONSET: Final = 60
"""Tick at which the nominal channel dies: 3 s."""
KILLED: Final = fault("killed", "channels.nominal", "crash", "3 s")

STOPS: Final[dict[str, dict[str, Any]]] = {
    "in_lane": {},
    "planned": {"stop": "planned"},
    "supervised": {
        "stop": "planned",
        "supervisor": {
            "monitors": {
                "silent": {"kind": "channel_silent", "watches": ["nominal"]},
                "last": {"kind": "last_safe_stop"},
            }
        },
    },
}

PLAYBACK = '''
"""Gives the commands that another channel gave, and may not be asked after the last of them."""

from adeye.ports import ScalarCommand

GIVEN = {given}


class Playback:
    def __init__(self, parameters, context):
        self.tick = -1

    def act(self, observation):
        self.tick += 1
        return ScalarCommand(*GIVEN[self.tick])
'''


def project(folder: Path, road: str, stop: str) -> Project:
    """Make a project whose nominal channel dies, on a kind of road."""
    odd = {
        **MINI,
        "scenarios": [{"use": "cut_in", "faults": ["killed"]}],
        "faults": [KILLED],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    made = Project(folder / "project", odd)
    with made.edited(CONCEPT) as concept:
        concept["requirements"] = concept["requirements"][:1]
    with made.edited("scenarios_db/motorway/cut_in.yaml") as scenario:
        if road == "curved":
            scenario["world"]["road"].update(kind="curve", radius="900 m")
    with made.edited(CANDIDATE) as candidate:
        candidate["channels"]["safety"]["parameters"] = STOPS[stop]
    return made


def drive(made: Project, **more: Any) -> Trace:
    """Execute the test case with the fault."""
    plan = made.plan()
    case = next(case for case in plan.cases if case.fault_entry == "killed")
    return engine.run([case], base_dirs=plan.folders, **more)


def assert_same_stop(one: Trace, other: Trace) -> None:
    """What the ego does, who acts, and all that the safety channel says has the same bits."""
    assert one.length[0] == other.length[0]
    rows = slice(int(one.length[0]) - 1)
    for name in ("ego", "command", "authority", "reason", "contact"):
        assert one[name][0, rows].tobytes() == other[name][0, rows].tobytes(), name
    channels = [trace.layout.channels.index("safety") for trace in (one, other)]
    for name in ("acceleration", "steering_angle", "stamp", "status"):
        first, second = (
            np.ascontiguousarray(trace[name][0, rows, at])
            for trace, at in zip((one, other), channels, strict=True)
        )
        assert first.tobytes() == second.tobytes(), name
    assert one.layout.monitors == other.layout.monitors
    assert one["monitors"][0, rows].tobytes() == other["monitors"][0, rows].tobytes()
    # And a stop it is.
    assert one["authority"][0, rows][-1] == channels[0]
    assert one["ego"][0, rows][-1, EGO_SPEED] == 0.0
    assert (one["contact"][0, rows] < 0).all()


CASES: Final = [(road, stop) for road in ("straight", "curved") for stop in STOPS]


@pytest.mark.slow
@pytest.mark.parametrize(("road", "stop"), CASES)
def test_stop_is_the_same_without_the_nominal_side(road: str, stop: str, tmp_path: Path) -> None:
    """Up to the fault the commands are played back, so the situation is the same; then nothing."""
    whole = drive(project(tmp_path / "whole", road, stop))
    made = project(tmp_path / "without", road, stop)
    # A command acts a tick after its observation, by the delay of the channel.
    given = [
        (
            float(whole["acceleration"][0, row, 0]),
            float(whole["steering_angle"][0, row, 0]),
            int(whole["status"][0, row, 0]),
        )
        for row in range(1, ONSET)
    ]
    source = PLAYBACK.replace("{given}", repr(given))
    (made.folder / "odd" / "architectures" / "playback.py").write_text(source, "utf-8")
    with made.edited(CANDIDATE) as candidate:
        candidate["sensors"] = {"truth": candidate["sensors"]["truth"]}
        candidate["channels"]["nominal"].update(kind="./playback.py:Playback", links=[])
    without = drive(made)
    assert without.layout.sensors == ("truth",)
    event = without.channel_events[0]
    # There is nothing left to ask: from the tick of the fault's first missing command on it fails.
    assert event is not None
    assert (event.channel, round(event.time / STEP)) == ("nominal", ONSET - 1)
    assert_same_stop(whole, without)


class Kept(ChannelRack):
    """A rack that tests can look into."""

    last: "Kept"

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.road: RoadMap = args[1].road
        Kept.last = self

    def act(self, scene: Scene, *args: Any) -> list[ControlCommand]:
        self.running = scene.running
        return super().act(scene, *args)

    def arrays_of(self, channel: str) -> list[Any]:
        """All arrays that a channel keeps, but for the map and who runs, which all are given."""
        given = [self.road.segments, self.running]
        return [
            thing
            for thing in reachable(self.channels[channel])
            if isinstance(thing, np.ndarray)
            and thing.size
            and not any(np.shares_memory(thing, part) for part in given)
        ]


def reachable(start: object) -> Iterator[object]:
    """Walk all objects that can be reached through attributes, items and arrays' owners."""
    seen: set[int] = set()
    waiting = [start]
    while waiting:
        thing = waiting.pop()
        if id(thing) in seen or isinstance(thing, (type, ModuleType, FunctionType)):
            continue
        seen.add(id(thing))
        yield thing
        if isinstance(thing, dict):
            waiting += [*thing.keys(), *thing.values()]
        elif isinstance(thing, (list, tuple, set, frozenset)):
            waiting += list(thing)
        elif isinstance(thing, np.ndarray):
            waiting += [] if thing.base is None else [thing.base]
        else:
            waiting += [getattr(thing, "__dict__", None)]
            for part in type(thing).__mro__:
                slots = part.__dict__.get("__slots__", ())
                names = (slots,) if isinstance(slots, str) else slots
                waiting += [getattr(thing, name, None) for name in names]


@pytest.mark.slow
@pytest.mark.parametrize(("road", "stop"), CASES)
def test_scribbling_over_all_that_the_nominal_channel_keeps_changes_no_bit(
    road: str, stop: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = project(tmp_path, road, stop)
    whole = drive(made)
    monkeypatch.setattr(engine, "ChannelRack", Kept)
    ticks: list[int] = []
    scribbled: list[int] = []

    def scribble(_ended: int) -> None:
        ticks.append(len(ticks))
        if len(ticks) < ONSET:
            return
        for array in Kept.last.arrays_of("nominal"):
            if array.flags.writeable and array.dtype == np.float64:
                array[...] = np.nan
                scribbled.append(array.size)

    poisoned = drive(made, on_tick=scribble)
    assert sum(scribbled) > 10_000
    assert_same_stop(whole, poisoned)


@pytest.mark.parametrize("stop", STOPS)
def test_no_array_and_no_container_belongs_to_both_channels(
    stop: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "ChannelRack", Kept)
    drive(project(tmp_path, "straight", stop), most_ticks=40)
    rack = Kept.last
    nominal, safety = rack.arrays_of("nominal"), rack.arrays_of("safety")
    assert min(len(nominal), len(safety)) > 20
    assert not any(np.shares_memory(one, other) for one in nominal for other in safety)
    own = {id(thing) for thing in reachable(rack.channels["nominal"])}
    for thing in reachable(rack.channels["safety"]):
        assert id(thing) not in own or not isinstance(thing, (dict, list, set))
