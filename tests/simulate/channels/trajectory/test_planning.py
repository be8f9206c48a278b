import numpy as np
import pytest

from adeye.kernel.profiles import (
    OBJECT_ROW,
    PATH_ROW,
    PATH_TARGET,
    PROFILE_ROW,
    PROFILE_SPEED,
    WAY_ROW,
)
from adeye.signals import Floats
from adeye.simulate.channels.trajectory.candidates import (
    CANDIDATES,
    KEEP,
    LEVEL_ROW,
    MEMORY_LANE,
    MEMORY_WANTED,
    PATHS,
    PROFILES,
)
from adeye.simulate.channels.trajectory.cost import LINE_ROW, SAMPLES
from adeye.simulate.channels.trajectory.planner import plan_step
from tests.simulate.channels.trajectory.record import LANE, memory, pose, record
from tests.simulate.channels.trajectory.test_obstacles import thing


class Plan:
    """One tick of the planner, and what it leaves behind."""

    def __init__(self, *items: tuple[Floats, Floats], shown: bool = True, **more: float) -> None:
        objects, ways = np.zeros((8, OBJECT_ROW)), np.zeros((8, SAMPLES, WAY_ROW))
        for row, (body, way) in enumerate(items):
            objects[row], ways[row] = body, way
        self.memory = memory()
        self.driven = np.zeros(PATH_ROW)
        self.driven[PATH_TARGET] = np.nan
        self.paths = np.zeros((PATHS, PATH_ROW))
        self.profiles = np.zeros((PROFILES + 1, SAMPLES, PROFILE_ROW))
        self.costs = np.zeros(CANDIDATES)
        self.best = plan_step(
            record(rear_sight=100.0, **more),
            pose(),
            30.0,
            len(items),
            objects,
            ways,
            self.memory,
            self.driven,
            self.paths,
            self.profiles,
            np.zeros((PROFILES + 1, 8, 2), dtype=np.int64),
            np.zeros((SAMPLES, LINE_ROW)),
            np.zeros((PROFILES + 1, LEVEL_ROW)),
            self.costs,
            shown,
        )

    @property
    def wanted(self) -> float:
        return float(self.memory[MEMORY_WANTED])


def test_free_road_is_driven_on() -> None:
    plan = Plan()
    assert plan.best == KEEP * PROFILES + 4
    assert plan.wanted == 0.0
    assert plan.driven[PATH_TARGET] == LANE


def test_chosen_candidate_is_the_cheapest_of_the_fan() -> None:
    plan = Plan(thing(60.0, LANE, 20.0))
    assert plan.best == int(np.argmin(plan.costs))
    assert np.isfinite(plan.costs).sum() > PROFILES


@pytest.mark.slow
@pytest.mark.parametrize("ahead", [20.0, 35.0, 50.0, 75.0, 120.0, 400.0])
@pytest.mark.parametrize("speed", [0.0, 15.0, 28.0])
def test_dropping_dear_candidates_early_never_drops_the_best(ahead: float, speed: float) -> None:
    scene = (thing(ahead, LANE, speed), thing(5.0, LANE + 3.5, 30.0), thing(-60.0, 1.75, 33.0))
    whole, quick = Plan(*scene), Plan(*scene, shown=False)
    assert whole.best == quick.best
    assert whole.wanted == quick.wanted
    assert whole.driven.tobytes() == quick.driven.tobytes()
    known = quick.costs < whole.costs[whole.best]
    assert not known.any()


def test_acceleration_is_refined_between_those_of_the_fan() -> None:
    wanted = [Plan(thing(gap, LANE, 25.0)).wanted for gap in (40.0, 45.0, 50.0, 55.0, 60.0)]
    assert wanted == sorted(wanted)
    assert len({round(value, 6) for value in wanted}) >= 4


def test_profile_of_the_choice_is_the_last_one() -> None:
    plan = Plan(thing(45.0, LANE, 20.0))
    last = plan.profiles[PROFILES, -1, PROFILE_SPEED]
    # The ramp of 25 m/s³ loses half of its own duration.
    ramp = abs(plan.wanted) / 25.0
    assert last == pytest.approx(30.0 + plan.wanted * (4.0 - 0.5 * ramp))


@pytest.mark.slow
def test_lane_that_is_changed_to_is_remembered() -> None:
    plan = Plan(thing(55.0, LANE, 0.0))
    assert plan.memory[MEMORY_LANE] in (LANE - 3.5, LANE + 3.5)
    assert plan.driven[PATH_TARGET] == plan.memory[MEMORY_LANE]
