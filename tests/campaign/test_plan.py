"""Plans: what is checked and counted, what is stored of them, and where they come from."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import pytest

import adeye
from adeye import plugin_code
from adeye.campaign import plan as planning
from adeye.errors import InputError, IntegrityError, SpecError
from adeye.spec.load import load_odd
from adeye.spec.odd import Odd
from adeye.store.records import StoredCase
from adeye.store.repository import Repository
from adeye.sweep.case import structure_key
from adeye.sweep.design import design_statement
from adeye.sweep.expand import Expansion, expand
from tests.conftest import MakeProject
from tests.project import CANDIDATE, CONCEPT, ROOT, Executed, odd_of
from tests.refusals import refused
from tests.stored import known, stored

# --- planning: what is checked before anything runs, what is counted, what the user is told


def test_cases_are_counted_by_scenario_architecture_and_fault(mini: Executed) -> None:
    plan = mini.plan
    counted = {
        (item.scenario, item.architecture): (item.points, item.fault_entries, item.test_cases)
        for item in plan.expansion.factors
    }
    every = ("none", "front_camera_out", "nominal_silent")
    assert counted == {
        ("cut_in", "legacy_camera"): (4, every, 12),
        ("cut_in", "camera_radar"): (4, every, 12),
        ("lead_braking", "legacy_camera"): (2, ("none",), 2),
        ("lead_braking", "camera_radar"): (2, ("none",), 2),
    }
    assert len(plan.cases) == plan.expansion.count == 28


def test_planning_executes_nothing_and_writes_nothing(make_project: MakeProject) -> None:
    project = make_project()
    before = sorted(path for path in project.folder.rglob("*"))
    assert project.plan().cases
    assert sorted(path for path in project.folder.rglob("*")) == before


@pytest.mark.slow
def test_same_files_elsewhere_give_the_same_test_cases(make_project: MakeProject) -> None:
    one, other = (make_project(name=name).plan() for name in ("one", "other"))
    assert [case.digest for case in one.cases] == [case.digest for case in other.cases]
    assert [case.stream_seed for case in one.cases] == [case.stream_seed for case in other.cases]


def test_planned_cases_carry_what_a_database_needs(mini: Executed) -> None:
    planned = list(mini.plan.planned())
    named = [digest for part in planned for digest in part.test_cases]
    assert named == [case.digest for case in mini.plan.cases]
    assert [index for part in planned for index in part.point_index] == list(range(28))
    first = planned[0]
    assert first.engine == mini.plan.engines[first.architecture]
    assert first.seed == 7
    assert set(json.loads(first.points[0])) == {"ego_speed", "gap"}


def test_examples_are_the_first_test_case_of_each_structure(mini: Executed) -> None:
    firsts: dict[str, str] = {}
    for case in mini.plan.cases:
        firsts.setdefault(structure_key(case), case.digest)
    assert [case.digest for case in mini.plan.examples()] == list(firsts.values())
    assert len(firsts) == 8


@pytest.mark.parametrize("size", [1, 5, 1_000])
def test_size_of_the_columns_does_not_change_the_campaign(
    mini: Executed, tmp_path: Path, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = Expansion.columns
    monkeypatch.setattr(Expansion, "columns", lambda self: columns(self, size=size))
    with Repository.open(tmp_path / "adeye.db") as repository:
        planned = repository.plan_campaign(mini.plan.record(), mini.plan.planned())
    with Repository.open(mini.db, create=False) as repository:
        newest = known(repository.latest_campaign())
        assert planned.campaign == newest.id


@pytest.mark.slow
def test_changed_weights_ask_for_their_runs_again(make_project: MakeProject) -> None:
    project = make_project()
    folder = project.folder / "odd" / "architectures"
    (folder / "policy.py").write_text("def drive(observation):\n    return 0.0, 0.0\n", "utf-8")
    with project.edited(CANDIDATE) as candidate:
        policy = {"kind": "policy", "parameters": {"policy": "./policy.py:drive"}}
        candidate["channels"]["nominal"] = {**policy, "files": ["weights.bin"]}

    def results(weights: bytes) -> dict[str, set[str]]:
        (folder / "weights.bin").write_bytes(weights)
        plugin_code._NAMED.clear()  # as in a process of its own
        found: dict[str, set[str]] = {}
        for part in project.plan().planned():
            digests = part.engine.result_digests(part.test_cases)
            found.setdefault(part.architecture, set()).update(digests)
        return found

    first, retrained, first_again = results(b"first"), results(b"other"), results(b"first")
    assert first == first_again
    assert first["legacy_camera"] == retrained["legacy_camera"]
    assert not first["camera_radar"] & retrained["camera_radar"]


MEMORY: str = stored("plugins")["memory"]


@pytest.mark.slow
def test_planning_many_test_cases_takes_little_memory(make_project: MakeProject) -> None:
    project = make_project()
    paths = []
    for axes in (("ego_speed", "gap", "relative_speed"), ("lateral_speed",)):
        content = project.read("odd/million.yaml")
        parameters = content["scenarios"][0]["sweep"]["parameters"]
        for name in axes:
            parameters[name] = [parameters[name]["to"]]
        paths.append(project.write(f"odd/{len(axes)}.yaml", content))
    few = project.read("odd/3.yaml")
    few["scenarios"][0]["sweep"]["parameters"]["gap"] = ["20 m", "60 m"]
    project.write("odd/3.yaml", few)
    command = [sys.executable, "-c", MEMORY, *map(str, paths), str(project.db)]
    own = {**os.environ, "PYTHONPATH": str(ROOT)}
    # The cache of the database, which grows with the plan up to its limit, and one chunk.
    assert float(subprocess.check_output(command, env=own, text=True)) < 200.0


def test_a_million_test_cases_are_counted_at_once() -> None:
    expansion = expand(load_odd(ROOT / "odd" / "million.yaml"))
    assert expansion.count == 1_000_000
    assert [factor.fault_entries for factor in expansion.factors] == [("none", "nominal_silent")]
    assert next(expansion.cases(999_999)).fault_entry == "nominal_silent"


def test_record_says_axes_units_gate_and_provenance(mini: Executed) -> None:
    record = mini.plan.record()
    assert record.gate == ("camera_radar",)
    assert record.units["cut_in"]["gap"] == "m"
    assert record.units["cut_in"]["ego_speed"] == "mps"
    assert record.factors[0]["axes"] == {"ego_speed": "80 km/h, 120 km/h", "gap": "30 m, 50 m"}
    assert record.provenance["driver"] == mini.plan.driver
    assert [item.id for item in record.fsrs] == [
        item.id for item in mini.plan.files.concept.spec.requirements
    ]


@pytest.mark.slow
def test_sample_is_stored_with_data_and_draws(make_project: MakeProject) -> None:
    project = make_project()
    data = project.folder / "odd" / "speeds.csv"
    data.write_text("dv\n-12\n-31\n", encoding="utf-8")
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"] = {
            "design": "random",
            "samples": 10,
            "parameters": {
                "gap": {"lognormal": {"median": "30 m", "sigma": 0.5, "max": "60 m"}},
                "relative_speed": {"empirical": "speeds.csv", "column": "dv", "unit": "km/h"},
            },
            "where": ["gap > 25 m"],
        }
    record = project.plan().record()
    content = record.odd.content
    assert content["data"] == {"speeds.csv": hashlib.sha256(data.read_bytes()).hexdigest()}
    stated = design_statement(content, "cut_in", record.factors)
    assert stated.is_random_sample
    assert stated.is_conditional
    assert stated.distributions["gap"] == "lognormal with median 30 m and sigma 0.5, not above 60 m"
    assert stated.drawn is not None
    assert stated.excluded_share == 1.0 - 10 / stated.drawn
    assert record.factors[0]["axes"] == dict(stated.distributions)
    assert not design_statement(content, "lead_braking", record.factors).is_random_sample
    # Other data make another ODD, though the draws may be the same.
    data.write_text("dv\n-12\n-31\n\n", encoding="utf-8")
    assert project.plan().record().odd.digest != record.odd.digest


@pytest.mark.slow
def test_covering_design_is_stored_with_what_it_covers(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        odd["scenarios"][0]["sweep"]["design"] = "pairwise"
        odd["scenarios"][0]["sweep"]["where"] = ["ego_speed < 100 km/h or gap > 40 m"]
    factor = project.plan().record().factors[0]
    assert (factor["strength"], factor["tuples"], factor["feasible_tuples"]) == (2, 4, 3)
    assert (factor["raw"], factor["points"]) == (4, 3)


@pytest.mark.slow
def test_shipped_odds_have_no_notices() -> None:
    for path in sorted((ROOT / "odd").glob("*.yaml")):
        if path.stem != "million":
            assert planning.make_plan(path).notices == ()


def test_channel_that_cannot_act_is_worth_a_notice(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"]["links"] = []
        candidate["switch"]["priority"] = ["nominal"]
    assert project.plan().notices == (
        "camera_radar: channel nominal has no links, so it cannot act",
        "camera_radar: channel safety is not in switch.priority, so it never acts",
        "fault front_camera_out acts on sensors.front_camera, which no channel of camera_radar "
        "that can act is linked to",
    )


def test_vehicle_that_is_not_told_the_friction_is_worth_a_notice(make_project: MakeProject) -> None:
    pytest.importorskip("fmpy", reason="needs adeye[fmi]")
    project = make_project(odd_of("cut_in", architectures=("fmu_vehicle",)))
    assert project.plan().notices == ()
    with project.edited("odd/architectures/fmu_vehicle.yaml") as vehicle:
        del vehicle["vehicle"]["plant"]["inputs"]["mu"]
    (said,) = project.plan().notices
    assert "fmu_vehicle: the FMU of the vehicle is not told the friction" in said


def test_formula_that_no_run_decides_is_refused_in_its_line_or_worth_a_notice(
    make_project: MakeProject,
) -> None:
    project = make_project()
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0]["formula"] = "eventually(time >= 1 s)"
    refused(SpecError, project.plan, says=r"chauffeur.yaml:\d+:\d+: .* always holds, whatever")
    with project.edited(CONCEPT) as concept:
        concept["requirements"][0]["unusual_formula"] = True
    (said,) = project.plan().notices
    assert said == "FSR-01 is meant, although no run was found that decides all of its formula"


def test_signal_table_says_who_has_what(mini: Executed) -> None:
    rows = {row.name: row for row in planning.signal_table(mini.plan)}
    both = ("legacy_camera", "camera_radar")
    assert set(rows["ego.speed"].architectures) == set(both)
    assert rows["ego.speed"].unit == "m/s"
    assert rows["sensor.front_radar.alive"].architectures == ("camera_radar",)
    assert rows["actor.cutter.gap"].scenarios == ("cut_in",)
    assert rows["channel.nominal.status"].labels[-1] == "silent"


# --- refusals: each names file, line and column ---------------------------------------------------


ODD_FILE = "odd/tested.yaml"
MINE = {"kind": "./mine.py:Mine", "links": ["front_camera"], "rate": "20 Hz"}


def onset_of(odd: Any) -> Any:
    """When the nominal channel falls silent; lead_braking has no cutter, and no faults."""
    return odd["faults"][1]["onset"]


@pytest.mark.parametrize(
    ("name", "edit", "parts"),
    [
        (ODD_FILE, lambda odd: onset_of(odd).update(when="cuter.gap <= 20 m"),
         ["tested.yaml:", "fault nominal_silent: scenario cut_in has nothing named 'cuter.gap'",
          "Did you mean 'cutter.gap'"]),
        (ODD_FILE, lambda odd: onset_of(odd).update(when="cutter.gap <= 20 m/s"),
         ["tested.yaml:"]),
        (ODD_FILE, lambda odd: odd["scenarios"][0]["sweep"].update(where=["gap > 60 m"]),
         ["tested.yaml:"]),
        ("scenarios_db/motorway/cut_in.yaml",
         lambda cut_in: cut_in["storyboard"]["cut_in"].update(when="cutter.gapp <= gap"),
         ["cut_in.yaml:", "gapp"]),
        (CONCEPT, lambda concept: concept["requirements"][0].update(formula="always(not contackt)"),
         ["motorway_chauffeur.yaml:", "contackt"]),
        (CANDIDATE, lambda candidate: candidate["channels"].update(nominal=MINE),
         ["camera_radar.yaml:", "mine.py"]),
    ],
    ids=["unknown name", "mixed units", "no points", "scenario", "requirement", "plug-in"],
)  # fmt: skip
def test_what_a_file_says_wrongly_is_refused_in_its_line(
    make_project: MakeProject, name: str, edit: Callable[[Any], None], parts: list[str]
) -> None:
    project = make_project()
    with project.edited(name) as content:
        edit(content)
    caught = refused(InputError, project.plan)
    for part in parts:
        assert part in str(caught)


def test_fault_condition_need_fit_only_its_scenarios(make_project: MakeProject) -> None:
    project = make_project()
    with project.edited_odd() as odd:
        onset_of(odd)["when"] = "cutter.gap <= 20 m"
    assert project.plan().cases


def test_unknown_backend_is_refused(make_project: MakeProject) -> None:
    with pytest.raises(InputError, match="highway"):
        planning.make_plan(make_project().odd, backend="prescan")


# --- test cases into the database and back


def stored_case(mini: Executed, ordinal: int) -> tuple[StoredCase, Any]:
    """Read a test case and the ODD's content from the executed mini campaign."""
    with Repository.open(mini.db, create=False) as repository:
        campaign = repository.find_campaign(mini.summary.campaign)
        odd = repository.content("odd", campaign.odd_digest)["odd"]
        return repository.test_case_row(mini.plan.cases[ordinal].digest), odd


@pytest.mark.slow
def test_every_test_case_comes_out_of_the_database_as_it_went_in(mini: Executed) -> None:
    for ordinal, case in enumerate(mini.plan.cases):
        stored, odd = stored_case(mini, ordinal)
        made = planning.recreate(stored, case.scenario_id, odd, inside_odd=case.inside_odd)
        assert made.digest == case.digest
        assert made.stream_seed == case.stream_seed
        assert made.scenario.executable() == case.scenario.executable()
        assert made.architecture == case.architecture
        assert made.faults == case.faults
        assert made.attributes == case.attributes


def test_folder_of_plugins(mini: Executed, tmp_path: Path) -> None:
    stored, odd = stored_case(mini, 0)
    with Repository.open(mini.db, create=False) as repository:
        made = repository.find_campaign(mini.summary.campaign).provenance
    folder = mini.plan.folders["legacy_camera"]
    gone = {planning.FOLDERS: {"legacy_camera": str(tmp_path / "gone")}}
    assert planning.folder_of_plugins(stored, [made], "legacy_camera") == folder
    assert planning.folder_of_plugins(stored, [gone, {}, made], "legacy_camera") == folder
    assert planning.folder_of_plugins(stored, [gone], "legacy_camera") == tmp_path / "gone"
    assert planning.folder_of_plugins(stored, [{}], "legacy_camera") == Path()
    # As releases stored it that had it in the content.
    former = replace(stored, architecture={**stored.architecture, "plugin_folder": str(tmp_path)})
    assert planning.folder_of_plugins(former, [made], "legacy_camera") == tmp_path
    assert planning.recreate(former, "cut_in", odd, inside_odd=True).digest == stored.test_case


def test_case_that_comes_out_otherwise_is_not_run(mini: Executed) -> None:
    ordinal = next(i for i, case in enumerate(mini.plan.cases) if case.faults)
    stored, odd = stored_case(mini, ordinal)
    wrong: dict[str, Any] = {"parameters": {"ego_speed": 1.0}, "faults": (), "step_s": 0.1}
    for name, value in {**wrong, "seed": 8, "replicate": 1}.items():
        with pytest.raises(IntegrityError, match="does not come out of the database as it went in"):
            planning.recreate(replace(stored, **{name: value}), "cut_in", odd, inside_odd=True)


def test_one_record_is_shared_by_the_cases_of_one_content(mini: Executed) -> None:
    contents = planning.Contents()
    cases = [case for case in mini.plan.cases if case.scenario_id == "cut_in"]
    records = {id(contents.scenario(case.scenario)) for case in cases}
    assert len(records) == 1
    one = contents.architecture(cases[0].architecture)
    assert contents.architecture(cases[0].architecture) is one
    assert one.id == cases[0].architecture.architecture


# --- what is stored of how test cases were counted: axes in words, and what a design looked at


def odd(sweep: dict[str, Any]) -> Odd:
    others = {"odd": "test", "architectures": ["a.yaml"], "concept": "c.yaml"}
    return Odd.model_validate({**others, "scenarios": [{"use": "cut_in", "sweep": sweep}]})


def test_axes_are_written_as_their_levels_steps_points_or_distributions() -> None:
    levels = {
        "gap": ["10 m", "20 m"],
        "ego_speed": {"from": "80 km/h", "to": "120 km/h", "step": "20 km/h"},
    }
    drawn = {"design": "random", "samples": 3, "parameters": {"gap": {"uniform": ["10 m", "20 m"]}}}
    points = {"design": "list", "points": [{"gap": "10 m"}, {"gap": "20 m", "rain": "0 mm/h"}]}
    steps = "80 km/h to 120 km/h, step 20 km/h"
    for sweep, axes in (
        ({"parameters": levels}, {"gap": "10 m, 20 m", "ego_speed": steps}),
        (drawn, {"gap": "uniform from 10 m to 20 m"}),
        (points, {"gap": "10 m, 20 m", "rain": "0 mm/h"}),
    ):
        assert planning.axes_text(odd(sweep), "cut_in") == axes


def test_counts_are_those_of_the_design() -> None:
    def counts(drawn: int | None, tuples: Any) -> dict[str, int]:
        points: Any = SimpleNamespace(drawn=drawn, count=4, tuples=tuples)
        return planning.design_counts(points)

    assert counts(9, None) == {"drawn": 9, "kept": 4}
    tuples = SimpleNamespace(strength=2, total=12, feasible=11)
    assert counts(None, tuples) == {"strength": 2, "tuples": 12, "feasible_tuples": 11}
    assert counts(None, None) == {}


# --- where a campaign comes from


def git(folder: Path, *arguments: str) -> None:
    author = ["-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false"]
    subprocess.run(["git", "-C", str(folder), *author, *arguments], check=True, capture_output=True)


@pytest.fixture
def committed(tmp_path: Path) -> Path:
    """A file in a repository of its own."""
    path = tmp_path / "odd.yaml"
    path.write_text("odd: a\n", "utf-8")
    git(tmp_path, "init")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-m", "first")
    return path


def test_tool_packages_and_file_are_named(tmp_path: Path) -> None:
    found = planning.provenance(tmp_path / "odd.yaml")
    assert found["adeye"] == adeye.__version__
    assert set(found["packages"]) == set(planning.PACKAGES)
    assert all(found["packages"].values())
    assert found["odd_path"].endswith("odd.yaml")
    # Outside of a repository there is no commit.
    assert planning.git_state(tmp_path) == {}


def test_commit_of_the_odds_repository_and_whether_it_has_changes(committed: Path) -> None:
    clean = planning.git_state(committed.parent)
    assert len(clean["commit"]) == 40
    assert clean["is_dirty"] is False
    committed.write_text("odd: b\n", "utf-8")
    assert planning.git_state(committed.parent) == {"commit": clean["commit"], "is_dirty": True}


def test_nothing_depends_on_git_or_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = Mock(side_effect=OSError)
    monkeypatch.setattr("adeye.campaign.plan.subprocess.run", missing)
    monkeypatch.setattr("adeye.campaign.plan.getpass.getuser", missing)
    monkeypatch.setattr(planning, "PACKAGES", ("not-installed-anywhere",))
    found = planning.provenance(tmp_path / "odd.yaml")
    assert (found["git"], found["who"]) == ({}, "")
    assert found["packages"] == {"not-installed-anywhere": ""}


def test_program_that_a_repository_names_is_not_started(committed: Path) -> None:
    canary = committed.with_name("canary")
    git(committed.parent, "config", "core.fsmonitor", f"touch {canary} #")
    assert planning.git_state(committed.parent)["commit"]
    assert not canary.exists()
    git(committed.parent, "status")
    assert canary.exists()
