"""Candidates of a comparison: which are on the front, which one to choose, and why."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from adeye.judge.verdict import Verdict
from adeye.report.comparison.candidates import Matching, cost_of, extra_sensor, measuring, suite_of
from adeye.report.comparison.compare import compare
from adeye.report.comparison.records import CompareOptions, Comparison
from adeye.store.read.bulk import Labels, encode_points
from adeye.store.repository import Repository
from tests.project import Executed
from tests.stored import known


def compared(executed: Executed, **options: Any) -> Comparison:
    with Repository.open(executed.db, create=False) as repository:
        campaign = repository.find_campaign(executed.summary.campaign)
        return compare(repository, campaign, CompareOptions(**options))


@pytest.fixture(scope="module")
def everything(suites: Executed) -> Comparison:
    return compared(suites)


def test_unmet_requirement_tells_where_it_fails(everything: Comparison) -> None:
    for candidate in everything.candidates:
        for unmet in candidate.unmet:
            if unmet.verdict is Verdict.FAIL:
                assert unmet.failing, (candidate.id, unmet.fsr)
                assert max(unmet.failing.values()) <= candidate.failing


def test_leave_one_out_is_found_in_the_campaign(everything: Comparison) -> None:
    found = {(item.sensor, item.with_it, item.without_it) for item in everything.contributions}
    assert ("front_radar", "camera_radar", "no_radar") in found
    assert ("spare_camera", "spare", "camera_radar") in found
    assert not any("legacy_camera" in item for item in found)
    for item in everything.contributions:
        if item.sensor == "spare_camera":
            assert (item.rescued, item.harmed, item.cost) == (0, 0, 40.0)


def test_dearer_copy_is_dominated_by_the_original(suites: Executed) -> None:
    everything = compared(suites, architectures=("camera_radar", "twin", "spare"))
    original, twin = everything.candidate("camera_radar"), everything.candidate("twin")
    assert (twin.failing, twin.availability) == (original.failing, original.availability)
    assert twin.cost is not None
    assert (original.is_on_front, twin.is_on_front, twin.dominated_by) == (
        True, False, "camera_radar",
    )  # fmt: skip
    assert everything.candidate("spare").dominated_by == "camera_radar"


def test_epsilon_takes_a_small_advantage_away(suites: Executed) -> None:
    names, objectives = ("camera_radar", "legacy_camera"), ("cost", "failures")
    exact = compared(suites, architectures=names, objectives=objectives)
    assert exact.candidate("camera_radar").is_on_front
    epsilon = {"failures": 1000.0}
    rough = compared(suites, architectures=names, objectives=objectives, epsilon=epsilon)
    assert rough.candidate("camera_radar").dominated_by == "legacy_camera"


def test_objectives_are_those_asked_for_and_known(suites: Executed) -> None:
    names = ("camera_radar", "twin", "no_radar")
    found = compared(suites, architectures=names, objectives=("margin", "cost"))
    assert [item.name for item in found.objectives] == ["margin", "cost"]
    for item in found.candidates:
        assert item.values["margin"] == item.worst_margin
    # The margin of a violation without a number is not known.
    found = compared(suites, objectives=("margin", "cost"))
    assert found.left_out == ("margin: not known for legacy_camera",)


def test_objective_that_is_not_known_for_all_is_left_out_and_said(suites: Executed) -> None:
    with Repository.open(suites.db, create=False) as repository:
        campaign = repository.find_campaign(suites.summary.campaign)
        odd = repository.content("odd", campaign.odd_digest)
        for part in odd["architectures"]["twin"]["sensors"].values():
            part["cost"] = 0.0
        odd["architectures"]["twin"]["cost"] = 0.0

        class Priceless:
            """The same database, and nobody says what the twin costs."""

            def __getattr__(self, name: str) -> Any:
                return getattr(repository, name)

            def content(self, *_: str) -> Any:
                return odd

        found = compare(Priceless(), campaign)  # type: ignore[arg-type]
    assert found.left_out == ("cost: not known for twin",)
    assert found.candidate("twin").cost is None


def test_cheapest_passes_every_mandatory_fsr(everything: Comparison) -> None:
    for name in everything.cheapest:
        item = everything.candidate(name)
        assert item.mandatory > 0
        assert item.unmet == ()
    met = [item for item in everything.candidates if not item.unmet]
    assert bool(met) == bool(everything.cheapest)


def test_unmet_fsrs_are_those_of_the_gate(suites: Executed, everything: Comparison) -> None:
    with Repository.open(suites.db, create=False) as repository:
        gate = repository.gate(suites.summary.campaign)
    for candidate in everything.candidates:
        own = [item for item in gate if item.architecture == candidate.id]
        assert candidate.mandatory == len(own) > 0
        assert {(item.fsr, item.verdict) for item in candidate.unmet} == {
            (item.fsr, item.verdict) for item in own if item.verdict is not Verdict.PASS
        }


def test_sightings_add_up(everything: Comparison) -> None:
    by_name = {(item.architecture, item.sensor): item for item in everything.sightings}
    assert ("spare", "spare_camera") not in by_name
    for name in ("camera_radar", "twin", "spare"):
        camera, radar = by_name[name, "front_camera"], by_name[name, "front_radar"]
        assert camera.runs == radar.runs > 0
        assert camera.shared == radar.shared
        assert camera.first + radar.first + camera.shared <= camera.runs
    alone = by_name["no_radar", "front_camera"]
    assert (alone.first, alone.shared, alone.only) == (alone.runs - alone.never, 0, alone.first)
    assert alone.lead_s is None


def test_first_sighting_is_the_time_of_the_detection_metric(suites: Executed) -> None:
    with Repository.open(suites.db, create=False) as repository:
        found = repository.compared(suites.summary.campaign, ("camera_radar",))
        times = []
        for digest in found.result:
            stored = known(repository.run_row(digest))
            metric = stored.metrics["first_detection_distance_m"]
            is_seen = metric.status == "value" and metric.value != 0.0
            times.append(metric.time_s if is_seen and metric.time_s is not None else np.nan)
    earliest = np.where(np.isfinite(found.seen_s), found.seen_s, np.inf).min(axis=1)
    assert np.isfinite(times).any()
    assert np.array_equal(np.where(np.isinf(earliest), np.nan, earliest), times, equal_nan=True)


def priced(declared: float, **parts: float) -> dict[str, Any]:
    sensors = {name: {"cost": cost} for name, cost in parts.items()}
    return {"cost": declared, "sensors": sensors, "channels": {"nominal": {"cost": 0.0}}}


def test_declared_cost_is_the_total_where_it_covers_the_parts() -> None:
    cost = known(cost_of(priced(300.0, camera=120.0, radar=90.0)))
    assert (cost.total, cost.declared) == (300.0, 300.0)
    assert cost.parts == {"sensors.camera": 120.0, "sensors.radar": 90.0}
    # Parts that cost more are the total, and what declares no cost is not free.
    assert known(cost_of(priced(100.0, camera=120.0))).total == 120.0
    assert cost_of(priced(0.0, camera=0.0)) is None


def test_sensors_that_measure_and_feed_a_channel() -> None:
    kinds = {"camera": "camera", "spare": "camera", "truth": "ground_truth"}
    sensors = {name: {"kind": kind} for name, kind in kinds.items()}
    sensors["place"] = {"kind": "localisation"}
    links = ["camera", "place", "truth", "switch"]
    content = {"sensors": sensors, "channels": {"nominal": {"links": links}}}
    assert measuring(content) == ["camera"]
    assert suite_of(content) == {"camera": 1}


def parts(*sensors: str, rate: float = 20.0) -> dict[str, Any]:
    return {
        "vehicle": {"length": 4.9},
        "sensors": {name: {"rate": rate} for name in sensors},
        "channels": {"nominal": {"links": list(sensors)}},
    }


def test_sensor_that_one_has_more_is_named_and_only_if_all_else_is_equal() -> None:
    assert extra_sensor(parts("camera", "radar"), parts("camera")) == "radar"
    assert extra_sensor(parts("camera"), parts("camera", "radar")) is None
    assert extra_sensor(parts("camera", "radar"), parts("camera", rate=10.0)) is None
    assert extra_sensor(parts("camera", "radar", "lidar"), parts("camera")) is None
    assert extra_sensor(parts("camera", "radar"), parts("lidar")) is None


def cases(*rows: tuple[str, int, str, dict[str, float]]) -> Any:
    """Make cases of architecture, situation, fault entry and swept values."""
    return SimpleNamespace(
        architecture=Labels.of(row[0] for row in rows),
        situation=np.array([row[1] for row in rows]),
        fault_entry=Labels.of(row[2] for row in rows),
        scenario=Labels.of("cut_in" for _ in rows),
        axes=encode_points(row[3] for row in rows),
    )


def pairs(matching: Matching, a: str, b: str) -> list[tuple[int, int]]:
    first, second = matching.pairs(a, b)
    return list(zip(first.tolist(), second.tolist(), strict=True))


def test_situation_fault_and_axes_of_both_decide() -> None:
    matching = Matching(
        cases(("a", 1, "none", {}), ("a", 1, "out", {}), ("b", 1, "none", {}), ("b", 2, "out", {}))
    )
    assert pairs(matching, "a", "b") == [(0, 2)]
    left, right = ("a", 1, "none", {"yaw": 0.0}), ("a", 1, "none", {"yaw": 2.0})
    matching = Matching(cases(left, right, ("b", 1, "none", {"yaw": 2.0})))
    assert pairs(matching, "a", "b") == [(1, 2)]
    # An axis that only one has leaves all its cases as partners.
    matching = Matching(cases(left, right, ("b", 1, "none", {})))
    assert pairs(matching, "a", "b") == [(0, 2), (1, 2)]
    assert pairs(matching, "b", "a") == [(2, 0), (2, 1)]
    # Nobody of that name has no cases.
    assert len(matching.rows("c")) == 0
    assert pairs(matching, "a", "c") == []


def test_common_cases_are_those_of_everybody() -> None:
    found = [("a", 1), ("a", 2), ("b", 2), ("b", 1), ("c", 2)]
    matching = Matching(cases(*((name, situation, "none", {}) for name, situation in found)))
    common = {name: rows.tolist() for name, rows in matching.common(("a", "b", "c")).items()}
    assert common == {"a": [1], "b": [2], "c": [4]}
