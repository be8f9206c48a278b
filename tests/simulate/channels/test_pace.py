"""Pace: no tick begins before its time, late ones are counted, and nothing else changes."""

import math

import numpy as np
import pytest

from adeye.campaign.run import Session, run_campaign
from adeye.campaign.work import has_clock
from adeye.errors import UsageError
from adeye.signals import Observation
from adeye.simulate import engine
from adeye.simulate.channels import pace as module
from adeye.simulate.channels.pace import Pace
from adeye.spec.architecture import Architecture
from adeye.testing import ScriptedChannel, channel_context
from tests.conftest import MakeProject
from tests.motorway import ARCHITECTURE, cut_ins
from tests.refusals import refused


class Clock:
    """A clock that goes on when somebody sleeps or works."""

    def __init__(self) -> None:
        self.now = 100.0
        self.slept: list[float] = []

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(module, "time", made)
    return made


def work(clock: Clock, pace: Pace, *seconds: float) -> list[float]:
    """Do ticks of 50 ms that take so long; return when each began."""
    began = []
    for tick, taken in enumerate(seconds):
        pace.hold(0.05 * tick)
        began.append(clock.now - 100.0)
        clock.now += taken
    pace.hold(0.05 * len(seconds))
    return began


@pytest.mark.parametrize("factor", [0.5, 1.0, 10.0])
def test_no_tick_begins_before_its_time(clock: Clock, factor: float) -> None:
    pace = Pace(factor)
    began = work(clock, pace, *[0.001] * 5)
    assert began == pytest.approx([0.05 * tick / factor for tick in range(5)])
    assert (pace.ticks, pace.overruns, pace.latest_s) == (5, 0, 0.0)


def test_late_tick_is_counted_and_made_up_for(clock: Clock) -> None:
    pace = Pace(1.0)
    began = work(clock, pace, 0.01, 0.12, 0.01, 0.01, 0.01)
    # The second is 70 ms late, the next one 30; the one after it is early again.
    assert began == pytest.approx([0.0, 0.05, 0.17, 0.18, 0.2])
    assert pace.overruns == 2
    assert pace.latest_s == pytest.approx(0.07)


def test_each_run_begins_anew(clock: Clock) -> None:
    pace = Pace(1.0)
    work(clock, pace, 0.0, 0.0)
    clock.now += 60.0
    assert work(clock, pace, 0.0, 0.0) == pytest.approx([60.1, 60.15])
    assert (pace.ticks, pace.overruns) == (4, 0)


def test_answers_are_told_by_median_most_and_worst(clock: Clock) -> None:
    times = iter([0.001 * number for number in range(1, 101)])

    class Slow(ScriptedChannel):
        def act(self, observation: Observation):  # type: ignore[no-untyped-def]
            clock.now += next(times)
            return super().act(observation)

    pace = Pace(1.0)
    channel = pace.timed("slow", Slow([1.0]))
    pace.timed("idle", ScriptedChannel([0.0]))
    channel.reset(channel_context(None, links=(), sensors={}))
    for _ in range(100):
        channel.act(Observation(0.0, {}, {}, None, np.ones(1, dtype=np.bool_)))
    (found,) = pace.answers.values()
    assert found.asked == 100
    assert (found.median_s, found.p99_s, found.worst_s) == pytest.approx(
        (0.051, 0.1, 0.1), abs=1.1e-3
    )
    assert found.median_s <= found.p99_s <= found.worst_s


@pytest.mark.parametrize("factor", [0.0, -1.0, math.nan, math.inf])
def test_pace_is_a_number_above_zero(factor: float) -> None:
    refused(UsageError, Pace, factor, says="the pace is")


def test_bits_are_the_same_at_a_pace(make_project: MakeProject) -> None:
    project = make_project(cut_ins("paced", "30 m", "50 m"))
    plan = project.plan()
    pace = Pace(1000.0)
    free = engine.run(plan.cases, base_dirs=plan.folders)
    paced = engine.run(plan.cases, base_dirs=plan.folders, pace=pace)
    assert paced.digests() == free.digests()
    assert pace.ticks == max(free.length) - 1
    assert set(pace.answers) == {"nominal", "safety"}


@pytest.mark.slow
def test_campaign_at_a_pace_executes_one_run_at_a_time_and_marks_foreign_ones(
    make_project: MakeProject,
) -> None:
    project = make_project(cut_ins("paced", "30 m", "50 m"))
    project.run(db="free.db")
    pace = Pace(1000.0)
    run_campaign(project.plan(), db=project.db, session=Session(pace=pace))
    rows, free = project.rows(), project.rows(db="free.db")
    assert [row["trace_digest"] for row in rows] == [row["trace_digest"] for row in free]
    # Built-in channels look at no clock.
    assert {row["machine_dependent"] for row in rows} == {0}
    # The two runs are not asked together, so each has ticks of its own.
    assert pace.ticks == sum(round(row["duration_s"] / 0.05) for row in rows)


@pytest.mark.parametrize("paced", [0, 1])
@pytest.mark.parametrize("kind", ["./mine.py:Mine", "nominal"])
def test_only_what_is_from_outside_may_look_at_a_clock(kind: str, paced: int) -> None:
    content = dict(ARCHITECTURE)
    content["channels"] = {
        name: {"kind": kind, "links": item["links"]}
        for name, item in ARCHITECTURE["channels"].items()
    }
    architecture = Architecture.model_validate(content)
    assert has_clock(architecture, paced=bool(paced)) == (kind != "nominal" and paced == 1)
