"""Imported roads: one that is straight drives as the parametric one, and places are values."""

import os
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from adeye.answers import claim
from adeye.campaign import check
from adeye.campaign.check import refused_starts
from adeye.campaign.naming import campaign_of_file
from adeye.campaign.plan import CampaignPlan
from adeye.errors import InputError
from adeye.judge.verdict import ExitCode
from adeye.kernel.road import MANY
from adeye.maps import lanes as lanes_of
from adeye.maps.opendrive import Geometry, OpenDrive, RoadType
from adeye.maps.opendrive_writer import write_opendrive
from adeye.maps.places import Candidates
from adeye.report.claims import ClaimOptions
from adeye.simulate.world.formulas import Formulas
from adeye.simulate.world.roads import build_roads
from adeye.spec.load import load_scenario
from adeye.spec.places import Offer, choose_places, first_place
from adeye.store.read.totals import gate_code
from adeye.store.repository import Repository
from adeye.sweep.case import batches
from tests.drawn_roads import lane, network, piece, road, section
from tests.project import ROOT, Project, odd_of, run_cases, use
from tests.refusals import refused
from tests.stored import known

WIDE = (0.0, 3.5, 0.0, 0.0, 0.0)
HARD = (0.0, 3.0, 0.0, 0.0, 0.0)


def motorway(*more: Any) -> OpenDrive:
    """Return a straight road of 4 km with three lanes and a shoulder, and other roads."""
    lanes = [lane(number, WIDE) for number in (-1, -2, -3)]
    across = section(lane(0), *lanes, lane(-4, HARD, type="shoulder"))
    kind = RoadType(0.0, "motorway", 130.0 / 3.6, 1)
    return network(road([piece("line", 4000.0)], across, types=(kind,)), *more)


def braking(folder: Path, drawn: OpenDrive, places: Any = "first 1", **world: Any) -> Project:
    """Return the shipped braking of a lead, at places of a map or, without, on its own road."""
    project = Project(folder, odd_of(use("lead_braking")))
    (folder / "scenarios_db/motorway" / "drawn.xodr").write_bytes(write_opendrive(drawn))
    if places is not None:
        query = {"anchor": "carriageway", "after": "2000 m", "lanes": 3, **world}
        with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
            scenario["world"] = {"map": {"file": "drawn.xodr"}, "place": query}
        with project.edited_odd() as odd:
            odd["scenarios"][0]["sweep"] = {"parameters": {"place": places}}
    project.require("FSR-01")
    return project


def planned(folder: Path, drawn: OpenDrive, places: Any = "first 1", **world: Any) -> CampaignPlan:
    """Plan it."""
    return braking(folder, drawn, places, **world).plan()


def test_a_map_of_one_straight_road_drives_as_the_parametric_road(tmp_path: Path) -> None:
    parametric, imported = (
        planned(tmp_path / name, motorway(), places)
        for name, places in (("parametric", None), ("imported", "first 1"))
    )
    traces = [run_cases(plan, plan.cases) for plan in (parametric, imported)]
    for column in ("ego", "objects"):
        first, second = (trace[column] for trace in traces)
        np.testing.assert_allclose(second[..., :4], first[..., :4], atol=1e-3)


@pytest.mark.slow
def test_a_map_of_one_straight_road_gives_the_verdicts_of_the_parametric_road(
    tmp_path: Path,
) -> None:
    found = []
    for name, places in (("parametric", None), ("imported", "first 1")):
        project = braking(tmp_path / name, motorway(), places)
        with project.edited_odd() as odd:
            axes = odd["scenarios"][0].setdefault("sweep", {}).setdefault("parameters", {})
            # Soft, and so hard on so wet a road that it is hit.
            axes |= {"deceleration": ["2 m/s^2", "10 m/s^2"], "friction": [0.3, 0.9]}
        project.run()
        found.append(
            sorted(
                (row["point"]["deceleration"], row["point"]["friction"], str(row["verdicts"]))
                for row in project.rows()
            )
        )
    assert found[0] == found[1]
    assert len({verdicts for *_, verdicts in found[0]}) > 1


def test_places_are_values_of_one_structure_and_tell_test_cases_apart(tmp_path: Path) -> None:
    plan = planned(tmp_path / "p", motorway(), "first 5")
    keys = [case.point["place"] for case in plan.cases]
    assert keys == [f"drawn:1+{number * 50}" for number in range(5)]
    assert len({case.digest for case in plan.cases}) == 5
    assert [len(batch) for batch in batches(plan.cases, 1024)] == [5]


def test_a_road_far_away_changes_no_test_case(tmp_path: Path) -> None:
    far = road(
        [piece("line", 900.0, pose=(0.0, 9e3, 0.0))], section(lane(0), lane(-1, WIDE)), id="0"
    )
    plans = [
        planned(tmp_path / name, drawn, "first 3")
        for name, drawn in (("alone", motorway()), ("more", motorway(far)))
    ]
    first, second = ([case.digest for case in plan.cases] for plan in plans)
    assert first == second


def test_bits_of_a_run_do_not_hang_on_the_roads_beside_it(tmp_path: Path) -> None:
    bends = [piece("spiral", 300.0, 0.0, 1.0 / 400.0, pose=(0.0, 5e3, 0.0))]
    bends += [piece("line", 3700.0, pose=_end_of(bends[0]), s=300.0)]
    lanes = section(lane(0), *(lane(number, WIDE) for number in (-1, -2, -3)))
    plan = planned(tmp_path / "p", motorway(road(bends, lanes, id="2")), ["drawn:1+0", "drawn:2+0"])
    together = run_cases(plan, plan.cases)
    assert len({len(case.scenario.world.road.line) for case in plan.cases}) == 2
    for run, case in enumerate(plan.cases):
        # Short lines are looked along as long ones are, which agrees but for places far away.
        assert build_roads(Formulas.of([case])).segments.shape[1] > MANY
        assert run_cases(plan, [case]).digests()[0] == together.digests()[run]


def _end_of(spiral: Geometry) -> tuple[float, float, float]:
    laid = lanes_of.laid(road([spiral], section(lane(0), lane(-1, WIDE))))
    end = lanes_of.along(laid, lanes_of.REFERENCE, np.array([spiral.length]))
    return float(end.x[0]), float(end.y[0]), float(end.heading[0])


def test_a_use_may_fix_the_place(tmp_path: Path) -> None:
    project = Project(tmp_path / "p", odd_of(use("lead_braking")))
    (tmp_path / "p/scenarios_db/motorway/drawn.xodr").write_bytes(write_opendrive(motorway()))
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        query = {"anchor": "carriageway", "after": "2000 m", "lanes": 3}
        scenario["world"] = {"map": {"file": "drawn.xodr"}, "place": query}
    project.require("FSR-01")
    with project.edited_odd() as odd:
        odd["scenarios"][0]["parameters"] = {"place": "drawn:1+150"}
    (case,) = project.plan().cases
    assert case.scenario.world.road.place == "drawn:1+150"
    for name in ("scenario.world.place.after", "scenario.world.road.lane_width"):
        with project.edited_odd() as odd:
            odd["scenarios"][0]["sweep"] = {"parameters": {name: ["1 km", "2 km"]}}
        with pytest.raises(InputError, match="what the place of a map decides"):
            project.plan()


@pytest.mark.parametrize(
    ("places", "world", "told"),
    [
        ("first 99", {}, "the scenario has 41 places"),
        ([], {}, "no place is chosen"),
        (["drawn:1+7"], {}, "there is no place 'drawn:1\\+7'"),
        ("some", {}, "must be all, first N or sample N seed K"),
        ("first 1", {"lanes": 2}, "with another number of lanes"),
        ("first 1", {"after": "9 km"}, "too near to the end of the way"),
    ],
)
def test_what_cannot_be_had_is_told(
    tmp_path: Path, places: Any, world: dict[str, Any], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        planned(tmp_path / "p", motorway(), places, **world)


def test_a_sample_of_places_is_drawn_by_its_seed(tmp_path: Path) -> None:
    drawn = [
        [case.point["place"] for case in planned(tmp_path / str(k), motorway(), choice).cases]
        for k, choice in enumerate(("sample 4 seed 1", "sample 4 seed 1", "sample 4 seed 2"))
    ]
    assert drawn[0] == drawn[1] != drawn[2]


def narrowing() -> OpenDrive:
    """Return a road of three lanes, of which the right one ends at 2500 m."""
    wide = [lane(number, WIDE, successors=(number,)) for number in (-1, -2)]
    narrow = [lane(number, WIDE, predecessors=(number,)) for number in (-1, -2)]
    parts = section(lane(0), *wide, lane(-3, WIDE)), section(lane(0), *narrow, s=2500.0)
    return network(road([piece("line", 4000.0)], *parts))


def project_of(folder: Path, lane: int, places: Any) -> Project:
    """Return a project whose lead starts 600 m along a place of a road that narrows."""
    project = Project(folder, odd_of(use("lead_braking")))
    (folder / "scenarios_db/motorway" / "drawn.xodr").write_bytes(write_opendrive(narrowing()))
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        query = {"anchor": "carriageway", "after": "2000 m", "lanes": 3}
        scenario["world"] = {"map": {"file": "drawn.xodr"}, "place": query}
        scenario["actors"]["lead"]["start"] = {"lane": lane, "s": "600 m", "speed": "ego_speed"}
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"] = {"parameters": {"place": places}}
    project.require("FSR-01")
    return project


@pytest.mark.slow
def test_a_scenario_takes_place_at_every_place_of_several_maps_or_is_refused_there(
    tmp_path: Path,
) -> None:
    project = project_of(tmp_path / "p", 2, "all")
    three = section(lane(0), *(lane(number, WIDE) for number in (-1, -2, -3)))
    lines = {"long": piece("line", 8000.0), "bent": piece("arc", 4000.0, 1.0 / 1500.0)}
    lines["short"] = piece("line", 300.0)
    for name, line in lines.items():
        path = project.folder / f"scenarios_db/motorway/{name}.xodr"
        path.write_bytes(write_opendrive(network(road([line], three))))
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        scenario["world"]["map"]["file"] = ["drawn.xodr", *(f"{name}.xodr" for name in lines)]
    plan = project.plan()
    assert any("200 of 203 places, 3 refused (" + GONE in text for text in plan.notices)
    project.run()
    rows = project.rows()
    found = Counter(row["point"]["place"].split(":")[0] for row in rows)
    assert found == {"drawn": 38, "long": 121, "bent": 41}
    assert {row["outcome"] for row in rows} == {"completed"}
    assert all(row["verdicts"] for row in rows)
    with Repository.open(project.db) as repository:
        code, said = gate_code(repository, known(repository.latest_campaign()))
    assert code is ExitCode.OK
    nowhere = "lead_braking has no place on short.xodr"
    assert nowhere in plan.notices
    assert said.endswith(
        f"; {nowhere}; lead_braking cannot start at 3 of 203 places, which are left out"
    )


@pytest.mark.parametrize("choice", ["first 2", "sample 3 seed 1"])
def test_a_map_without_a_place_is_told_whichever_places_are_taken(
    tmp_path: Path, choice: str
) -> None:
    project = project_of(tmp_path / "p", 0, choice)
    lanes = section(lane(0), *(lane(number, WIDE) for number in (-1, -2, -3)))
    for name, length in (("short", 300.0), ("other", 4000.0)):
        path = project.folder / f"scenarios_db/motorway/{name}.xodr"
        path.write_bytes(write_opendrive(network(road([piece("line", length)], lanes))))
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        scenario["world"]["map"]["file"] = ["drawn.xodr", "short.xodr", "other.xodr"]
    told = project.plan().left_out
    assert told == {"lead_braking": {"maps": ["short.xodr"]}}


def test_one_place_for_all_is_said_where_nobody_chose_it(tmp_path: Path) -> None:
    project = project_of(tmp_path / "p", 0, "all")
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"] = {"parameters": {"friction": [0.9]}}
    said = "lead_braking takes place at drawn:1+0 only, the first of its places"
    assert [text[: len(said)] for text in project.plan().notices if "only" in text] == [said]
    project.run()
    with Repository.open(project.db) as repository:
        assert gate_code(repository, known(repository.latest_campaign()))[1].endswith(said)
    population = claim(project.db, None, ClaimOptions()).populations["lead_braking"]
    assert population.endswith(", all of them at drawn:1+0 of the map")
    with project.edited_odd() as odd:
        odd["scenarios"][0]["parameters"] = {"place": "drawn:1+50"}
    assert not project.plan().left_out


def test_nobody_drives_by_a_limit_that_lacks_its_unit(tmp_path: Path) -> None:
    project = project_of(tmp_path / "p", 0, "all")
    lanes = section(lane(0), *(lane(number, WIDE) for number in (-1, -2, -3)))
    fast = (RoadType(0.0, "motorway", 130.0, 5),)
    path = project.folder / "scenarios_db/motorway/drawn.xodr"
    path.write_bytes(write_opendrive(network(road([piece("line", 4000.0)], lanes, types=fast))))
    refused(InputError, project.plan, says="drawn:1.*468 km/h, above any that is posted")
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"] = {"parameters": {"friction": [0.9]}}
    refused(InputError, project.plan, says="lead_braking.*468 km/h, above any that is posted")


def test_a_map_that_has_fewer_places_by_now_is_what_was_edited(tmp_path: Path) -> None:
    project = project_of(tmp_path / "p", 0, "all")
    with project.edited("scenarios_db/motorway/lead_braking.yaml") as scenario:
        scenario["world"]["place"]["after"] = "3900 m"
    project.run()
    shorter = narrowing()
    one = next(iter(shorter.roads.values()))
    cut = replace(one, length=3950.0, geometries=(replace(one.geometries[0], length=3950.0),))
    path = project.folder / "scenarios_db/motorway/drawn.xodr"
    path.write_bytes(write_opendrive(replace(shorter, roads={one.id: cut})))
    with Repository.open(project.db) as repository:
        edits = campaign_of_file(repository, project.odd).edits
    assert edits == "a map, of which 2 test cases are planned for 3"


GONE = "drawn:1+1900, drawn:1+1950, drawn:1+2000: actors.lead.start.lane: the road has no lane 2"


def test_a_place_where_the_scenario_cannot_start_is_refused_and_told(tmp_path: Path) -> None:
    project = project_of(tmp_path / "p", 2, "all")
    plan = project.plan()
    assert len(plan.cases) == 38
    (told,) = (text for text in plan.notices if "places" in text)
    assert told.startswith(f"lead_braking: 38 of 41 places, 3 refused ({GONE}")
    noted = plan.odd_content()["left_out"]["lead_braking"]
    assert (noted["left"], noted["refused"]) == (38, GONE.split(": ")[0].split(", "))
    # Two lanes all along and one that ends, all without a limit.
    assert plan.files.map_notes()["drawn.xodr"]["guessed"] == 5
    loaded = load_scenario(project.folder / "scenarios_db/motorway/lead_braking.yaml")
    starts = dict(refused_starts(loaded, Offer(loaded.spec, loaded.locate)))
    assert [place for place, why in starts.items() if why] == GONE.split(": ")[0].split(", ")


def test_the_world_of_a_place_is_computed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed: list[Any] = []
    compute = check._check_worlds

    def noted(expansion: Any, part: Any) -> None:
        computed.append(part)
        compute(expansion, part)

    monkeypatch.setattr(check, "_check_worlds", noted)
    plan = planned(tmp_path / "p", motorway(), "first 3")
    assert len(computed) == len(plan.cases) == 3


@pytest.mark.parametrize(
    ("lane", "places", "told"),
    [
        (2, ["drawn:1+0", "drawn:1+1950"], "no lane 2 .* at place drawn:1\\+1950"),
        (3, "all", "3 is no lane of a road with lanes 0 to 2, at place drawn:1\\+0"),
    ],
)
def test_a_place_that_was_named_or_is_the_last_one_is_not_passed_over(
    tmp_path: Path, lane: int, places: Any, told: str
) -> None:
    with pytest.raises(InputError, match=told):
        project_of(tmp_path / "p", lane, places).plan()


@pytest.mark.parametrize(
    ("world", "told"),
    [
        (
            {"map": {"file": ["drawn.xodr", "other/drawn.xodr"]}},
            "two maps have one name",
        ),
        ({"road": True}, "a road and a map are both given"),
        ({"road": True, "map": None}, "no map is named"),
    ],
)
def test_maps_and_roads_that_contradict_each_other_are_refused(
    tmp_path: Path, world: dict[str, Any], told: str
) -> None:
    (tmp_path / "other").mkdir()
    for folder in (tmp_path, tmp_path / "other"):
        (folder / "drawn.xodr").write_bytes(write_opendrive(motorway()))
    content = yaml.safe_load((ROOT / "scenarios_db/motorway/lead_braking.yaml").read_text("utf-8"))
    query = {"anchor": "carriageway", "after": "2 km"}
    asked = {"map": {"file": "drawn.xodr"}, "place": query, **world}
    if "road" in asked:
        asked["road"] = content["world"]["road"]
    content["world"] = {name: item for name, item in asked.items() if item is not None}
    path = tmp_path / "lead_braking.yaml"
    path.write_text(yaml.safe_dump(content), "utf-8")
    with pytest.raises(InputError, match=told):
        load_scenario(path)


def on_map(folder: Path, drawn: str = "drawn.xodr", **query: Any) -> Path:
    """Write the shipped braking of a lead at places of a map beside it."""
    content = yaml.safe_load((ROOT / "scenarios_db/motorway/lead_braking.yaml").read_text("utf-8"))
    content["world"] = {"map": {"file": drawn}, "place": {"anchor": "carriageway", **query}}
    path = folder / "lead_braking.yaml"
    path.write_text(yaml.safe_dump(content), "utf-8")
    return path


def test_a_map_is_known_by_what_it_holds(tmp_path: Path) -> None:
    path, radii, states = tmp_path / "drawn.xodr", [], set()
    asked = on_map(tmp_path, after="500 m")
    for curvature in (0.001, 0.002):
        bent = road([piece("arc", 900.0, curvature)], section(lane(0), lane(-1, WIDE)))
        path.write_bytes(write_opendrive(network(bent)))
        os.utime(path, (1e9, 1e9))
        states.add((path.stat().st_size, path.stat().st_mtime_ns))
        loaded = load_scenario(asked)
        radii.append(first_place(loaded.spec, loaded.locate).place.radius)
    assert len(states) == 1
    assert radii == pytest.approx([1000.0, 500.0], abs=5.0)


def test_places_are_looked_at_as_they_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "drawn.xodr").write_bytes(write_opendrive(motorway()))
    loaded = load_scenario(on_map(tmp_path, after="2 km", lanes=3))
    looked: list[int] = []
    look = Candidates.look

    def noted(self: Candidates, number: int) -> Any:
        looked.append(number)
        return look(self, number)

    monkeypatch.setattr(Candidates, "look", noted)
    every = list(Offer(loaded.spec, loaded.locate))
    assert len(every) == 41 < len(looked)
    choices: list[Any] = ["first 3", "sample 5 seed 2", "sample 41 seed 2", [every[7], every[2]]]
    for choice in choices:
        looked.clear()
        taken = choose_places(Offer(loaded.spec, loaded.locate), choice)
        assert len(looked) < 40 or len(taken) == 41
        if isinstance(choice, str) and choice.startswith("sample"):
            assert list(taken) == [place for place in every if place in taken]
        else:
            assert list(taken) == (every[:3] if choice == "first 3" else choice)
    for choice, told in ("sample 42 seed 2", "has 41 places"), (["drawn:1+1"], "among the 41 of"):
        refused(InputError, choose_places, Offer(loaded.spec, loaded.locate), choice, says=told)
