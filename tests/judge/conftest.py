"""Recorded runs made by hand: what a test says about ego, objects and decisions is in the trace."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np
import pytest

from adeye.judge.evaluate import Evaluation, evaluate_trace
from adeye.judge.metrics import METRICS
from adeye.judge.requirements import CheckedRequirement
from adeye.judge.safe_stop import achieved_rating, best_rating, rules_of
from adeye.judge.trace_signals import TraceSignals
from adeye.judge.uncertainty import NumericUncertainty
from adeye.signals import RoadMap, SceneContext, Surroundings
from adeye.spec.architecture import Architecture
from adeye.spec.concept import Requirement
from adeye.spec.odd import Attributes
from adeye.spec.scenario import LogicalScenario
from adeye.trace import ChannelEvent, Layout, Trace
from tests.stored import stored

ARCHITECTURE: dict[str, Any] = stored("two_channels")


class HandMade:
    """Runs on a straight road of three lanes of 3.5 m with a shoulder of 2 m.

    The ego (4 m by 2 m) drives in the middle lane at 20 m/s, and so does every object of the same
    size, 40 m ahead of it from bumper to bumper. Nothing fails and nothing is detected.
    """

    def __init__(  # noqa: PLR0913 - what a test may say about its runs
        self,
        *,
        rows: int = 21,
        runs: int = 1,
        objects: tuple[str, ...] = ("lead",),
        step: float = 0.1,
        tail_rows: int = 5,
        events: tuple[str, ...] = (),
        faults: tuple[str, ...] | None = None,
    ) -> None:
        """Without faults of its own a run has ``camera_out``, if a test lets it act."""
        self.has_own_faults = faults is not None
        faults = ("camera_out",) if faults is None else faults
        self.rows, self.runs, self.step = rows, runs, step
        self.objects, self.events, self.faults = objects, events, faults
        self.horizon_rows = rows - 1 - tail_rows
        self.tail_rows = tail_rows
        self.realised = events
        self.time: Any = np.arange(rows) * step
        self.length = np.full(runs, rows)
        self.horizon_row = np.full(runs, self.horizon_rows)
        self.complete = np.ones(runs, dtype=np.bool_)
        self.sizes = np.tile([4.0, 2.0, 1.5], (runs, len(objects), 1))
        self.channel_events: list[ChannelEvent | None] = [None] * runs
        shape, many = (runs, rows), len(objects)

        def flags(*axes: int) -> np.ndarray:
            return np.zeros((*shape, *axes), dtype=np.bool_)

        self.columns: dict[str, Any] = {
            "ego": np.zeros((*shape, 7)),
            "ego_place": np.zeros((*shape, 6)),
            "objects": np.zeros((*shape, many, 5)),
            "object_places": np.zeros((*shape, many, 6)),
            "begun": np.full((*shape, len(events)), np.nan),
            "contact": np.full(shape, -1, dtype=np.int16),
            "impact_speed": np.zeros(shape),
            "foreign_contact": flags(),
            "sensor_stamp": np.broadcast_to(self.time[:, None], (*shape, 2)).copy(),
            "sensor_alive": ~flags(2),
            "detected": flags(2, many),
            "detections": np.zeros((*shape, 2, many, 2)),
            "points": np.zeros((*shape, 0, 0, 2), dtype=np.float32),
            "acceleration": np.zeros((*shape, 2)),
            "steering_angle": np.zeros((*shape, 2)),
            "stamp": np.broadcast_to(self.time[:, None], (*shape, 2)).copy(),
            "status": np.zeros((*shape, 2), dtype=np.int8),
            "monitors": flags(1, 2),
            "tracks": np.full((*shape, 2, 8, 6), np.nan),
            "track_error": np.full((*shape, 2, many, 2), np.nan),
            "false_tracks": np.zeros((*shape, 2), dtype=np.int8),
            "candidates": np.zeros((*shape, 2, 0, 0, 2), dtype=np.float32),
            "candidate_costs": np.zeros((*shape, 2, 0), dtype=np.float32),
            "chosen": np.full((*shape, 2), -1, dtype=np.int16),
            "authority": np.zeros(shape, dtype=np.int8),
            "reason": np.ones(shape, dtype=np.int8),
            "command": np.zeros((*shape, 2)),
            "fault_active": flags(len(faults)),
        }
        self.ego(speed=20.0, s=20.0 * self.time)
        for name in objects:
            self.object(name, speed=20.0, s=44.0 + 20.0 * self.time)

    def ego(self, run: int | slice = slice(None), **motion: Any) -> Self:
        """Set s, d, speed, heading, acceleration or steering_angle of the ego, all rows or one."""
        self._move(self.columns["ego"], self.columns["ego_place"], run, motion)
        return self

    def object(self, name: str, run: int | slice = slice(None), **motion: Any) -> Self:
        """Set s, d, speed, heading, acceleration, or size (length, width) of an object."""
        index = self.objects.index(name)
        if "size" in motion:
            self.sizes[run, index, :2] = motion.pop("size")
        states, places = self.columns["objects"], self.columns["object_places"]
        self._move(states[:, :, index], places[:, :, index], run, motion)
        return self

    def _move(self, state: Any, place: Any, run: int | slice, motion: dict[str, Any]) -> None:
        columns = {"speed": 3, "heading": 2, "acceleration": 4, "steering_angle": 5}
        for what, value in motion.items():
            if what == "s":
                state[run, :, 0] = place[run, :, 0] = value
            elif what != "d":
                state[run, :, columns[what]] = value
        d = motion.get("d", 5.25 if not place[..., 1].any() else place[run, :, 1])
        state[run, :, 1] = place[run, :, 1] = d
        lanes = np.floor(place[..., 1] / 3.5)
        place[..., 4] = np.where((lanes >= 0) & (lanes < 3), lanes, -1)
        place[..., 5] = place[..., 1] - (np.clip(lanes, 0, 2) + 0.5) * 3.5

    def set(self, column: str, value: Any, *, rows: Any = slice(None), at: Any = None) -> Self:
        """Set a column, of all runs, at some rows and, if given, one index of its next axis."""
        target = self.columns[column]
        if at is None:
            target[:, rows] = value
        else:
            target[:, rows, at] = value
        return self

    def touch(self, row: int, name: str, *, speed: float = 3.0, run: int = 0) -> Self:
        """End a run at a row by contact with an object."""
        self.columns["contact"][run, row] = self.objects.index(name)
        self.columns["impact_speed"][run, row] = speed
        self.length[run] = row + 1
        self.horizon_row[run] = min(self.horizon_row[run], row)
        self.complete[run] = False
        return self

    def trace(self) -> Trace:
        runs, segments = self.runs, np.zeros((self.runs, 1, 5))
        if not self.has_own_faults and not self.columns["fault_active"].any():
            # A fault that is planned and never acts leaves a run untested.
            self.faults, self.columns["fault_active"] = (), np.zeros((runs, self.rows, 0), np.bool_)
        segments[:, :, 3] = 10_000.0
        column = np.ones(runs)
        context = SceneContext(
            step=self.step,
            object_ids=self.objects,
            object_classes=np.zeros(len(self.objects), dtype=np.int64),
            actor_count=len(self.objects),
            object_sizes=self.sizes,
            object_reflectivity=np.full(self.sizes.shape[:2], 0.3),
            ego_size=np.tile([4.0, 2.0, 1.5], (runs, 1)),
            road=RoadMap(
                segments,
                3.5 * column,
                3,
                2.0 * column,
                36.0 * column,
                0.0 * column,
                np.zeros((runs, 0, 5)),
                segments[:, 0, 3],
            ),
            surroundings=Surroundings.clear(runs),
            stream_seeds=np.zeros(runs, dtype=np.uint64),
            event_ids=self.events,
        )
        layout = Layout(
            scenario="follow",
            architecture=Architecture.model_validate(ARCHITECTURE),
            architectures=(Architecture.model_validate(ARCHITECTURE),) * runs,
            sensors=("camera", "truth"),
            channels=("nominal", "safety"),
            monitors=("danger",),
            faults=self.faults,
            context=context,
            horizon=self.horizon_rows * self.step,
            tail=self.tail_rows * self.step,
            realised=self.realised,
        )
        return Trace(
            layout=layout,
            time=self.time,
            length=self.length,
            horizon_row=self.horizon_row,
            complete=self.complete,
            columns=self.columns,
            channel_events=tuple(self.channel_events),
            case_digests=tuple(str(run) for run in range(runs)),
        )


def measure(made: HandMade, column: str) -> Any:
    """Measure a metric of the first run: value, status, time and actor."""
    found = METRICS[column].compute(made.trace())
    return float(found.value[0]), found.status[0], float(found.time[0]), int(found.actor[0])


def judge(
    trace: Trace,
    requirements: Sequence[CheckedRequirement],
    inside_odd: np.ndarray,
    attributes: Attributes | None = None,
    *,
    faults: Sequence[str] = (),
    uncertainty: Mapping[str, NumericUncertainty] = MappingProxyType({}),
) -> Evaluation:
    """Judge FSRs on the runs of a trace."""
    signals = TraceSignals(trace, inside_odd, attributes, faults)
    return evaluate_trace(signals, requirements, uncertainty)


def fsr(**item: Any) -> Requirement:
    """Write an FSR of what a test says about it."""
    shared = {
        "id": "FSR-01",
        "goals": ["SG"],
        "text": "t",
        "threshold_source": "s",
        "asil": "QM",
        "allocation": ["e"],
    }
    return Requirement.model_validate({**shared, **item})


class StopQuality(NamedTuple):
    """Rating of where a run stands, the best that was reachable at its fault, their difference."""

    achieved: float
    best: float
    regret: float


def rate_run(trace: Trace, run: int) -> StopQuality:
    """Rate where a run stands by its own architecture; NaN for what there is not."""
    rules = rules_of(trace.layout.architectures[run])
    achieved = achieved_rating(trace, run, rules)
    active = trace["fault_active"][run, : trace.length[run]].any(axis=-1)
    best = best_rating(trace, run, int(np.argmax(active)), rules) if active.any() else np.nan
    return StopQuality(achieved, best, achieved - best)


@pytest.fixture
def hand_made() -> type[HandMade]:
    """Runs to be made by hand."""
    return HandMade


@pytest.fixture
def architecture() -> Callable[..., Architecture]:
    """The architecture of the hand-made runs, or one with other parts."""

    def make(**changes: Any) -> Architecture:
        return Architecture.model_validate({**ARCHITECTURE, **changes})

    return make


@pytest.fixture
def scenario() -> Callable[..., LogicalScenario]:
    """The scenario of the hand-made runs: follow a lead; horizon 1.5 s, tail 0.5 s."""

    def make(*actors: str, horizon: str = "1.5 s", tail: str = "0.5 s") -> LogicalScenario:
        content = stored("follow")
        lead = content["actors"]["lead"]
        changed: dict[str, Any] = {"horizon": horizon, "tail": tail}
        if actors:
            changed["actors"] = dict.fromkeys(actors, lead)
        return LogicalScenario.model_validate({**content, **changed})

    return make
