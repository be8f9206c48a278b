"""ODDs: attributes, bins, distributions, sweeps and gate."""

import copy
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.document import load_document
from adeye.spec.odd import CoverageBins, Distribution, Gate, Odd, Steps, Sweep
from adeye.spec.quantity import SI
from tests.motorway import fault
from tests.refusals import refused
from tests.stored import stored

TABLES = stored("definitions")


# --- ODDs: names resolve at their place, a design takes what is its own, limits are not empty -----

ROOT = Path(__file__).parents[2] / "odd"
SHIPPED = sorted(ROOT.glob("*.yaml"))
SMALL: dict[str, Any] = {
    "odd": "small",
    "scenarios": [{"use": "cut_in"}, {"use": "lead_braking", "faults": ["none", ["a", "b"]]}],
    "faults": [
        fault("a", "sensors.camera", "drop_out"), fault("b", "channels.nominal", "silent")
    ],
    "architectures": ["one.yaml"],
    "concept": "concept.yaml",
}  # fmt: skip


def small(**changes: Any) -> dict[str, Any]:
    """Return the small ODD with changes on top."""
    return {**copy.deepcopy(SMALL), **changes}


def places(content: dict[str, Any]) -> list[tuple[int | str, ...]]:
    """Return the places of everything that is refused."""
    caught = refused(ValidationError, Odd.model_validate, content)
    return [item["loc"] for item in caught.errors()]


@pytest.mark.parametrize("path", SHIPPED, ids=[path.stem for path in SHIPPED])
def test_shipped_odd_reads_back_from_its_stored_form(path: Path) -> None:
    spec = Odd.model_validate(load_document(path).value)
    stored = spec.model_dump(mode="json", by_alias=True)
    assert Odd.model_validate(stored, context=SI) == spec


def test_what_is_left_out_has_its_documented_default() -> None:
    spec = Odd.model_validate(SMALL)
    assert (spec.step, spec.seed, spec.replicates) == (0.05, 0, 1)
    assert (spec.outside, spec.max_test_cases, spec.gate) == ("refuse", 100_000, None)
    assert spec.scenarios[0].faults is None
    assert spec.scenarios[0].sweep.design == "full_factorial"


def test_scenario_used_twice_needs_another_id() -> None:
    twice = [{"use": "cut_in"}, {"use": "cut_in"}]
    assert places(small(scenarios=twice)) == [("scenarios", 1, "use")]
    twice[1]["as"] = "cut_in_rain"
    spec = Odd.model_validate(small(scenarios=twice))
    assert [use.name for use in spec.scenarios] == ["cut_in", "cut_in_rain"]


def test_faults_have_ids_of_their_own_and_none_is_no_fault() -> None:
    content = small(scenarios=[{"use": "cut_in"}])
    for name in ("a", "none"):
        content["faults"][1]["id"] = name
        assert places(content) == [("faults", 1, "id")]


@pytest.mark.parametrize("entry", ["c", ["a", "c"], ["none", "a"], ["a", "a"]])
def test_fault_entry_of_what_is_not_there_is_refused_at_its_place(entry: Any) -> None:
    scenarios = [{"use": "cut_in", "faults": ["a", entry]}]
    assert places(small(scenarios=scenarios)) == [("scenarios", 0, "faults", 1)]


def test_every_wrong_name_is_listed() -> None:
    content = small(scenarios=[{"use": "x", "faults": ["c", "d"]}, {"use": "x"}])
    assert places(content) == [
        ("scenarios", 1, "use"),
        ("scenarios", 0, "faults", 0),
        ("scenarios", 0, "faults", 1),
    ]


@pytest.mark.parametrize(("changes", "place"), TABLES["impossible value is refused"])
def test_impossible_value_is_refused(changes: dict[str, Any], place: list[str]) -> None:
    assert {loc[: len(place)] for loc in places(small(**changes))} == {tuple(place)}


def test_gate_tolerates_losses_in_si_units() -> None:
    gate = {"architectures": ["one"], "tolerance": {"m": 0.05, "m/s^2": 0, "1": 0.001}}
    read = Odd.model_validate(small(gate=gate)).gate
    assert read is not None
    assert read.tolerance == gate["tolerance"]
    # What came later is no part of the identity of who does not use it.
    bare = Gate(architectures=("one",))
    assert "tolerance" not in bare.model_dump()
    for unit, size, said in (
        ("km", 1.0, "'km' is no SI unit of a margin"),
        ("metre", 1.0, "Allowed: m, s"),
        ("m", -1.0, "greater than or equal to 0"),
        ("m", 2000.0, "less than or equal to 1000"),
    ):
        content = {"architectures": ["one"], "tolerance": {unit: size}}
        refused(ValidationError, Gate.model_validate, content, says=said)


def test_greatest_seed_fits_a_signed_column() -> None:
    assert Odd.model_validate(small(seed=2**63 - 1)).seed == 2**63 - 1


def test_sweep_that_is_none_is_refused() -> None:
    for sweep, said in TABLES["sweep that is none is refused"]:
        refused(ValidationError, Sweep.model_validate, sweep, says=said)


def test_axis_is_a_list_or_steps() -> None:
    steps = {"from": "1 m", "to": "2 m", "step": "0.5 m"}
    sweep = Sweep.model_validate({"parameters": {"gap": steps, "rain": ["0 mm/h", 1]}})
    assert isinstance(sweep.parameters["gap"], Steps)
    assert sweep.parameters["gap"].start == "1 m"
    assert sweep.parameters["rain"] == ("0 mm/h", 1)


# --- Bins that an ODD declares: in units, ascending, and no part of an ODD that has none ----------


def test_edges_are_read_in_their_units_and_stored_in_si() -> None:
    bins = CoverageBins.model_validate({"ego_speed": ["0 km/h", "36 km/h"]})
    assert bins.ego_speed == (0.0, 10.0)
    stored = bins.model_dump(mode="json")
    assert stored == {"ego_speed": [0.0, 10.0]}
    assert CoverageBins.model_validate(stored, context=SI) == bins


def test_kinds_of_actor_need_no_order() -> None:
    content = {"actors": ["truck", "car"], "sun_elevation": ["0 deg", "10 deg"]}
    bins = CoverageBins.model_validate(content)
    assert bins.actors == ("truck", "car")
    assert bins.model_dump(mode="json")["actors"] == ["truck", "car"]


def test_edges_that_make_no_bins_are_refused() -> None:
    for content, said in TABLES["edges that make no bins are refused"]:
        refused(ValidationError, CoverageBins.model_validate, content, says=said)


# --- Distributions as a sweep writes them: one kind each, complete, and written without the rest --


@pytest.mark.parametrize("content", TABLES["what is written is what is stored"])
def test_what_is_written_is_what_is_stored(content: dict[str, Any]) -> None:
    made = Distribution.model_validate(content)
    assert made.kind == next(iter(content))
    assert made.model_dump(mode="json") == content


def test_what_is_no_distribution_is_refused() -> None:
    for content, said in TABLES["what is no distribution is refused"]:
        refused(ValidationError, Distribution.model_validate, content, says=said)
