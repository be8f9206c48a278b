"""The compiled traffic computes what highway-env computes, on all its kinds of roads."""

from typing import NamedTuple

import numpy as np
import pytest

from adeye.kernel.traffic import network as n
from adeye.kernel.traffic.network import ALONGSIDE
from benchmarks.support.crash import advance_crashing_fast, advance_crashing_reference
from benchmarks.support.highway_scenes import ROADS, Converted, convert, scene
from tests.simulate.traffic.parity import SLOWEST, Comparison, compare

SAME = 1e-9
"""Difference up to which two arithmetics of one model agree [m], [rad], [m/s]."""


class Plan(NamedTuple):
    """Scenes of one kind of road, and what makes them a trial.

    Attributes:
        counts: Scenes for each number of vehicles.
        steps: Compared at least.
        changes: Lane changes at least.
        contacts: Vehicles that touch something at least.
    """

    counts: dict[int, int]
    steps: int
    changes: int
    contacts: int


# 55 scenes.
PLANS = {
    "straight": Plan({2: 4, 3: 4, 5: 6, 8: 3, 12: 2, 20: 1, 50: 1}, 5000, 60, 5),
    "curved": Plan({2: 6, 3: 4, 5: 6, 12: 2, 20: 1}, 4000, 30, 6),
    "intersection": Plan({2: 8, 3: 4, 5: 6, 12: 2, 20: 1}, 4000, 0, 4),
}
# Of many vehicles, and of the two networks where they change lanes all the time.
LONG_PLANS = {
    "straight": Plan({5: 30, 20: 6, 35: 2, 50: 2}, 7500, 200, 10),
    "curved": Plan({5: 30, 20: 6, 35: 2, 50: 1}, 6000, 150, 20),
    "intersection": Plan({5: 40, 20: 4, 35: 1}, 5000, 0, 12),
}


def seed_of(vehicles: int, number: int) -> int:
    return 100 * vehicles + number


def check(kind: str, plan: Plan) -> None:
    """Compare all scenes of a plan, and see that they were worth it."""
    found = {
        (vehicles, seed_of(vehicles, number)): compare(
            scene(kind, seed_of(vehicles, number), vehicles)
        )
        for vehicles, count in plan.counts.items()
        for number in range(count)
    }
    assert {
        where: result.worst for where, result in found.items() if not result.worst <= SAME
    } == {}
    assert sum(result.steps for result in found.values()) >= plan.steps
    assert sum(result.changes for result in found.values()) >= plan.changes
    assert sum(result.crashed for result in found.values()) >= plan.contacts
    # Nobody is exactly on a centre line, where much would be exactly zero.
    assert max(result.turned for result in found.values()) > 0.2


@pytest.mark.slow
@pytest.mark.parametrize("kind", PLANS)
def test_reference_is_highway_env_to_a_billionth(kind: str) -> None:
    check(kind, PLANS[kind])


@pytest.mark.slow
@pytest.mark.parametrize("kind", LONG_PLANS)
def test_reference_is_highway_env_to_a_billionth_in_many_scenes(kind: str) -> None:
    check(kind, LONG_PLANS[kind])


def test_the_plans_are_fifty_scenes_of_two_to_fifty_vehicles() -> None:
    assert set(PLANS) == set(LONG_PLANS) == set(ROADS)
    assert sum(sum(plan.counts.values()) for plan in PLANS.values()) >= 50
    sizes = {vehicles for plan in PLANS.values() for vehicles in plan.counts}
    assert (min(sizes), max(sizes)) == (2, 50)


# --- teeth ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("column", [n.X, n.Y, n.HEADING, n.SPEED])
def test_a_billionth_at_the_start_is_seen(column: int) -> None:
    def disturb(ours: Converted) -> None:
        ours.vehicles[0, column] += 1e-9
        heading = ours.vehicles[0, n.HEADING]
        ours.vehicles[0, [n.SINUS, n.COSINE]] = np.sin(heading), np.cos(heading)

    assert compare(scene("straight", 4, 5), 3).worst < 1e-13
    assert 0.9e-9 < compare(scene("straight", 4, 5), 3, disturb=disturb).worst < 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("column", "by"),
    [
        (n.EXPONENT, 1e-6),
        (n.JAM_DISTANCE, 1e-6),
        (n.TIME_GAP, 1e-6),
        (n.GAIN, 1e-6),
        (n.BRAKING, 1e-5),
        (n.DESIRED_SPEED, 1e-6),
    ],
)
def test_a_millionth_of_a_driver_s_parameter_is_seen(column: int, by: float) -> None:
    def disturb(ours: Converted) -> None:
        ours.vehicles[:, column] += by

    undisturbed = compare(scene("straight", 503, 5))
    assert undisturbed.steps == 300
    assert undisturbed.worst <= SAME
    assert compare(scene("straight", 503, 5), disturb=disturb).worst > 100 * SAME


@pytest.mark.slow
def test_a_later_thought_of_changing_lanes_is_seen() -> None:
    def disturb(ours: Converted) -> None:
        ours.vehicles[:, n.TIMER] -= 0.5

    assert compare(scene("straight", 2000, 20)).changes > 0
    assert compare(scene("straight", 2000, 20), 150, disturb=disturb).worst > 1e-3


def test_a_wider_body_is_seen() -> None:
    def disturb(ours: Converted) -> None:
        ours.bodies[0][:, 1] += 0.5
        ours.bodies[0][:, 2] += 0.5

    plain = compare(scene("straight", 2, 5))
    assert plain.crashed > 0
    assert compare(scene("straight", 2, 5), disturb=disturb).worst > 1e-3


# --- the fast arithmetic --------------------------------------------------------------------------


def difference(kind: str, seed: int, vehicles: int) -> tuple[float, int, int]:
    """Return the worst difference of the two arithmetics, steps and contacts."""
    road = scene(kind, seed, vehicles)
    reference, fast = convert(road), convert(road)
    # Where it goes another way, it does.
    assert bool(fast.lanes[0, ALONGSIDE]) == (kind == "straight")
    worst, steps = 0.0, 0
    for _ in range(300):
        reference.advance(advance_crashing_reference)
        fast.advance(advance_crashing_fast)
        if (np.abs(reference.states[:, 3]) <= SLOWEST).any():
            break
        worst = max(worst, float(np.abs(reference.states - fast.states).max()))
        assert np.isfinite(worst)
        steps += 1
    return worst, steps, int(reference.marks[:, n.CRASHED].sum())


@pytest.mark.slow
@pytest.mark.parametrize("kind", ROADS)
def test_fast_is_the_reference_to_a_billionth(kind: str) -> None:
    # In none of these scenes a decision hangs on the last bits; where one does, both are right.
    counts = {2: 30, 5: 30, 12: 8, 20: 4, 50: 1}
    found = [
        difference(kind, 7000 + seed_of(vehicles, number), vehicles)
        for vehicles, count in counts.items()
        for number in range(count)
    ]
    assert max(worst for worst, _, _ in found) <= SAME
    # And it is another arithmetic.
    assert max(worst for worst, _, _ in found) > 0.0
    assert sum(steps for _, steps, _ in found) > 8000
    assert sum(contacts for _, _, contacts in found) > 5


@pytest.mark.slow
def test_fast_is_highway_env_to_a_billionth() -> None:
    found: list[Comparison] = [
        compare(scene(kind, seed, 5), kernel=advance_crashing_fast)
        for kind in ("straight", "curved", "intersection")
        for seed in range(6)
    ]
    assert max(result.worst for result in found) <= SAME
    assert sum(result.changes for result in found) > 5
