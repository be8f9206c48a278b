"""``plan``, ``signals``, ``coverage`` and ``dependencies``: what they print."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from adeye.analysis import dependence
from adeye.campaign.plan import SignalRow, make_plan
from adeye.cli import plan
from adeye.cli.new import project_files, write_files
from adeye.cli.plan import _fault_entries
from adeye.spec.load import shipped
from tests.project import ROOT, Executed

# --- ``plan`` and ``signals`` on the starter project


@pytest.fixture
def odd(folder: Path) -> str:
    """Write the starter project."""
    write_files(folder, project_files())
    return "odd/first.yaml"


def test_factors_and_total_are_printed(adeye: Any, odd: str) -> None:
    ended = adeye("plan", odd).ok
    lines = ended.out.splitlines()
    assert lines[0].split()[3:5] == ["Fault", "entries"]
    row = next(line.split() for line in lines if "cut_in   " in line)
    assert row[2:4] == ["2", "3"]
    assert "3 fault entries: none, front_camera_out, nominal_silent" in lines
    assert "2 x 3 x 1 x 1 + 2 x 3 x 1 x 1 = 12" in ended.out.replace("\N{MULTIPLICATION SIGN}", "x")
    assert "Traffic batch (reference-1)" in ended.out
    assert "driver stepwise" in ended.out
    assert "gate: camera_radar" in ended.out


def test_json_adds_up_and_nothing_is_written(adeye: Any, odd: str, folder: Path) -> None:
    document = adeye("plan", odd, "--json").document
    assert document["test_cases"] == 12
    assert sum(factor["test_cases"] for factor in document["factors"]) == 12
    assert document["axes"] == {"cut_in": ["gap"], "lead_braking": ["deceleration"]}
    assert document["engine"]["backend"] == "batch"
    assert document["driver"] == "stepwise"
    assert not (folder / ".adeye").exists()


def test_test_cases_are_listed_with_their_values_and_ids(adeye: Any, odd: str) -> None:
    listed = adeye("plan", odd, "--list", "--json").document["test_cases"]
    cases = make_plan(odd).cases
    assert [item["test_case"] for item in listed] == [case.digest for case in cases]
    assert [item["fault_entry"] for item in listed] == [case.fault_entry for case in cases]
    assert listed[0]["values"] == {"gap": "45 m"}
    assert listed[-1]["values"] == {"deceleration": "6 m/s²"}
    chosen = adeye("plan", odd, "-k", "gap=60 and not nominal_silent").ok.out
    rows = [item for item in listed if item["values"] == {"gap": "60 m"}]
    assert [item["test_case"][:10] in chosen for item in listed] == [
        item in rows and item["fault_entry"] != "nominal_silent" for item in listed
    ]
    assert "Test cases: 2 of 12" in chosen
    assert "no test case is nothing" in adeye("plan", odd, "-k", "nothing").refused


SHIPPED = "odd/motorway_chauffeur.yaml"
SCENARIO = "scenarios_db/motorway/cut_in.yaml"
ARCHITECTURE = "odd/architectures/camera_radar.yaml"
CONCEPT = "odd/concepts/motorway_chauffeur.yaml"
BROKEN: dict[str, list[tuple[str, str, str, str]]] = {
    "records": [
        (SHIPPED, "seed: ", "sead: ", "no key 'sead'"),
        (SCENARIO, "horizon: 12 s", "horizon: 12 m", "horizon"),
        (SCENARIO, "lanes: 3", "lanes: many", "must be a whole number"),
        (ARCHITECTURE, "latch: true", "latch: perhaps", "must be true or false"),
        (CONCEPT, "severity: S3", "severity: S4", "severity"),
    ],
    "a record and what others say": [
        (SHIPPED, "seed: ", "sead: ", "no key 'sead'"),
        (SCENARIO, "gap - relative_speed", "gap - relative_sped", "Did you mean 'relative_speed'"),
        (SCENARIO, "rain: rain", "rain: rein", "Did you mean 'rain'"),
        (ARCHITECTURE, "realises: switch", "realises: swich", "no element of concept"),
    ],
    "records against each other": [
        (SHIPPED, "gap: [", "gapp: [", "'gapp'"),
        (SHIPPED, "deceleration: [", "decelerate: [", "'decelerate'"),
        (SHIPPED, "when: time", "when: tme", "nothing named 'tme'"),
        (CONCEPT, "always(not contact)", "always(not contct)", "Did you mean 'contact'"),
        (CONCEPT, "metric: max_", "metric: maxi_", "max_required_deceleration_mps2"),
    ],
}


@pytest.mark.parametrize("verb", ["plan", "run"])
@pytest.mark.parametrize("case", BROKEN)
def test_all_errors_of_all_files_come_at_once(
    adeye: Any, folder: Path, verb: str, case: str
) -> None:
    shutil.copytree(ROOT / "scenarios_db", folder / "scenarios_db")
    shutil.copytree(ROOT / "odd", folder / "odd")
    for name, old, new, _ in BROKEN[case]:
        path = folder / name
        text = path.read_text("utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), "utf-8")
    said = adeye(verb, SHIPPED).refused
    lines = [line for line in said.splitlines() if "Error: " in line]
    assert len(lines) == len(BROKEN[case]), said
    for name, _, new, what in BROKEN[case]:
        number = next(
            at
            for at, line in enumerate((folder / name).read_text("utf-8").splitlines(), 1)
            if new in line
        )
        assert any(f"{name}:{number}:" in line and what in line for line in lines), said
    assert f"{len(lines)} errors" in said


def test_differing_suites_are_summed(adeye: Any, odd: str, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = make_plan(Path(odd))
    first = plan.expansion.factors[0]
    other = replace(first, architecture="b", fault_entries=("none",), test_cases=2)
    expansion = replace(plan.expansion, factors=(first, other))
    changed = replace(plan, expansion=expansion, notices=("an axis is dead",))
    monkeypatch.setattr("adeye.campaign.plan.make_plan", lambda *_a, **_o: changed)
    ended = adeye("plan", odd)
    assert "Test cases: 8 = 8" in ended.out
    lines = [line for line in ended.out.splitlines() if "fault entr" in line]
    assert lines == [
        "3 fault entries of cut_in with camera_radar: none, front_camera_out, nominal_silent",
        "1 fault entry of cut_in with b: none",
    ]
    assert ended.err == "note: an axis is dead\n"


def test_fault_entries_are_listed_once_for_who_has_them(odd: str) -> None:
    first = make_plan(Path(odd)).expansion.factors[0]
    both, none = ("none", "f"), ("none",)
    lists = {"s": (both, both), "t": (none, none), "u": (both, none), "v": (both, none)}
    factors = [
        replace(first, scenario=scenario, architecture=name, fault_entries=entries)
        for scenario, found in lists.items()
        for name, entries in zip("ab", found, strict=True)
    ]
    assert _fault_entries(factors) == [
        "2 fault entries of s; u, v with a: none, f",
        "1 fault entry of t; u, v with b: none",
    ]
    assert _fault_entries(factors[:2]) == ["2 fault entries: none, f"]


def test_error_in_the_odd_has_file_and_line(adeye: Any, odd: str) -> None:
    text = Path(odd).read_text("utf-8").replace("gap: [45 m, 60 m]", "gap: [45 s]")
    Path(odd).write_text(text, encoding="utf-8")
    ended = adeye("plan", odd)
    assert ended.code == 2
    assert "odd/first.yaml:14:" in ended.err
    assert "Traceback" not in ended.err


def test_signals_have_unit_kind_and_owner(adeye: Any, odd: str) -> None:
    document = adeye("signals", odd, "--json").document
    rows = {row["name"]: row for row in document["signals"]}
    assert rows["ego.speed"]["unit"] == "m/s"
    assert rows["contact"]["kind"] == "boolean"
    assert rows["actor.lead.gap"]["scenarios"] == ["lead_braking"]
    assert rows["ego.speed"]["architectures"] == ["camera_radar"]


def test_signals_table_names_labels(adeye: Any, odd: str, monkeypatch: pytest.MonkeyPatch) -> None:
    labels = ("none", "request")
    row = SignalRow("switch.reason", "1", "enumeration", 1.0, "why", labels, ("cut_in",), ())
    monkeypatch.setattr("adeye.campaign.plan.signal_table", lambda _plan: [row])
    line = adeye("signals", odd).out.splitlines()[-1]
    assert " ".join(line.split()) == (
        "switch.reason enumeration 1 why (none, request) cut_in \N{EN DASH}"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        ("pairwise", "strength 2, 4 of 4 tuples feasible, all of these covered, 4 "),
        ("lhs, samples: 8", "lhs, 8 of 8 points; no random sample"),
        ("sobol, samples: 8, where: ['gap > 40 m']", "4 left out by relations, not repl"),
        ("random, samples: 8", "8 independent draws from declared distributions; relations exclu"),
    ],
)
def test_plan_tells_the_design(adeye: Any, odd: str, folder: Path, sweep: str, said: str) -> None:
    axes = "{ego_speed: [80 km/h, 120 km/h], gap: [30 m, 50 m]}"
    if "random" in sweep:
        axes = "{gap: {uniform: [30 m, 50 m]}}"
    whole = yaml.safe_load((folder / odd).read_text("utf-8"))
    (use,) = [item for item in whole["scenarios"] if item["use"] == "cut_in"]
    use["sweep"] = yaml.safe_load(f"{{design: {sweep}, parameters: {axes}}}")
    (folder / odd).write_text(yaml.safe_dump(whole), "utf-8")
    ended = adeye("plan", odd).ok
    assert said in ended.out
    designs = adeye("plan", odd, "--json").document["designs"]
    assert designs["cut_in"]["kind"] == use["sweep"]["design"]


# --- ``coverage``: a table, a JSON document, and what it refuses


ODD = str(shipped("odd") / "motorway_chauffeur.yaml")


@pytest.mark.slow
def test_plan_is_told_with_its_gaps(adeye: Any) -> None:
    ended = adeye("coverage", ODD).ok
    lines = ended.out.splitlines()
    assert lines[0] == "ODD motorway_chauffeur: 228 of 228 planned test cases count"
    (rain,) = [line for line in lines if line.startswith(" rain ")]
    assert "0.1 to 2.5 mm/h" in rain
    assert "feasible pairs are covered" in ended.out
    assert "--json lists all" in ended.out


@pytest.mark.slow
def test_json_lists_every_uncovered_pair(adeye: Any) -> None:
    document = adeye("coverage", ODD, "--json").document
    parts = document["table"]["coverage"]["combinations"]
    assert len(parts) == 7 + 21
    assert all(item["feasible"] == item["covered"] + len(item["uncovered"]) for item in parts)


def test_strength_one_has_no_pairs(adeye: Any) -> None:
    assert "pairs" not in adeye("coverage", ODD, "--strength", "1").out


def test_campaign_is_found_by_its_number(adeye: Any, mini: Executed) -> None:
    ended = adeye("coverage", "1", "--db", str(mini.db)).ok
    assert ended.out.startswith(f"Campaign {mini.summary.campaign[:10]} of mini: ")


def test_unknown_campaign_and_odd_are_input_errors(adeye: Any, mini: Executed) -> None:
    assert adeye("coverage", "77", "--db", str(mini.db)).code == 2
    assert "there is no such file" in adeye("coverage", "odd/none.yaml").refused


# --- ``dependencies``: tables, JSON, and what it refuses; ``plan`` counts the same


def test_table_says_what_is_shared_and_what_is_not(adeye: Any) -> None:
    ended = adeye("dependencies", ODD, "--architecture", "camera_radar").ok
    first, *rest = ended.out.strip().splitlines()
    assert first == (
        "camera_radar: safety and nominal share 9 things; "
        "no sensor, no ego estimate, no resource, no element"
    )
    text = "\n".join(rest)
    assert "legacy_camera" not in ended.out
    assert "simulate/channels/perception/step.py" in text
    assert "hooks.safety, hooks.nominal (map_shifted)" in text


def test_json_holds_every_pair_with_its_targets(adeye: Any) -> None:
    document = adeye("dependencies", ODD, "--json").document
    legacy, candidate = document["architectures"]
    assert (legacy["architecture"], candidate["architecture"]) == ("legacy_camera", "camera_radar")
    (pair,) = candidate["pairs"]
    assert (pair["first"], pair["second"], pair["unstated"]) == ("safety", "nominal", [])
    shared = {item["what"]: item for item in pair["shared"]}
    assert shared["nominal → safety"]["targets"] == ["links.safety.channels.nominal"]


def test_nothing_is_said_of_code_that_nobody_looked_into(
    adeye: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []
    for unread in ((), ("second",)):
        pair = dependence.ChannelPair("first", "second", (), (), unread)
        found = [dependence.Dependencies("plugged", "", (pair,))]
        monkeypatch.setattr(plan, "dependencies_of", lambda _, found=found: found)
        told.append(adeye("dependencies", ODD).ok.out)
    assert "no code" in told[0]
    assert "no code" not in told[1]
    assert "the own code of second imports and reads is not compared" in told[1]


@pytest.mark.slow
def test_plan_counts_what_the_table_lists(adeye: Any) -> None:
    document = adeye("dependencies", ODD, "--json").document
    lines = {
        item["architecture"]: sum(len(pair["shared"]) for pair in item["pairs"])
        for item in document["architectures"]
    }
    assert adeye("plan", ODD, "--json").document["shared"] == lines
    told = ", ".join(f"{name} {count}" for name, count in lines.items())
    assert adeye("plan", ODD).out.strip().endswith(f"(adeye dependencies): {told}")


@pytest.mark.slow
def test_single_channel_has_nobody_to_share_anything_and_no_line_in_the_plan(adeye: Any) -> None:
    odd = str(shipped("odd") / "sensor_study.yaml")
    ended = adeye("dependencies", odd, "--architecture", "study_camera")
    assert ended.out == "study_camera: one channel, with nobody to share anything\n"
    assert "Shared by channels" not in adeye("plan", odd).out


def test_architecture_that_is_not_there_is_a_usage_error(adeye: Any) -> None:
    said = adeye("dependencies", ODD, "--architecture", "camera_rader").refused
    assert "no architecture 'camera_rader'. Did you mean 'camera_radar'?" in said
