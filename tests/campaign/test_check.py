"""What a plan would simulate is checked before it runs, and refused where it was written."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.campaign import check as checking
from adeye.errors import InputError, SpecError, SweepError
from adeye.spec.load import OddFiles, load_odd
from adeye.sweep.expand import expand
from tests.project import MINI, Project
from tests.refusals import refused
from tests.stored import known, stored

# --- what a plan would simulate is checked before it runs: variants, onsets, values and plug-ins


ROOT = Path(__file__).parents[2]
PLUGIN: str = stored("plugins")["planner"]
Load = Callable[..., OddFiles]


def onset(when: str) -> dict[str, Any]:
    fault = {"id": "out", "target": "sensors.front_camera", "model": "drop_out"}
    return {**fault, "onset": {"when": when}}


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Copy the shipped content."""
    shutil.copytree(ROOT / "scenarios_db", tmp_path / "scenarios_db")
    shutil.copytree(ROOT / "odd", tmp_path / "odd")
    return tmp_path


@pytest.fixture
def load(project: Path) -> Load:
    """Write an ODD of a cut-in and a braking lead with changes on top, and load it."""

    def make(sweep: dict[str, Any] | None = None, **changes: Any) -> OddFiles:
        content = {
            "odd": "example",
            "scenarios": [{"use": "cut_in", "sweep": sweep or {}}, {"use": "lead_braking"}],
            "architectures": ["architectures/camera_radar.yaml"],
            "concept": "concepts/motorway_chauffeur.yaml",
            **changes,
        }
        path = project / "odd" / "example.yaml"
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        return load_odd(path)

    return make


def check(files: OddFiles) -> None:
    checking.check_cases(expand(files))


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_what_is_shipped_passes(load: Load) -> None:
    files = load(faults=[onset("time > 1 s")])
    for item in files.scenarios.values():
        checking.check_formulas(item)
    checking.check_onsets(files)
    check(files)


def late(delay: str) -> dict[str, Any]:
    fault = {"id": "late", "target": "switch", "model": "late", "onset": {"at": "1 s"}}
    return {**fault, "delay": delay}


def test_delay_of_a_late_switch_between_two_ticks(load: Load) -> None:
    for whole in ("0.15 s", "0 s"):
        checking.check_fits(load(faults=[late(whole)]))
    with pytest.raises(SpecError) as caught:
        checking.check_fits(load(faults=[late("0.12 s")]))
    assert str(caught.value.where).endswith("example.yaml:5:10")
    assert caught.value.message == "fault late: delay: 0.12 s is no whole number of steps of 0.05 s"
    assert caught.value.remedy == "The nearest are 0.1 s and 0.15 s."
    sweep = {"parameters": {"faults.late.delay": ["0.1 s", "0.13 s"]}}
    scenarios = [{"use": "cut_in", "sweep": sweep}]
    with pytest.raises(SpecError, match=r"with the swept values, fault late: delay: 0.13 s is no"):
        check(load(faults=[late("0.1 s")], scenarios=scenarios))


def hook(channel: str, model: str = "planner_frozen") -> dict[str, Any]:
    return {**onset("time > 1 s"), "target": f"hooks.{channel}", "model": model}


def test_hook_that_a_channel_does_not_offer(load: Load) -> None:
    offered = [hook("nominal"), {**hook("nominal", "tracks_lost"), "id": "lost"}]
    checking.check_hooks(load(faults=offered))
    faults = [hook("nominal", "monitors_frozen")]
    said = r"example.yaml:\d+:\d+: fault out: channel nominal of .* has no hook monitors_frozen"
    with pytest.raises(SpecError, match=said):
        checking.check_hooks(load(faults=faults))
    checking.check_hooks(load(faults=faults, scenarios=[{"use": "cut_in", "faults": []}]))


def test_hooks_of_a_plugin_are_its_own(project: Path, load: Load) -> None:
    folder = project / "odd" / "architectures"
    offers = PLUGIN.replace("monitor_ids = ()", 'monitor_ids = ()\n    hooks = ("tracks_lost",)')
    offers += "\n    def inject(self, hook, active, size): ...\n"
    (folder / "mine.py").write_text(offers, encoding="utf-8")
    nominal = {"kind": "./mine.py:Planner", "parameters": None}
    mine = {
        "extends": "camera_radar.yaml",
        "architecture": "mine",
        "channels": {"nominal": nominal},
    }
    (folder / "mine.yaml").write_text(yaml.safe_dump(mine), encoding="utf-8")
    architectures = ["architectures/mine.yaml"]
    checking.check_hooks(load(faults=[hook("nominal", "tracks_lost")], architectures=architectures))
    with pytest.raises(SpecError, match="It has tracks_lost"):
        checking.check_hooks(load(faults=[hook("nominal")], architectures=architectures))


def test_formula_of_a_scenario_is_refused(project: Path, load: Load) -> None:
    path = project / "scenarios_db" / "motorway" / "cut_in.yaml"
    replace(path, "s: 100 m", "s: 100 m + ego_sped * 1 s")
    with pytest.raises(SpecError, match=r"cut_in.yaml:\d+:\d+: .*Did you mean 'ego_speed'"):
        checking.check_formulas(load().scenarios["cut_in"])


def test_onset_condition_is_refused_at_its_place(load: Load) -> None:
    for when, said in (
        ("cuter.gap < 9 m", "scenario cut_in has nothing named 'cuter.gap'. Did you mean"),
        ("cutter.gap < 9 m", "scenario lead_braking has nothing named 'cutter.gap'"),
        ("time > 9 m", "puts a time and a length together"),
        ("time > 9", "puts a time and a plain number together"),
        ("time == 'late'", "uses text"),
    ):
        with pytest.raises(SpecError) as caught:
            checking.check_onsets(load(faults=[onset(when)]))
        assert said in str(caught.value)
        assert known(caught.value.where).path.endswith("example.yaml")


def test_onset_is_checked_only_where_the_fault_occurs(load: Load) -> None:
    both = {"use": "cut_in", "faults": [["out", "late"]]}
    scenarios = [both, {"use": "lead_braking", "faults": []}]
    late = {**onset("time > 1 s"), "id": "late"}
    checking.check_onsets(load(faults=[onset("cutter.gap < 9 m"), late], scenarios=scenarios))


def test_swept_variant_is_checked_like_the_file(load: Load) -> None:
    for axis, values, said in (
        ("scenario.actors.cutter.start.ahead_of", ["ego", "nobody"], "no actor 'nobody'"),
        ("scenario.actors.cutter.start.gap", ["30 m", "gpa"], "'gpa', which does not exist"),
        ("scenario.storyboard.cut_in.actor", ["cutter", "other"], "no actor 'other'"),
        ("scenario.ego.lane", [1, 7], "7 is no lane of a road with lanes 0 to 2"),
        ("faults.out.onset.when", ["time > 1 s", "tiem > 1 s"], "Did you mean 'time'"),
    ):
        with pytest.raises(SpecError) as caught:
            check(load({"parameters": {axis: values}}, faults=[onset("time > 1 s")]))
        assert said in str(caught.value)
        check(load({"parameters": {axis: values[:1]}}, faults=[onset("time > 1 s")]))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("lane_width: 3.5 m", "lane_width: 0 m", "world.road.lane_width: 0 m is not above 0 m"),
        ("friction: friction", "friction: friction - 1", "environment.friction: -0.1"),
        ("shoulder: 3 m", "shoulder: -3 m", "world.road.shoulder: -3 m"),
        ("speed: ego_speed + relative_speed", "speed: relative_speed", "actors.cutter.start.speed"),
    ],
)
def test_impossible_value_is_refused_in_the_line_of_its_formula(
    project: Path, load: Load, old: str, new: str, said: str
) -> None:
    path = project / "scenarios_db" / "motorway" / "cut_in.yaml"
    replace(path, old, new)
    with pytest.raises(SpecError) as caught:
        check(load())
    assert said in str(caught.value)
    line = path.read_text("utf-8")[: path.read_text("utf-8").index(new)].count("\n") + 1
    assert caught.value.where is not None
    assert (caught.value.where.path, caught.value.where.line) == (str(path), line)


def test_one_impossible_point_is_found(project: Path, load: Load) -> None:
    path = project / "scenarios_db" / "motorway" / "cut_in.yaml"
    replace(path, "shoulder: 3 m", "shoulder: (gap - 30 m) / 10")
    steps = {"to": "60 m", "step": "1 m"}
    check(load({"parameters": {"gap": {"from": "30 m", **steps}}}))
    with pytest.raises(SpecError, match=r"world\.road\.shoulder: -0.1 m"):
        check(load({"parameters": {"gap": {"from": "29 m", **steps}}}))


def test_swept_parameter_of_a_plugin(project: Path, load: Load) -> None:
    folder = project / "odd" / "architectures"
    (folder / "planner.py").write_text(PLUGIN, encoding="utf-8")
    mine = "kind: ./planner.py:Planner\n    parameters: {gain: 2}"
    replace(folder / "camera_radar.yaml", "kind: nominal", mine)
    axis = "architecture.channels.nominal.parameters.gain"
    check(load({"parameters": {axis: [2, 3]}}))
    said = r"with the swept values, channels\.nominal\.parameters\.gain"
    with pytest.raises(SpecError, match=said):
        check(load({"parameters": {axis: [2, "fast"]}}))


def test_policy_is_part_of_the_identity_and_not_swept(project: Path, load: Load) -> None:
    folder = project / "odd" / "architectures"
    for name in ("one", "other"):
        source = f"def drive(observation):\n    return 0.0, 0.0  # {name}\n"
        (folder / f"{name}.py").write_text(source, encoding="utf-8")
        (folder / f"{name}.bin").write_bytes(name.encode())
    policy = "kind: policy\n    parameters: {policy: './one.py:drive'}"
    replace(folder / "camera_radar.yaml", "kind: nominal", policy)
    nominal = "architecture.channels.nominal"
    check(load({"parameters": {f"{nominal}.parameters.nearest": [2, 3]}}))
    for axis, values in (
        ("parameters.policy", ["./one.py:drive", "./other.py:drive"]),
        ("files", [["one.bin"], ["other.bin"]]),
    ):
        with pytest.raises(SpecError, match="another plug-in, policy or file"):
            check(load({"parameters": {f"{nominal}.{axis}": values}}))


def test_fmu_of_a_vehicle_is_part_of_the_identity_and_not_swept(project: Path, load: Load) -> None:
    pytest.importorskip("fmpy", reason="needs adeye[fmi]")
    fmus = project / "odd" / "architectures" / "fmus"
    shutil.copy(fmus / "single_track.fmu", fmus / "other.fmu")
    vehicle = {"architectures": ["architectures/fmu_vehicle.yaml"]}
    plant = "architecture.vehicle.plant"
    check(load({"parameters": {f"{plant}.sub_steps": [1, 2]}}, **vehicle))
    named = ["./fmus/single_track.fmu", "./fmus/other.fmu"]
    with pytest.raises(SpecError, match="another plug-in, policy or file"):
        check(load({"parameters": {f"{plant}.file": named}}, **vehicle))


def test_swept_value_of_a_program_names_no_file(project: Path, load: Load) -> None:
    folder = project / "odd" / "architectures"
    (folder / "drive.py").write_text("", encoding="utf-8")
    program = "kind: process\n    parameters: {command: [python3, ./drive.py], values: {net: a}}"
    replace(folder / "camera_radar.yaml", "kind: nominal", program)
    axis = "architecture.channels.nominal.parameters.values.net"
    check(load({"parameters": {axis: ["a", "b"]}}))
    with pytest.raises(SpecError, match="means a file or folder in no identity"):
        check(load({"parameters": {axis: ["a", "./camera_radar.yaml"]}}))


def test_fmu_that_drives_an_actor_is_not_swept(project: Path, load: Load) -> None:
    pytest.importorskip("fmpy", reason="needs adeye[fmi]")
    folder = project / "scenarios_db" / "motorway"
    for name in ("one", "other"):
        source = project / "odd" / "architectures" / "fmus" / "follow_and_keep.fmu"
        shutil.copy(source, folder / f"{name}.fmu")
    driven: dict[str, Any] = {
        "extends": "lead_braking.yaml",
        "scenario": "driven",
        "storyboard": None,
        "realised": None,
        "actors": {
            "lead": {
                "reactive": None,
                "driver": {
                    "file": "./one.fmu",
                    "inputs": {"v": "own.speed", "v_set": "own.desired_speed"},
                    "outputs": {"acceleration": "a"},
                },
            }
        },
    }
    (folder / "driven.yaml").write_text(yaml.safe_dump(driven), encoding="utf-8")
    axis = {"scenario.actors.lead.driver.file": ["./one.fmu", "./other.fmu"]}
    uses = {"scenarios": [{"use": "driven", "sweep": {"parameters": axis}}]}
    with pytest.raises(SpecError, match="another FMU drives an actor"):
        check(load(**uses))
    driver = driven["actors"]["lead"]["driver"]
    driver["start"] = {"table": "./lead_braking.yaml"}
    (folder / "driven.yaml").write_text(yaml.safe_dump(driven), encoding="utf-8")
    with pytest.raises(SpecError, match="means a file or folder in no identity"):
        check(load(scenarios=[{"use": "driven"}]))


def test_fault_without_a_meaning_for_its_target(load: Load) -> None:
    bias = {"model": "bias", "signal": "range_rate", "size": "1 m/s"}
    for fault, key, said in (
        ({"model": "blackout"}, "model", "blackout is about pixels, and a camera delivers"),
        (bias, "signal", "and not range_rate"),
    ):
        written = {"id": "odd", "target": "sensors.front_camera", "onset": {"at": "1 s"}, **fault}
        files = load(faults=[onset("time >= 1 s"), written])
        caught = refused(SpecError, checking.check_fits, files, says=said)
        assert caught.where == files.odd.locate(("faults", 1, key))
    # What an architecture does not have is none of it.
    checking.check_fits(load(faults=[{**onset("time >= 1 s"), "target": "sensors.sonar"}]))


def budgets(load: Load, **times: dict[str, float]) -> list[str]:
    """Give FSRs detection and reaction times, and say which goals they exceed."""
    concept = load().concept.spec
    none: dict[str, Any] = {"fdti": None, "frti": None}
    requirements = tuple(
        item.model_copy(update={**none, **times.get(item.id.replace("-", ""), {})})
        for item in concept.requirements
    )
    return list(checking.over_budget(concept.model_copy(update={"requirements": requirements})))


def test_times_that_exceed_the_ftti_together(load: Load) -> None:
    # SG-02 has an FTTI of 1 s; FSR-03 and FSR-04 serve it.
    assert budgets(load, FSR03={"fdti": 0.4, "frti": 0.6}) == []
    assert budgets(load, FSR03={"fdti": 0.4}, FSR04={"frti": 0.6}) == []
    [notice] = budgets(load, FSR03={"fdti": 0.4, "frti": 0.7})
    assert notice == "SG-02: FDTI 0.4 s and FRTI 0.7 s of FSR-03 exceed its FTTI of 1 s"
    [notice] = budgets(load, FSR03={"fdti": 0.4}, FSR04={"frti": 0.7})
    assert "of FSR-03 and FSR-04 exceed its FTTI of 1 s" in notice
    # One with both times stands for itself.
    times = {"FSR03": {"fdti": 0.1, "frti": 0.8}, "FSR04": {"fdti": 0.8, "frti": 0.1}}
    assert budgets(load, **times) == []


# --- what can never act, and what makes no difference


def drop(**changes: Any) -> dict[str, Any]:
    return {**onset("time > 1 s"), **changes}


def test_fault_that_can_never_act_is_refused_at_its_place(load: Load) -> None:
    at, when, duration = ("onset", "at"), ("onset", "when"), ("duration",)
    cases: tuple[tuple[dict[str, Any], str, tuple[str, ...]], ...] = (
        ({"onset": {"at": "100 s"}}, "it begins at 100 s", at),
        # The horizon of a cut-in is 12 s, with a tail of 13 s.
        ({"onset": {"at": "12.05 s"}}, "it begins at 12.05 s", at),
        ({"onset": {"between": ["11 s", "13 s"]}}, "it begins at 13 s", ("onset", "between")),
        ({"onset": {"when": "time >= 100 s"}}, "'time >= 100 s' cannot hold", when),
        ({"onset": {"when": "time > 5 s and time < 5 s"}}, "cannot hold", when),
        ({"onset": {"when": "cutter.gap < 9 m and not time < 20 s"}}, "cannot hold", when),
        ({"onset": {"when": "time == 1.02 s or cut_in.begun and 2 < 1"}}, "cannot hold", when),
        ({"onset": {"when": "if_(time < 20 s, 0, cutter.gap / 1 m) > 0"}}, "cannot hold", when),
        ({"duration": "0 s"}, "it lasts 0 s", duration),
        ({"onset": {"at": "2 s"}, "duration": "0 s"}, "it lasts 0 s", duration),
        ({"onset": {"at": "2.01 s"}, "duration": "0.03 s"}, "between two decisions", at),
    )
    for changes, said, place in cases:
        files = load(faults=[drop(**changes)], scenarios=[{"use": "cut_in"}])
        caught = refused(SpecError, check, files, says="fault out never acts in scenario cut_in")
        assert said in caught.message
        assert caught.where == files.odd.locate(("faults", 0, *place))


def test_fault_that_may_act_passes(load: Load) -> None:
    changes: tuple[dict[str, Any], ...] = (
        {"onset": {"at": "12 s"}},
        {"onset": {"at": "0 s"}, "duration": "0.01 s"},
        {"onset": {"when": "time >= 12 s"}},
        {"onset": {"when": "cutter.gap <= 0.5 m"}},
        {"onset": {"when": "time >= 100 s or cutter.gap <= 5 m"}},
        {"onset": {"when": "time in [3 s, 100 s]"}},
        {"onset": {"at": "2.01 s"}, "duration": "0.03 s", "every": "0.32 s"},
    )
    for change in changes:
        check(load(faults=[drop(**change)], scenarios=[{"use": "cut_in"}]))


def test_swept_point_at_which_a_fault_never_acts_is_refused(load: Load) -> None:
    for axis, values, fault in (
        ("faults.out.onset.at", ["2 s", "20 s"], {"onset": {"at": "1 s"}}),
        ("faults.out.duration", ["2 s", "0 s"], {"duration": "1 s"}),
        ("lateral_speed", ["1 m/s", "2 m/s"], {"onset": {"when": "lateral_speed < 1.5 m/s"}}),
    ):
        scenarios = [{"use": "cut_in", "sweep": {"parameters": {axis: values}}}]
        with pytest.raises(SpecError, match=r"example.yaml:\d+:\d+: fault out never acts"):
            check(load(faults=[drop(**fault)], scenarios=scenarios))


def test_parameter_that_only_a_relation_names(project: Path, load: Load) -> None:
    path = project / "scenarios_db" / "motorway" / "cut_in.yaml"
    replace(path, "parameters:\n", "parameters:\n  shade: {default: 1, range: [0, 9]}\n")
    sweep: dict[str, Any] = {"parameters": {"shade": [1, 2, 3]}}
    said = r"example.yaml:\d+:\d+: shade: nothing that happens in scenario cut_in depends on it"
    with pytest.raises(SweepError, match=said):
        check(load(sweep))
    (notice,) = checking.check_cases(expand(load({**sweep, "where": ["shade < 3"]})))
    assert notice.startswith("shade: nothing that happens in scenario cut_in depends on it; it")
    begins = drop(onset={"when": "time >= shade * 1 s"})
    assert not checking.check_cases(
        expand(load(faults=[begins], scenarios=[{"use": "cut_in", "sweep": sweep}]))
    )


def test_axis_that_changes_no_run_is_refused(load: Load) -> None:
    for axis, values in (
        ("architecture.cost", [1, 2]),
        ("architecture.title", ["one", "other"]),
        ("architecture.channels.safety.realises", ["safety", "nominal"]),
        ("scenario.title", ["one", "other"]),
        ("scenario.tags.r157", ["4.4", "4.5"]),
        ("faults.out.text", ["one", "other"]),
    ):
        sweep = {"parameters": {axis: values, "gap": ["30 m", "40 m"]}}
        scenarios = [{"use": "cut_in", "sweep": sweep}]
        with pytest.raises(SweepError, match=f"{axis}: no run differs between {values[0]} and"):
            check(load(faults=[drop()], scenarios=scenarios))


def test_sensor_that_nothing_is_linked_to_tells_no_runs_apart(project: Path, load: Load) -> None:
    path = project / "odd" / "architectures" / "camera_radar.yaml"
    spare = "  spare: {kind: ground_truth, rate: 20 Hz, latency: 0.05 s}\n"
    replace(path, "sensors:\n", f"sensors:\n{spare}")
    swept = load({"parameters": {"architecture.sensors.spare.latency": ["0 s", "0.1 s"]}})
    refused(SweepError, check, swept, says=r"spare.latency: no run differs between 0 s and 0.1 s")
    concept = project / "odd" / "concepts" / "motorway_chauffeur.yaml"
    replace(concept, "always(not contact)", "always(not contact or sensor.spare.age < 1 s)")
    check(load({"parameters": {"architecture.sensors.spare.latency": ["0 s", "0.1 s"]}}))
    replace(concept, "sensor.spare.age < 1 s", "ego.speed < 1 m/s")
    replace(path, "links: [localisation, front_", "links: [spare, localisation, front_")
    check(load({"parameters": {"architecture.sensors.spare.latency": ["0 s", "0.1 s"]}}))


# --- what a sweep writes into a scenario is wrong in the ODD, not in the scenario's file


SCENARIO = "scenarios_db/motorway/cut_in.yaml"


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Project:
    return Project(tmp_path_factory.mktemp("authorship"))


def refusal(swept: Project, **use: Any) -> tuple[InputError, str]:
    """Plan an ODD that uses a cut-in; return the error and the line of the file it points to."""
    swept.write("odd/tested.yaml", {**MINI, "scenarios": [{"use": "cut_in", **use}]})
    caught = refused(InputError, swept.plan)
    where = known(caught.where)
    lines = Path(where.path).read_text("utf-8").splitlines()
    assert where.line <= len(lines)
    # A list stands in the line below its key.
    return caught, " ".join(lines[max(0, where.line - 2) : where.line])


def test_value_is_wrong_where_the_odd_gives_it(swept: Project) -> None:
    sun = "scenario.environment.sun_elevation"
    for axis, values, part in (
        (sun, ["200 deg"], "200 deg is beyond the zenith"),
        ("scenario.environment.fog_visibility", ["100 m", "0 m"], "0 m is not plausible"),
        ("scenario.environment.rain", ["-1 mm/h"], "environment.rain"),
        ("scenario.ego.lane", [7], "7 is no lane"),
    ):
        parameters = {"gap": ["30 m", "50 m"], axis: values, "lateral_speed": ["1 m/s"]}
        error, line = refusal(swept, sweep={"parameters": parameters})
        assert str(swept.odd) in str(error.where)
        assert part in error.message
        assert axis in line
    error, line = refusal(swept, parameters={sun: "200 deg"})
    assert str(swept.odd) in str(error.where)
    assert f"{sun}: 200 deg" in line


def test_formula_of_a_swept_parameter_is_wrong_at_the_parameter(tmp_path: Path) -> None:
    swept = Project(tmp_path / "project")
    with swept.edited(SCENARIO) as scenario:
        scenario["parameters"]["friction"]["range"] = [0, 1]
    sweep = {"parameters": {"gap": ["30 m"], "friction": [0.5, 0], "rain": ["0 mm/h"]}}
    error, line = refusal(swept, sweep=sweep)
    assert str(swept.odd) in str(error.where)
    assert "environment.friction: 0" in error.message
    assert "friction" in line


def test_what_is_wrong_together_is_wrong_where_the_odd_has_its_part(tmp_path: Path) -> None:
    swept = Project(tmp_path / "project")
    with swept.edited(SCENARIO) as scenario:
        scenario["environment"]["sun_elevation"] = "20 deg"
    axis = "scenario.environment.illumination"
    error, line = refusal(swept, sweep={"parameters": {axis: ["day", "night"]}})
    assert "the illumination is not day" in error.message
    assert str(swept.odd) in str(error.where)
    assert axis in line


def test_what_the_scenario_says_itself_is_wrong_in_its_file(tmp_path: Path) -> None:
    swept = Project(tmp_path / "project")
    with swept.edited(SCENARIO) as scenario:
        scenario["environment"]["sun_elevation"] = "200 deg"
    error, line = refusal(swept, sweep={"parameters": {"gap": ["30 m"]}})
    assert str(swept.folder / SCENARIO) in str(error.where)
    assert "sun_elevation: 200 deg" in line
    assert "with the ODD's values" not in error.message


@pytest.mark.parametrize(
    ("formula", "values", "is_idle"),
    [
        ("gap + 0 m * shade", [1, 2], True),
        ("gap + (shade - shade) * 1 m", [1, 2], True),
        ("max(gap, shade * 1 m)", [1, 2], True),
        ("max(gap, shade * 1 m)", [1, 900], False),
        ("gap + 0 m * shade", [1], False),
        ("gap + shade * 1 m", [1, 2], False),
    ],
)
def test_parameter_that_is_named_and_changes_nothing_is_refused(
    project: Path, load: Load, formula: str, values: list[int], *, is_idle: bool
) -> None:
    path = project / "scenarios_db" / "motorway" / "cut_in.yaml"
    replace(path, "parameters:\n", "parameters:\n  shade: {default: 1, range: [0, 999]}\n")
    replace(path, "gap: gap - relative_speed * 1 s", f"gap: {formula} - relative_speed * 1 s")
    files = load({"parameters": {"shade": values, "gap": ["30 m", "40 m"]}})
    if is_idle:
        with pytest.raises(SweepError, match="shade: nothing that happens"):
            checking.check_cases(expand(files))
    else:
        assert not checking.check_cases(expand(files))


@pytest.mark.parametrize(
    ("condition", "is_idle"),
    [
        ("cutter.gap <= gap + 0 m * shade", True),
        ("cutter.gap <= gap and shade > 0", True),
        ("cutter.gap * min(1, shade) <= gap", True),
        ("cutter.gap <= if_(shade > 5, 1 m, gap)", True),
        ("cutter.gap <= if_(shade > 1, 1 m, gap)", False),
        ("cutter.gap <= gap + 1 m * shade", False),
        ("cutter.gap * shade <= gap", False),
        ("cutter.gap <= gap or time / 1 s in [shade, 1]", False),
    ],
)
def test_parameter_of_a_condition_that_changes_no_part_of_it_is_refused(
    project: Path, load: Load, condition: str, *, is_idle: bool
) -> None:
    path = project / "scenarios_db" / "motorway" / "cut_in.yaml"
    replace(path, "parameters:\n", "parameters:\n  shade: {default: 1, range: [0, 999]}\n")
    replace(path, "when: cutter.gap <= gap", f"when: {condition}")
    files = load({"parameters": {"shade": [1, 2], "gap": ["30 m", "40 m"]}})
    if is_idle:
        with pytest.raises(SweepError, match="shade: nothing that happens"):
            checking.check_cases(expand(files))
    else:
        assert not checking.check_cases(expand(files))
