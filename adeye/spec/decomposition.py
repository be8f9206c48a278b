"""Decomposition of requirements over independent elements, and what argues for independence.

Two children take the place of a requirement, each with a lower ASIL of its own (ISO 26262-9:2018,
clause 5). The scheme follows from the children's ASIL and has to be one of the table; that their
elements are independent is checked in the database, where the relations of elements are followed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from adeye.errors import suggest
from adeye.spec.asil import ASIL_ORDER, CHILDREN, goal_of, own_asil, rank, scheme_text, schemes
from adeye.spec.elements import causes
from adeye.spec.misplaced import Loc, repeated
from adeye.spec.quantity import Date, Many, Record, Reference, Text

if TYPE_CHECKING:
    from adeye.spec.concept import Concept, Requirement

Problem = tuple[Loc, str]


class Decomposition(Record):
    """Two requirements that together stand for one, on elements that are independent."""

    requirement: Reference
    """The one that is decomposed."""
    into: Annotated[Many[Reference], Field(min_length=CHILDREN, max_length=CHILDREN)]
    """Its children; more of them in further steps."""
    independence: Text
    """Why one cannot fail with the other."""
    dfa: Many[Reference] = ()
    """Dependent-failure records that cover what their elements share."""


class DependentFailure(Record):
    """A record of the dependent-failure analysis (DFA): why something shared is no common cause."""

    id: Reference
    covers: Annotated[Many[Text], Field(min_length=1)]
    """Resources, software, suppliers and elements that it argues about."""
    argument: Text
    owner: Text
    valid_until: Date


def parents(concept: Concept) -> dict[str, str]:
    """Return the decomposed requirement by each of its children."""
    return {child: item.requirement for item in concept.decompositions for child in item.into}


def scheme(concept: Concept, item: Decomposition) -> str:
    """Write the scheme that the children of a decomposition make."""
    known = {requirement.id: requirement for requirement in concept.requirements}
    children = tuple(known[child].asil for child in item.into)
    return scheme_text(children, _goal_asil(concept, known[item.requirement]))


def reference_problems(concept: Concept) -> Iterator[Problem]:
    """Find decompositions and dependent-failure records that name what is not there.

    Yields:
        Place below the concept; what is wrong and what is allowed.
    """
    yield from _references(concept, {item.id: item for item in concept.requirements})


def asil_problems(concept: Concept) -> Iterator[Problem]:
    """Find decompositions that are none, and requirements that lost the ASIL of a goal.

    Args:
        concept: Its references resolve.

    Yields:
        Place below the concept; what is wrong and what is allowed.
    """
    known = {item.id: item for item in concept.requirements}
    for number, item in enumerate(concept.decompositions):
        yield from _step(concept, known, number, item)
    of = parents(concept)
    for number, requirement in enumerate(concept.requirements):
        yield from _lost(concept, known, of, number, requirement)


def _references(concept: Concept, known: Mapping[str, Requirement]) -> Iterator[Problem]:
    decomposed = [item.requirement for item in concept.decompositions]
    for number in repeated(decomposed):
        text = (
            f"{decomposed[number]!r} is decomposed twice. Decompose its children in further steps"
        )
        yield ("decompositions", number, "requirement"), text
    records = [record.id for record in concept.dependent_failures]
    for number in repeated(records):
        yield ("dependent_failures", number, "id"), f"{records[number]!r} is defined twice"
    of: dict[str, str] = {}
    for number, item in enumerate(concept.decompositions):
        loc: Loc = ("decompositions", number)
        yield from _unknown((*loc, "requirement"), (item.requirement,), known, "requirement")
        yield from _unknown((*loc, "into"), item.into, known, "requirement")
        yield from _unknown((*loc, "dfa"), item.dfa, records, "record in dependent_failures")
        for at, child in enumerate(item.into):
            if child in of:
                yield (*loc, "into", at), f"{child!r} is a child of {of[child]!r} already"
            of[child] = item.requirement
            if _is_above(child, item.requirement, of):
                yield (*loc, "into", at), f"{child!r} is decomposed into itself"
    shared = causes(concept.elements)
    for number, record in enumerate(concept.dependent_failures):
        place: Loc = ("dependent_failures", number, "covers")
        yield from _unknown(place, record.covers, shared, "resource, software, supplier or element")


def _is_above(name: str, start: str, of: Mapping[str, str]) -> bool:
    seen: set[str] = set()
    current: str | None = start
    while current is not None and current not in seen:
        if current == name:
            return True
        seen.add(current)
        current = of.get(current)
    return False


def _unknown(
    loc: Loc, names: Sequence[str], known: Mapping[str, object] | Sequence[str], kind: str
) -> Iterator[Problem]:
    for at, name in enumerate(names):
        if name not in known:
            place = loc if loc[-1] == "requirement" else (*loc, at)
            yield place, f"there is no {kind} {name!r}. {suggest(name, known)}"


def _goal_asil(concept: Concept, requirement: Requirement) -> str:
    """Highest ASIL of the goals of a requirement."""
    return max(map(concept.goal_asil, requirement.goals), key=ASIL_ORDER.index)


def _step(
    concept: Concept, known: Mapping[str, Requirement], number: int, item: Decomposition
) -> Iterator[Problem]:
    """Check one decomposition: goals of the children, what is in brackets, and the scheme."""
    loc: Loc = ("decompositions", number, "into")
    parent = known[item.requirement]
    goal = _goal_asil(concept, parent)
    children = [known[child] for child in item.into]
    for at, child in enumerate(children):
        missing = [name for name in parent.goals if name not in child.goals]
        if missing:
            text = f"{child.id} does not serve {', '.join(missing)}, as {parent.id} does"
            yield (*loc, at), f"{text}. Each child alone has to meet what it is a child of"
        if goal_of(child.asil) != goal:
            place: Loc = ("requirements", concept.requirements.index(child), "asil")
            text = f"{child.id} comes of a decomposition of ASIL {goal}, and has {child.asil}"
            yield (
                place,
                f"{text}. Write the goal's in brackets, as in {own_asil(child.asil)}({goal})",
            )
    pair = tuple(sorted((rank(child.asil) for child in children), reverse=True))
    allowed = schemes(parent.asil)
    if pair not in [tuple(map(rank, scheme)) for scheme in allowed]:
        made = scheme_text(tuple(child.asil for child in children), goal)
        legal = ", ".join(scheme_text(scheme, goal) for scheme in allowed) or "nothing"
        yield loc, f"{made} is no decomposition of {parent.id} ({parent.asil}). Allowed: {legal}"


def _lost(
    concept: Concept,
    known: Mapping[str, Requirement],
    of: Mapping[str, str],
    number: int,
    item: Requirement,
) -> Iterator[Problem]:
    loc: Loc = ("requirements", number, "asil")
    if goal_of(item.asil) and item.id not in of:
        text = f"requirement {item.id} has ASIL {item.asil} and comes of no decomposition"
        yield loc, f"{text}. Write {own_asil(item.asil)}, or list it under decompositions"
    inherited = known[of[item.id]].goals if item.id in of else ()
    for goal in item.goals:
        needed = concept.goal_asil(goal)
        if rank(item.asil) < rank(needed) and goal not in inherited:
            text = f"requirement {item.id} has ASIL {item.asil}, below {needed} of {goal}"
            yield loc, f"{text}. Set it to {needed}, or decompose a requirement of {needed} into it"
