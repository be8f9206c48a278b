"""ASIL determination and the references of a concept."""

from __future__ import annotations

import itertools
from typing import Any

import pytest
from pydantic import ValidationError

from adeye.spec.concept import ASIL_ORDER, Concept, determine_asil

TABLE = """
S1 E1 QM QM QM
S1 E2 QM QM QM
S1 E3 QM QM A
S1 E4 QM A B
S2 E1 QM QM QM
S2 E2 QM QM A
S2 E3 QM A B
S2 E4 A B C
S3 E1 QM QM A
S3 E2 QM A B
S3 E3 A B C
S3 E4 B C D
"""
"""ISO 26262-3:2018, table 4; columns C1 to C3."""


@pytest.mark.parametrize("line", TABLE.split("\n")[1:-1])
def test_every_cell_of_the_table(line: str) -> None:
    severity, exposure, *row = line.split()
    for controllability, asil in zip(("C1", "C2", "C3"), row, strict=True):
        assert determine_asil(severity, exposure, controllability) == asil


def test_asil_follows_the_sum_of_the_classes() -> None:
    for s, e, c in itertools.product(range(1, 4), range(1, 5), range(1, 4)):
        expected = {10: "D", 9: "C", 8: "B", 7: "A"}.get(s + e + c, "QM")
        assert determine_asil(f"S{s}", f"E{e}", f"C{c}") == expected


@pytest.mark.parametrize("classes", [("S0", "E4", "C3"), ("S3", "E0", "C3"), ("S3", "E4", "C0")])
def test_class_zero_has_no_asil(classes: tuple[str, str, str]) -> None:
    assert determine_asil(*classes) is None


@pytest.mark.parametrize("classes", [("S4", "E4", "C3"), ("S3", "e4", "C3"), ("S3", "E4", "")])
def test_unknown_class_is_an_error_never_qm(classes: tuple[str, str, str]) -> None:
    with pytest.raises(ValueError, match="is not one of"):
        determine_asil(*classes)


def event(name: str, exposure: str = "E4") -> dict[str, Any]:
    text = dict.fromkeys(
        (
            "function",
            "malfunction",
            "situation",
            "severity_rationale",
            "exposure_rationale",
            "controllability_rationale",
        ),
        "text",
    )
    classes = {"severity": "S3", "exposure": exposure, "controllability": "C3"}
    return {"id": name, **text, **classes}


def content() -> dict[str, Any]:
    goal = {
        "id": "SG-1",
        "text": "text",
        "hazardous_events": ["HE-1", "HE-2"],
        "safe_state": "standstill",
        "ftti": "1 s",
        "ftti_rationale": "text",
    }
    requirement = {
        "id": "FSR-1",
        "goals": ["SG-1"],
        "text": "text",
        "formula": "always(not contact)",
        "threshold_source": "text",
        "asil": "D",
        "allocation": ["switch"],
    }
    element = {"id": "switch", "kind": "arbiter", "text": "text", "asil_capability": "D"}
    return {
        "concept": "example",
        "title": "Example",
        "hazardous_events": [event("HE-1", "E2"), event("HE-2")],
        "safety_goals": [goal],
        "elements": [element],
        "requirements": [requirement],
    }


def test_goal_has_the_highest_asil_of_its_events() -> None:
    concept = Concept.model_validate(content())
    assert concept.hazardous_events[0].asil == "B"
    assert concept.goal_asil("SG-1") == "D"
    assert ASIL_ORDER.index("D") == 4


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("safety_goals", 0, "hazardous_events"), ["HE-9"]),
        (("requirements", 0, "goals"), ["SG-9"]),
        (("requirements", 0, "allocation"), ["nobody"]),
        (("requirements", 0, "bound"), {"metric": "min_ttc_s", "at_least": 1.0}),
        (
            ("waivers",),
            [{"requirement": "X", "reason": "r", "author": "a", "expires": "2030-01-01"}],
        ),
        (("hazardous_events",), [event("HE-1"), event("HE-1")]),
        (("requirements", 0, "asil"), "E"),
    ],
)
def test_broken_references_are_refused(path: tuple[Any, ...], value: Any) -> None:
    broken = content()
    place = broken
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    with pytest.raises(ValidationError):
        Concept.model_validate(broken)


def test_verdict_depends_on_the_measure_not_on_the_text() -> None:
    first = Concept.model_validate(content()).requirements[0]
    other = content()
    other["requirements"][0]["text"] = "another text"
    assert Concept.model_validate(other).requirements[0].judged() == first.judged()
    other["requirements"][0]["formula"] = "always(standstill)"
    assert Concept.model_validate(other).requirements[0].judged() != first.judged()


def with_parameters(measure: dict[str, Any], parameters: dict[str, Any]) -> Any:
    made = content()
    made["requirements"][0].pop("formula", None)
    made["requirements"][0].pop("bound", None)
    made["requirements"][0] |= {**measure, "parameters": parameters}
    return Concept.model_validate(made).requirements[0]


def test_parameters_are_kept_in_si_and_read_again_as_they_were_stored() -> None:
    item = with_parameters({"bound": {"metric": "m", "at_most": "limit"}}, {"limit": "36 km/h"})
    assert item.parameters == {"limit": "10.0 m/s"}
    assert item.constants == {"limit": (10.0, (1, -1, 0))}
    assert item.measure == "m <= limit where limit = 10.0 m/s"
    stored = item.model_dump(mode="json")
    assert stored["bound"]["at_most"] == "limit"
    assert type(item).model_validate(stored) == item
    assert item.judged()["parameters"] == {"limit": "10.0 m/s"}


def test_an_fsr_without_parameters_is_what_it_was_before_there_were_any() -> None:
    item = Concept.model_validate(content()).requirements[0]
    assert "parameters" not in item.model_dump(mode="json")
    assert "parameters" not in item.judged()


@pytest.mark.parametrize(
    ("measure", "parameters", "message"),
    [
        ({"bound": {"metric": "m", "at_most": "tua"}}, {"tau": 1}, "there is no parameter 'tua'"),
        ({"bound": {"metric": "m", "at_most": 1}}, {"tau": 1}, "the bound does not name 'tau'"),
        ({"formula": "a"}, {"tau": "1 parsec"}, "'1 parsec' is not a quantity"),
        ({"formula": "a"}, {"tau": True}, "True is not a quantity"),
        ({"formula": "a"}, {"Tau": 1}, "should match pattern"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(
    measure: dict[str, Any], parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValidationError, match=message):
        with_parameters(measure, parameters)
