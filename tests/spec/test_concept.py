"""Concepts: hazards, goals, elements, requirements, ASIL, decomposition and budgets."""

import itertools
from itertools import combinations_with_replacement
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import pytest
import yaml
from pydantic import ValidationError

from adeye.errors import InputError, InputErrors, SpecError
from adeye.spec.asil import (
    ASIL_ORDER,
    RequirementAsil,
    determine_asil,
    goal_of,
    own_asil,
    rank,
    scheme_text,
    schemes,
)
from adeye.spec.concept import (
    Budget,
    Concept,
    Element,
    asil_problems,
    budgets_of,
    causes,
    parents,
    scheme,
    spelled_twice,
    unprovided,
)
from adeye.spec.document import load_document, validate
from adeye.spec.load import _check_asil, _load
from adeye.spec.quantity import SI
from adeye.units import shown
from tests.refusals import refused
from tests.stored import known, stored

TABLES = stored("definitions")


# --- ASIL determination and the references of a concept -------------------------------------------

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
    for s, e, c in itertools.product(range(4), range(5), range(4)):
        expected = {10: "D", 9: "C", 8: "B", 7: "A"}.get(s + e + c, "QM")
        # A class of zero has no ASIL.
        assert determine_asil(f"S{s}", f"E{e}", f"C{c}") == (expected if s * e * c else None)


def test_unknown_class_is_an_error_never_qm() -> None:
    for classes in (("S4", "E4", "C3"), ("S3", "e4", "C3"), ("S3", "E4", "")):
        refused(ValueError, determine_asil, *classes, says="is not one of")


def event(name: str, exposure: str = "E4") -> dict[str, Any]:
    names = ("function", "malfunction", "situation")
    classes = {"severity": "S3", "exposure": exposure, "controllability": "C3"}
    return {
        "id": name,
        **dict.fromkeys((*names, *(f"{kind}_rationale" for kind in classes)), "text"),
        **classes,
    }


def goal(name: str, *events: str) -> dict[str, Any]:
    about = {"id": name, "text": "text", "hazardous_events": list(events)}
    return {**about, "safe_state": "standstill", "ftti": "1 s", "ftti_rationale": "text"}


def content() -> dict[str, Any]:
    element = {"id": "switch", "kind": "arbiter", "text": "text", "asil_capability": "D"}
    return {
        "concept": "example",
        "title": "Example",
        "hazardous_events": [event("HE-1", "E2"), event("HE-2")],
        "safety_goals": [goal("SG-1", "HE-1", "HE-2")],
        "elements": [element],
        "requirements": [fsr("FSR-1", "D", "switch")],
    }


def test_goal_has_the_highest_asil_of_its_events() -> None:
    concept = Concept.model_validate(content())
    assert concept.hazardous_events[0].asil == "B"
    assert concept.goal_asil("SG-1") == "D"
    assert ASIL_ORDER.index("D") == 4


def changed(made: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    """Put a value at a dotted path of a concept; the number after the last is one more."""
    place: Any = made
    *folders, last = path.split(".")
    for part in folders:
        place = place[int(part) if part.isdigit() else part]
    if not last.isdigit():
        place[last] = value
    elif int(last) < len(place):
        place[int(last)] = value
    else:
        place.append(value)
    return made


WAIVER = {"requirement": "X", "reason": "r", "author": "a", "expires": "2030-01-01"}


def test_broken_references_are_refused() -> None:
    for path, value in (
        ("safety_goals.0.hazardous_events", ["HE-9"]),
        ("requirements.0.goals", ["SG-9"]),
        ("requirements.0.allocation", ["nobody"]),
        ("requirements.0.bound", {"metric": "min_ttc_s", "at_least": 1.0}),
        ("waivers", [WAIVER]),
        ("hazardous_events", [event("HE-1"), event("HE-1")]),
        ("requirements.0.asil", "E"),
        ("requirements.0.text", " \u200b."),
    ):
        refused(ValidationError, Concept.model_validate, changed(content(), path, value))


def test_requirements_have_a_column_of_results_each() -> None:
    made = content()
    first = made["requirements"][0]
    made["requirements"].append({**first, "id": first["id"].swapcase()})
    refused(ValidationError, Concept.model_validate, made, says="would be one column of results")


def test_waiver_needs_a_reason_and_an_author_not_what_stands_for_them() -> None:
    own = {**WAIVER, "requirement": content()["requirements"][0]["id"]}
    Concept.model_validate(changed(content(), "waivers", [own]))
    for change in (
        {"reason": "TBD"},
        {"reason": "n/a"},
        {"author": "TODO"},
        {"reason": "t.b.d. (J)"},
    ):
        made = changed(content(), "waivers", [own | change])
        refused(ValidationError, Concept.model_validate, made, says="holds the place of one")


def test_verdict_depends_on_the_measure_not_on_the_text() -> None:
    first = Concept.model_validate(content()).requirements[0]
    other = content()
    other["requirements"][0] |= {"text": "another text", "tags": {"team": "brakes"}}
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


def test_parameters_that_do_not_fit_are_refused() -> None:
    for measure, parameters, message in TABLES["parameters that do not fit are refused"]:
        refused(ValidationError, with_parameters, measure, parameters, says=message)


# --- Decomposition of ASIL: the eight schemes, and no other ---------------------------------------

TABLE_OF_ASIL = {
    "D": {("C", "A"), ("B", "B"), ("D", "QM")},
    "C": {("B", "A"), ("C", "QM")},
    "B": {("A", "A"), ("B", "QM")},
    "A": {("A", "QM")},
    "QM": set(),
}
"""ISO 26262-9:2018, clause 5."""


@pytest.mark.parametrize("parent", ASIL_ORDER)
def test_schemes_are_those_of_the_table(parent: str) -> None:
    assert len(schemes(parent)) == len(TABLE_OF_ASIL[parent])
    assert set(schemes(parent)) == TABLE_OF_ASIL[parent]


@pytest.mark.parametrize("parent", ASIL_ORDER[1:])
def test_children_sum_up_to_the_parent(parent: str) -> None:
    for pair in combinations_with_replacement(reversed(ASIL_ORDER), 2):
        assert (pair in schemes(parent)) == (sum(map(rank, pair)) == rank(parent))


def test_brackets_hold_the_goal_and_do_not_count() -> None:
    assert schemes("C(D)") == schemes("C")
    assert (own_asil("QM(D)"), goal_of("QM(D)"), goal_of("QM")) == ("QM", "D", "")
    assert scheme_text(("B(D)", "B(D)"), "D") == "B(D) + B(D)"


def test_a_requirement_has_no_more_than_its_goal() -> None:
    decomposed = [word for word in get_args(RequirementAsil) if goal_of(word)]
    assert len(decomposed) == 2 + 3 + 4 + 5
    assert all(rank(word) <= rank(goal_of(word)) for word in decomposed)


def test_unknown_asil_is_an_error() -> None:
    for word in ("E", "", "b", "d(D)"):
        refused(ValueError, rank, word, says="not in")


# --- Elements: what they depend on, and what is consumed and provided by nobody -------------------


def element(name: str, **more: Any) -> Element:
    return Element(id=name, kind="sensor", text="text", asil_capability="B", **more)


def test_relations_are_listed_once_with_their_kind() -> None:
    lists = {"resources": ("power", "power"), "software": ("tracker",)}
    flows = {"provides": ("objects",), "consumes": ("map",)}
    made = element("camera", supplier="one", **lists, **flows)
    of = {"supplier": "one", "resource": "power", "software": "tracker"}
    assert dict(made.relations) == of | {"provides": "objects", "consumes": "map"}
    assert len(made.relations) == 5
    assert causes([made, element("radar")]) == ("camera", "one", "power", "tracker", "radar")


def test_what_nobody_provides_is_named_with_what_is_provided() -> None:
    assert list(unprovided([element("a", consumes=("map",))])) == [
        (("elements", 0, "consumes", 0), "nobody provides 'map'. Nothing is")
    ]
    found = list(unprovided([element("a", provides=("x",)), element("b", consumes=("x", "y"))]))
    assert found == [(("elements", 1, "consumes", 1), "nobody provides 'y'. Provided are x")]


def test_one_thing_in_two_spellings_is_no_two_things() -> None:
    made_of, parted = ("power_a", "Gr\u00f6\u00dfe"), "Gro\u0308\u00dfe"
    one = element("camera", supplier="Alpha", resources=made_of, software=("tracker", "C++"))
    for other, place, name, first in (
        ({"resources": ("p", "Power_A")}, ("resources", 1), "Power_A", "power_a"),
        ({"resources": ("power a",)}, ("resources", 0), "power a", "power_a"),
        ({"resources": ("Camera",)}, ("resources", 0), "Camera", "camera"),
        ({"supplier": "ALPHA"}, ("supplier",), "ALPHA", "Alpha"),
        ({"software": ("Tracker",)}, ("software", 0), "Tracker", "tracker"),
        # Composed and decomposed, with a mark of no width, and wider than usual.
        ({"resources": (parted,)}, ("resources", 0), parted, "Gr\u00f6\u00dfe"),
        ({"supplier": "Al\u200bpha"}, ("supplier",), "Al\u200bpha", "Alpha"),
        ({"software": ("\uff23++",)}, ("software", 0), "\uff23++", "C++"),
        # A Cyrillic and a Greek letter.
        ({"resources": ("p\u043ewer_a",)}, ("resources", 0), "p\u043ewer_a", "power_a"),
        ({"supplier": "\u0391lpha"}, ("supplier",), "\u0391lpha", "Alpha"),
    ):
        seen = [
            shown(text) if text.isascii() else f"{shown(text)} ({ascii(text)[1:-1]})"
            for text in (name, first)
        ]
        told = f"{seen[0]} is spelled {seen[1]} elsewhere. Spell one thing in one way"
        made = element("radar", **other)
        assert list(spelled_twice([one, made])) == [(("elements", 1, *place), told)]
    apart = element("radar", supplier="camera", resources=("power_b",), software=("C", "alpha"))
    assert not list(spelled_twice([one, one, apart]))


def test_one_thing_is_not_a_resource_here_and_software_there() -> None:
    one = element("camera", resources=("os",), software=("tracker",))
    for other, place, there in (
        ({"software": ("OS",)}, ("software", 0), "a resource or an element"),
        ({"software": ("camera",)}, ("software", 0), "a resource or an element"),
        ({"resources": ("p", "tracker")}, ("resources", 1), "software"),
    ):
        found = dict(spelled_twice([one, element("radar", **other)]))
        assert found[("elements", 1, *place)].endswith(
            f"is {there} elsewhere. Name one thing under one key"
        )


def test_keys_that_came_later_are_no_part_of_an_element_without_them() -> None:
    assert set(element("a", resources=("p",)).model_dump()) == {
        "id", "kind", "text", "asil_capability", "legacy", "resources"
    }  # fmt: skip
    assert element("a", supplier="one").model_dump()["supplier"] == "one"


# --- Decompositions in concept files: what is legal, what is refused, and with which words --------


def fsr(name: str, asil: str, *elements: str) -> dict[str, Any]:
    about = {"id": name, "goals": ["SG-1"], "text": "text", "formula": "always(not contact)"}
    return {**about, "threshold_source": "text", "asil": asil, "allocation": list(elements)}


def content_of_decomposition() -> dict[str, Any]:
    """Write a concept with D into B(D) and B(D)."""
    step = {"requirement": "FSR-1", "into": ["FSR-1a", "FSR-1b"], "independence": "text"}
    record = {"id": "DFA-1", "covers": ["clock"], "argument": "each has one of its own to fall to"}
    element = {"kind": "sensor", "text": "text", "asil_capability": "D"}
    return {
        "concept": "two_sensors",
        "title": "Two sensors",
        "hazardous_events": [event("HE-1"), event("HE-2", "E3")],
        "safety_goals": [goal("SG-1", "HE-1"), goal("SG-2", "HE-2")],
        "elements": [
            {"id": "camera", **element, "resources": ["power_a", "clock"]},
            {"id": "radar", **element, "resources": ["power_b", "clock"]},
        ],
        "requirements": [
            fsr("FSR-1", "D", "camera", "radar"),
            fsr("FSR-1a", "B(D)", "camera"),
            fsr("FSR-1b", "B(D)", "radar"),
        ],
        "decompositions": [{**step, "dfa": ["DFA-1"]}],
        "dependent_failures": [{**record, "owner": "me", "valid_until": "2999-12-31"}],
    }


def read(tmp_path: Path, concept: dict[str, Any]) -> Concept:
    """Read it from a file, as an ODD does."""
    path = tmp_path / "concept.yaml"
    path.write_text(yaml.safe_dump(concept, sort_keys=False), encoding="utf-8")
    loaded = _load(path, Concept)
    _check_asil(loaded)
    return loaded.spec


def test_legal_decomposition_is_read_with_its_scheme(tmp_path: Path) -> None:
    concept = read(tmp_path, content_of_decomposition())
    (item,) = concept.decompositions
    assert scheme(concept, item) == "B(D) + B(D)"
    assert parents(concept) == {"FSR-1a": "FSR-1", "FSR-1b": "FSR-1"}
    assert [item.asil for item in concept.requirements] == ["D", "B(D)", "B(D)"]


@pytest.mark.parametrize("pair", [("C(D)", "A(D)"), ("D(D)", "QM(D)"), ("QM(D)", "D(D)")])
def test_every_scheme_of_d_is_legal(tmp_path: Path, pair: tuple[str, str]) -> None:
    made = content_of_decomposition()
    for requirement, asil in zip(made["requirements"][1:], pair, strict=True):
        requirement["asil"] = asil
    assert list(asil_problems(read(tmp_path, made))) == []


def test_decomposition_goes_on_stepwise(tmp_path: Path) -> None:
    made = content_of_decomposition()
    made["requirements"] += [fsr("FSR-2", "A(D)", "camera"), fsr("FSR-3", "A(D)", "radar")]
    step = {"requirement": "FSR-1a", "into": ["FSR-2", "FSR-3"], "independence": "text"}
    made["decompositions"].append(step)
    concept = read(tmp_path, made)
    assert scheme(concept, concept.decompositions[1]) == "A(D) + A(D)"


def test_stored_concept_is_read_again_as_it_was() -> None:
    made = content_of_decomposition()
    made["hazardous_events"][0] |= {"exposure_method": "frequency", "scenarios": ["cut_in"]}
    emergency = {"emergency_operation": "drive slowly", "eotti": "20 s", "eotti_rationale": "text"}
    made["safety_goals"][0] |= emergency
    made["elements"][0] |= {"supplier": "one", "software": ["tracker"], "provides": ["objects"]}
    made["elements"][1] |= {"consumes": ["objects"]}
    dry = {"id": "AS-1", "text": "dry", "owner": "me", "valid_until": "2999-12-31"}
    made["assumptions"] = [dry]
    how = {"type": "fault_tolerance", "operating_modes": ["automated"], "safe_state": "standstill"}
    made["requirements"][0] |= how
    till = {"emergency_operation_interval": "10 s", "redundancy": "radar"}
    made["requirements"][0] |= till | {"assumptions": ["AS-1"]}
    concept = Concept.model_validate(made)
    stored = concept.model_dump(mode="json")
    assert Concept.model_validate(stored, context=SI) == concept
    assert stored["safety_goals"][0]["eotti"] == 20.0


def test_content_without_the_new_keys_has_none_of_them() -> None:
    made = content_of_decomposition()
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
    requirement = Concept.model_validate(content_of_decomposition()).requirements[1]
    assert set(requirement.judged()) == {
        "id", "formula", "bound", "on_contact", "applies", "scenarios"
    }  # fmt: skip


def test_illegal_one_is_refused_with_what_is_allowed(tmp_path: Path) -> None:
    value: Any
    for path, value, message in (
        (
            "2.asil",
            "A(D)",
            r"B\(D\) \+ A\(D\) is no decomposition of FSR-1 \(D\)\. Allowed: "
            r"B\(D\) \+ B\(D\), C\(D\) \+ A\(D\), D\(D\) \+ QM\(D\)",
        ),
        ("2.asil", "B(C)", r"FSR-1b comes of .* of ASIL D, and has B\(C\)\. .*B\(D\)"),
        ("1.asil", "B", r"FSR-1a comes of .* of ASIL D, and has B\. .*as in B\(D\)"),
        ("1.asil", "QM", r"FSR-1a comes of .* has QM\. .*as in QM\(D\)"),
        ("3", "QM(D)", r"FSR-4 has ASIL QM\(D\) and comes of no decomposition\. Write QM, or"),
        ("3", "B", "FSR-4 has ASIL B, below D of SG-1. Set it to D, or decompose"),
        ("3", "D(D)", r"FSR-4 has ASIL D\(D\) and comes of no decomposition\. Write D"),
        ("1.goals", ["SG-2"], "FSR-1a does not serve SG-1, as FSR-1 does"),
        ("2.mandatory", False, "FSR-1b takes the place of FSR-1, which is mandatory"),
        ("1.goals", ["SG-1", "SG-2"], r"FSR-1a has ASIL B\(D\), below C of SG-2"),
    ):
        added = fsr("FSR-4", value, "camera") if path == "3" else value
        made = changed(content_of_decomposition(), f"requirements.{path}", added)
        caught = refused(InputError, read, tmp_path, made, says=message)
        each = caught.errors if isinstance(caught, InputErrors) else (caught,)
        assert all(known(error.where).line > 1 for error in each)


AGAIN = content_of_decomposition()


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("decompositions.0.requirement", "FSR-9", "no requirement 'FSR-9'. Did you mean"),
        ("decompositions.0.into", ["FSR-1a", "FSR-9"], "no requirement 'FSR-9'"),
        ("decompositions.0.into", ["FSR-1a"] * 2, "'FSR-1a' is a child of 'FSR-1' already"),
        ("decompositions.0.into", ["FSR-1", "FSR-1a"], "'FSR-1' is decomposed into itself"),
        ("decompositions.0.into", ["FSR-1a"], "at least 2 items"),
        ("decompositions.0.dfa", ["DFA-9"], "no record in dependent_failures 'DFA-9'"),
        ("dependent_failures.0.covers", ["clocks"],
         "no resource, software, supplier or element 'clocks'. Did you mean 'clock'"),
        ("dependent_failures.1", AGAIN["dependent_failures"][0], "'DFA-1' is defined twice"),
        ("decompositions.1", AGAIN["decompositions"][0], "'FSR-1' is decomposed twice"),
        ("requirements.0.assumptions", ["AS-9"], "'AS-9' is none of nothing"),
        ("safety_goals.0.eotti", "5 s", "together, or none of them"),
    ],
)  # fmt: skip
def test_reference_that_leads_nowhere_is_refused(path: str, value: Any, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Concept.model_validate(changed(content_of_decomposition(), path, value))


def test_message_has_the_line_of_the_reference(tmp_path: Path) -> None:
    made = changed(content_of_decomposition(), "decompositions.0.dfa", ["DFA-9"])
    path = tmp_path / "concept.yaml"
    path.write_text(yaml.safe_dump(made, sort_keys=False), encoding="utf-8")
    line = path.read_text("utf-8").splitlines().index("  - DFA-9") + 1
    refused(SpecError, validate, load_document(path), Concept, says=f"concept.yaml:{line}:")


# --- Timing budgets of a safety goal --------------------------------------------------------------


def fsr_of_budget(
    name: str, fdti: float | None = None, frti: float | None = None, goal: str = "G"
) -> Any:
    return SimpleNamespace(id=name, goals=(goal,), fdti=fdti, frti=frti)


def test_fsr_with_both_parts_is_a_budget_of_its_own() -> None:
    [found] = budgets_of([fsr_of_budget("A", 0.5, 0.3)], "G")
    assert found == Budget(("A",), 0.5, 0.3)
    assert (found.total, found.is_complete) == (0.8, True)


def test_largest_single_parts_are_one_budget_together() -> None:
    parts = (("A", 0.2, None), ("B", 0.5, None), ("C", None, 0.1), ("D", None, 0.4))
    [found] = budgets_of([fsr_of_budget(*part) for part in parts], "G")
    assert found == Budget(("B", "D"), 0.5, 0.4)


def test_part_that_nobody_states_is_none_and_not_zero() -> None:
    [found] = budgets_of([fsr_of_budget("A", frti=0.4)], "G")
    assert found == Budget(("A",), None, 0.4)
    assert not found.is_complete


def test_other_goals_and_fsrs_without_a_budget_do_not_count() -> None:
    assert budgets_of([fsr_of_budget("A"), fsr_of_budget("B", 0.5, 0.5, goal="H")], "G") == []


def test_budget_as_long_as_the_ftti_does_not_exceed_it() -> None:
    budget = Budget(("A",), 0.1, 0.2)
    assert not budget.exceeds(0.3)
    assert budget.exceeds(0.29)
