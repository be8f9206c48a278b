"""Decompositions in concept files: what is legal, what is refused, and with which words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
import yaml
from pydantic import ValidationError

from adeye.errors import SpecError
from adeye.spec.concept import Concept, asil_problems, parents, scheme
from adeye.spec.document import load_document, validate
from adeye.spec.load import _check_asil, _load
from adeye.spec.quantity import SI

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

TEXTS = dict.fromkeys(
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


def fsr(name: str, asil: str, *elements: str, goals: tuple[str, ...] = ("SG-1",)) -> dict[str, Any]:
    return {
        "id": name,
        "goals": list(goals),
        "text": "text",
        "formula": "always(not contact)",
        "threshold_source": "text",
        "asil": asil,
        "allocation": list(elements),
    }


def content() -> dict[str, Any]:
    """Write a concept with D into B(D) and B(D)."""
    classes = {"severity": "S3", "exposure": "E4", "controllability": "C3"}
    element = {"kind": "sensor", "text": "text", "asil_capability": "D"}
    return {
        "concept": "two_sensors",
        "title": "Two sensors",
        "hazardous_events": [
            {"id": "HE-1", **TEXTS, **classes},
            {"id": "HE-2", **TEXTS, **classes, "exposure": "E3"},
        ],
        "safety_goals": [
            {
                "id": f"SG-{number}",
                "text": "text",
                "hazardous_events": [f"HE-{number}"],
                "safe_state": "standstill",
                "ftti": "1 s",
                "ftti_rationale": "text",
            }
            for number in (1, 2)
        ],
        "elements": [
            {"id": "camera", **element, "resources": ["power_a", "clock"]},
            {"id": "radar", **element, "resources": ["power_b", "clock"]},
        ],
        "requirements": [
            fsr("FSR-1", "D", "camera", "radar"),
            fsr("FSR-1a", "B(D)", "camera"),
            fsr("FSR-1b", "B(D)", "radar"),
        ],
        "decompositions": [
            {
                "requirement": "FSR-1",
                "into": ["FSR-1a", "FSR-1b"],
                "independence": "light and radio",
                "dfa": ["DFA-1"],
            }
        ],
        "dependent_failures": [
            {
                "id": "DFA-1",
                "covers": ["clock"],
                "argument": "each has a clock of its own to fall back on",
                "owner": "safety engineer",
                "valid_until": "2999-12-31",
            }
        ],
    }


def read(tmp_path: Path, concept: dict[str, Any]) -> Concept:
    """Read it from a file, as an ODD does."""
    path = tmp_path / "concept.yaml"
    path.write_text(yaml.safe_dump(concept, sort_keys=False), encoding="utf-8")
    loaded = _load(path, Concept)
    _check_asil(loaded)
    return loaded.spec


def test_legal_decomposition_is_read_with_its_scheme(tmp_path: Path) -> None:
    concept = read(tmp_path, content())
    (item,) = concept.decompositions
    assert scheme(concept, item) == "B(D) + B(D)"
    assert parents(concept) == {"FSR-1a": "FSR-1", "FSR-1b": "FSR-1"}
    assert [item.asil for item in concept.requirements] == ["D", "B(D)", "B(D)"]


@pytest.mark.parametrize("pair", [("C(D)", "A(D)"), ("D(D)", "QM(D)"), ("QM(D)", "D(D)")])
def test_every_scheme_of_d_is_legal(tmp_path: Path, pair: tuple[str, str]) -> None:
    made = content()
    for requirement, asil in zip(made["requirements"][1:], pair, strict=True):
        requirement["asil"] = asil
    assert list(asil_problems(read(tmp_path, made))) == []


def test_decomposition_goes_on_stepwise(tmp_path: Path) -> None:
    made = content()
    made["requirements"] += [fsr("FSR-2", "A(D)", "camera"), fsr("FSR-3", "A(D)", "radar")]
    step = {"requirement": "FSR-1a", "into": ["FSR-2", "FSR-3"], "independence": "text"}
    made["decompositions"].append(step)
    concept = read(tmp_path, made)
    assert scheme(concept, concept.decompositions[1]) == "A(D) + A(D)"


def test_stored_concept_is_read_again_as_it_was() -> None:
    made = content()
    made["hazardous_events"][0] |= {"exposure_method": "frequency", "scenarios": ["cut_in"]}
    made["safety_goals"][0] |= {
        "emergency_operation": "drive slowly",
        "eotti": "20 s",
        "eotti_rationale": "text",
    }
    made["elements"][0] |= {"supplier": "one", "software": ["tracker"], "provides": ["objects"]}
    made["elements"][1] |= {"consumes": ["objects"]}
    made["assumptions"] = [
        {"id": "AS-1", "text": "dry", "owner": "me", "valid_until": "2999-12-31"}
    ]
    made["requirements"][0] |= {
        "type": "fault_tolerance",
        "operating_modes": ["automated"],
        "safe_state": "standstill",
        "emergency_operation_interval": "10 s",
        "redundancy": "radar",
        "assumptions": ["AS-1"],
    }
    concept = Concept.model_validate(made)
    stored = concept.model_dump(mode="json")
    assert Concept.model_validate(stored, context=SI) == concept
    assert stored["safety_goals"][0]["eotti"] == 20.0


def test_content_without_the_new_keys_has_none_of_them() -> None:
    made = content()
    for key in ("decompositions", "dependent_failures"):
        del made[key]
    for requirement in made["requirements"]:
        requirement["asil"] = "D"
    dumped = Concept.model_validate(made).model_dump(mode="json")
    assert set(dumped) == {
        "concept", "title", "hazardous_events", "safety_goals", "elements", "requirements",
        "assumptions", "waivers",
    }  # fmt: skip
    assert not {"type", "safe_state", "redundancy"} & set(dumped["requirements"][0])
    assert not {"eotti", "emergency_operation"} & set(dumped["safety_goals"][0])
    assert not {"scenarios", "exposure_method"} & set(dumped["hazardous_events"][0])


def test_judged_part_of_a_requirement_has_nothing_new() -> None:
    requirement = Concept.model_validate(content()).requirements[1]
    assert set(requirement.judged()) == {
        "id", "formula", "bound", "on_contact", "applies", "scenarios"
    }  # fmt: skip


def asil(number: int, word: str) -> Callable[[dict[str, Any]], None]:
    return lambda made: made["requirements"][number].update(asil=word)


def decomposition(**changes: Any) -> Callable[[dict[str, Any]], None]:
    return lambda made: made["decompositions"][0].update(changes)


@pytest.mark.parametrize(
    ("flaw", "message"),
    [
        (
            asil(2, "A(D)"),
            r"B\(D\) \+ A\(D\) is no decomposition of FSR-1 \(D\)\. "
            r"Allowed: B\(D\) \+ B\(D\), C\(D\) \+ A\(D\), D\(D\) \+ QM\(D\)",
        ),
        (asil(2, "B(C)"), r"FSR-1b comes of a decomposition of ASIL D, and has B\(C\)\. .*B\(D\)"),
        (asil(1, "B"), r"FSR-1a comes of a decomposition of ASIL D, and has B\. .*as in B\(D\)"),
        (asil(1, "QM"), r"FSR-1a comes of .* has QM\. .*as in QM\(D\)"),
        (
            lambda made: made["requirements"].append(fsr("FSR-4", "QM(D)", "camera")),
            r"FSR-4 has ASIL QM\(D\) and comes of no decomposition\. Write QM, or",
        ),
        (
            lambda made: made["requirements"].append(fsr("FSR-4", "B", "camera")),
            "FSR-4 has ASIL B, below D of SG-1. Set it to D, or decompose",
        ),
        (
            lambda made: made["requirements"].append(fsr("FSR-4", "D(D)", "camera")),
            r"FSR-4 has ASIL D\(D\) and comes of no decomposition\. Write D",
        ),
        (
            lambda made: made["requirements"][1].update(goals=["SG-2"]),
            "FSR-1a does not serve SG-1, as FSR-1 does",
        ),
        (
            lambda made: made["requirements"][1].update(goals=["SG-1", "SG-2"]),
            r"FSR-1a has ASIL B\(D\), below C of SG-2",
        ),
    ],
    ids=lambda item: "" if callable(item) else item[:30],
)
def test_illegal_one_is_refused_with_what_is_allowed(
    tmp_path: Path, flaw: Callable[[dict[str, Any]], None], message: str
) -> None:
    made = content()
    flaw(made)
    with pytest.raises(SpecError, match=message) as caught:
        read(tmp_path, made)
    assert caught.value.where is not None
    assert caught.value.where.line > 1


@pytest.mark.parametrize(
    ("flaw", "message"),
    [
        (decomposition(requirement="FSR-9"), "no requirement 'FSR-9'. Did you mean"),
        (decomposition(into=["FSR-1a", "FSR-9"]), "no requirement 'FSR-9'"),
        (decomposition(into=["FSR-1a", "FSR-1a"]), "'FSR-1a' is a child of 'FSR-1' already"),
        (decomposition(into=["FSR-1", "FSR-1a"]), "'FSR-1' is decomposed into itself"),
        (decomposition(into=["FSR-1a"]), "at least 2 items"),
        (decomposition(dfa=["DFA-9"]), "no record in dependent_failures 'DFA-9'"),
        (
            lambda made: made["dependent_failures"][0].update(covers=["clocks"]),
            "no resource, software, supplier or element 'clocks'. Did you mean 'clock'",
        ),
        (
            lambda made: made["dependent_failures"].append(made["dependent_failures"][0]),
            "'DFA-1' is defined twice",
        ),
        (
            lambda made: made["decompositions"].append(made["decompositions"][0]),
            "'FSR-1' is decomposed twice",
        ),
        (
            lambda made: made["requirements"][0].update(assumptions=["AS-9"]),
            "'AS-9' is none of nothing",
        ),
        (lambda made: made["safety_goals"][0].update(eotti="5 s"), "together, or none of them"),
    ],
    ids=lambda item: "" if callable(item) else item[:30],
)
def test_reference_that_leads_nowhere_is_refused(
    flaw: Callable[[dict[str, Any]], None], message: str
) -> None:
    made = content()
    flaw(made)
    with pytest.raises(ValidationError, match=message):
        Concept.model_validate(made)


def test_message_has_the_line_of_the_reference(tmp_path: Path) -> None:
    made = content()
    made["decompositions"][0]["dfa"] = ["DFA-9"]
    path = tmp_path / "concept.yaml"
    path.write_text(yaml.safe_dump(made, sort_keys=False), encoding="utf-8")
    line = path.read_text("utf-8").splitlines().index("  - DFA-9") + 1
    with pytest.raises(SpecError, match=f"concept.yaml:{line}:"):
        validate(load_document(path), Concept)
