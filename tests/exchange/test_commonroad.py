"""CommonRoad: lanes, participants and the ego's way are those of the run."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.exchange.commonroad import NAMES, benchmark_of, write_commonroad
from adeye.exchange.view import Account, RunView
from adeye.signals import OBJECT_CLASSES
from adeye.trace import Trace
from tests.exchange.handed import in_left_hand_traffic, with_kinds
from tests.judge.conftest import HandMade

ACCOUNT = Account(run="ab" * 32, about={})


@pytest.fixture
def made() -> HandMade:
    """An ego that turns, one who drives and something that stands."""
    made = HandMade(rows=11, objects=("lead", "block")).ego(heading=0.3, steering_angle=0.04)
    return made.object("lead", size=(12.0, 2.5), heading=-0.2, d=1.75, acceleration=0.5)


def written(trace: Trace, folder: Path) -> tuple[ET.Element, ET.Element]:
    """Return the scenario and the solution."""
    write_commonroad(RunView(trace), ACCOUNT, folder)
    names = sorted(path.name for path in folder.iterdir())
    assert all(NAMES.fullmatch(name) for name in names)
    scenario, solution = (ET.parse(folder / name).getroot() for name in names)  # noqa: S314
    return scenario, solution


def number(element: ET.Element, path: str) -> float:
    return float(element.findtext(path, "nan"))


def points(element: ET.Element, path: str) -> Any:
    found = element.findall(f"{path}/point")
    return np.array([[number(point, "x"), number(point, "y")] for point in found])


def states(element: ET.Element) -> Any:
    parts = ("orientation", "velocity", "acceleration")
    found = [*element.findall("initialState"), *element.findall("trajectory/state")]
    assert [int(number(state, "time/exact")) for state in found] == list(range(len(found)))
    return np.array(
        [
            [
                *points(state, "position")[0],
                *(number(state, f"{part}/exact") for part in parts),
            ]
            for state in found
        ]
    )


def test_participants_move_as_recorded(made: HandMade, tmp_path: Path) -> None:
    barrier = OBJECT_CLASSES.index("building")
    trace = with_kinds(made.trace(), OBJECT_CLASSES.index("truck"), barrier, actors=1)
    scenario, _ = written(trace, tmp_path)
    assert float(scenario.get("timeStepSize", "")) == trace.layout.context.step
    (lead,) = scenario.findall("dynamicObstacle")
    assert lead.findtext("type") == "truck"
    size = [number(lead, f"shape/rectangle/{side}") for side in ("length", "width")]
    assert size == [12.0, 2.5]
    np.testing.assert_array_equal(states(lead), trace["objects"][0, :, 0])
    (block,) = scenario.findall("staticObstacle")
    assert block.findtext("type") == "building"
    ids = [element.get("id") for element in scenario if element.get("id")]
    assert len(ids) == len(set(ids)) == 3 + 2 + 1


def test_solution_is_the_way_of_the_rear_axle(made: HandMade, tmp_path: Path) -> None:
    trace = made.trace()
    scenario, solution = written(trace, tmp_path)
    problem = scenario.find("planningProblem")
    driven = solution.find("ksTrajectory")
    assert problem is not None
    assert driven is not None
    assert driven.get("planningProblem") == problem.get("id")
    assert solution.get("benchmark_id") == f"KS2:SM1:{scenario.get('benchmarkID')}:2020a"
    names = ("x", "y", "orientation", "velocity", "steeringAngle")
    found = np.array([[number(state, name) for name in names] for state in driven])
    wanted = trace["ego"][0][:, [0, 1, 2, 3, 5]].copy()
    half = 0.5 * trace.layout.architecture.vehicle.wheelbase
    wanted[:, :2] -= half * np.array([np.cos(0.3), np.sin(0.3)])
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(points(problem, "initialState/position")[0], wanted[0, :2])
    assert number(problem, "goalState/time/intervalEnd") == len(made.time) - 1


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_lanes_have_left_on_their_left_and_know_each_other(
    made: HandMade, tmp_path: Path, side: float
) -> None:
    trace = made.trace() if side > 0.0 else in_left_hand_traffic(made.trace())
    scenario, _ = written(trace, tmp_path)
    lanes = {lane.get("id"): lane for lane in scenario.findall("lanelet")}
    assert len(lanes) == 3
    for lane in lanes.values():
        left, right = points(lane, "leftBound"), points(lane, "rightBound")
        assert (left[:, 1] - right[:, 1]).tolist() == pytest.approx([3.5] * len(left))
        for beside in lane.findall("adjacentLeft"):
            assert beside.get("drivingDir") == "same"
            other = lanes[beside.get("ref")]
            np.testing.assert_array_equal(points(other, "rightBound"), left)
    assert sum(len(lane.findall("adjacentLeft")) for lane in lanes.values()) == 2


@pytest.mark.parametrize("kind", OBJECT_CLASSES)
def test_every_kind_has_a_word_but_barriers(made: HandMade, tmp_path: Path, kind: str) -> None:
    index = OBJECT_CLASSES.index(kind)
    scenario, _ = written(with_kinds(made.trace(), index, index, actors=1), tmp_path)
    words = {element.findtext("type") for element in scenario if element.find("shape") is not None}
    assert (words == {"unknown"}) == (kind == "barrier")


def test_same_run_gives_the_same_bytes(made: HandMade, tmp_path: Path) -> None:
    assert re.fullmatch(r"ZAM_\w+-1_1_T-1", benchmark_of(ACCOUNT))
    texts = []
    for name in "ab":
        (tmp_path / name).mkdir()
        written(made.trace(), tmp_path / name)
        texts.append([path.read_bytes() for path in sorted((tmp_path / name).iterdir())])
    assert texts[0] == texts[1]
