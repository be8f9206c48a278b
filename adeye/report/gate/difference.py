"""What changed from one campaign to another: files, test cases, verdicts, margins, FSRs.

Test cases are paired by where they stand in the plan: scenario, architecture, entry of the fault
list, swept values and replicate. So one that was edited is the same one, changed, and not one that
went and one that came.
"""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from typing import Any, Final, Literal

import numpy as np

from adeye.judge.pairing import NOT_JUDGED, NOT_RUN
from adeye.judge.requirements import measured
from adeye.judge.verdict import FAIL, INCONCLUSIVE, PASS, VERDICTS, WORST_FIRST, Verdict
from adeye.report.gate.changes import Tolerances
from adeye.report.gate.edits import edits_between
from adeye.report.model.part import Count, Id, Margin, Part
from adeye.report.words import unit_text
from adeye.signals import Ints
from adeye.spec.concept import Concept
from adeye.spec.quantity import SI
from adeye.store.read import totals
from adeye.store.read.bulk import Compared, Made
from adeye.store.records import LEFT_OUT, CampaignInfo
from adeye.store.repository import Repository
from adeye.store.write.content import executable_digest
from adeye.sweep.values import axis_text

_WORDS: Final = {
    **{code: Verdict(str(word)) for code, word in enumerate(VERDICTS)},
    NOT_RUN: Verdict.NOT_RUN,
    NOT_JUDGED: None,
}

Kind = Literal["added", "removed", "changed"]

# --- What is told of a difference -----------------------------------------------------------------


class Side(Part):
    """One of the two campaigns."""

    campaign: Id
    number: Count
    odd: Id
    created_at: str
    planned: Count


class EditTold(Part):
    """One value of the files that was edited."""

    path: str
    old: str | None
    new: str | None


class Case(Part):
    """Where a test case stands in the plan."""

    scenario: Id
    architecture: Id
    fault: Id
    values: str
    """Swept values in the units of the scenario."""
    replicate: Count

    @property
    def text(self) -> str:
        """In one line."""
        fault = "" if self.fault == "none" else f", {self.fault}"
        again = f", replicate {self.replicate}" if self.replicate else ""
        values = f", {self.values}" if self.values else ""
        return f"{self.scenario}, {self.architecture}{fault}{values}{again}"


class CaseChange(Part):
    """A test case that came, went or is made otherwise."""

    kind: Kind
    case: Case
    why: tuple[str, ...] = ()
    """What of a changed one is another: scenario, parameters, architecture, faults, seed, step,
    plugins, which is their code and files where both were executed, or numerics, which is the code
    of adeye; one of these two where nothing else is and one side was not executed."""
    old_run: str = ""
    new_run: str = ""


class Flip(Part):
    """A verdict of a test case that is another one."""

    fsr: Id
    case: Case
    old: Verdict | None
    """None where the FSR is not judged."""
    new: Verdict | None
    old_margin: Margin | None = None
    new_margin: Margin | None = None
    old_run: str
    new_run: str


class Move(Part):
    """Margins of one FSR, architecture and scenario that moved with no verdict changed."""

    fsr: Id
    architecture: Id
    scenario: Id
    pairs: Count
    """Test cases with a margin of the same measure and the same verdict in both."""
    lost: Count
    """Those of which the margin fell by more than is tolerated."""
    gained: Count
    unit: str
    tolerance: float
    case: Case
    """The one that lost most; without a loss, that gained most."""
    old_margin: float
    new_margin: float
    new_run: str


class Rejudged(Part):
    """What the old results of an architecture say under the new FSR."""

    architecture: Id
    before: dict[str, Count]
    """Test cases of the old campaign by verdict."""
    under_new: dict[str, Count]
    """The same ones by what the database has judged them to be by now."""
    not_judged: Count
    """Results among them that nobody has judged by it."""
    worst: Margin | None = None
    """Under the new one."""
    run: str = ""


class FsrChange(Part):
    """An FSR that came, went or was edited."""

    kind: Kind
    fsr: Id
    edits: tuple[EditTold, ...] = ()
    old_measure: str = ""
    new_measure: str = ""
    is_measured_otherwise: bool = False
    """Whether its verdicts can differ."""
    rejudged: tuple[Rejudged, ...] = ()


class Difference(Part):
    """What changed from one campaign to another."""

    old: Side
    new: Side
    edits: tuple[EditTold, ...]
    fsrs: tuple[FsrChange, ...]
    cases: tuple[CaseChange, ...]
    flips: tuple[Flip, ...]
    moves: tuple[Move, ...]

    @property
    def is_empty(self) -> bool:
        """Whether nothing differs."""
        return not (self.edits or self.fsrs or self.cases or self.flips or self.moves)


# --- Find what changed ----------------------------------------------------------------------------


def find_difference(repository: Repository, old: CampaignInfo, new: CampaignInfo) -> Difference:
    """Tell what changed from one campaign to another, from the database alone.

    Args:
        repository: The database.
        old: The campaign of before.
        new: The campaign of after, whose gate says which loss of margin does not count.
    """
    sides = _Campaign.read(repository, old), _Campaign.read(repository, new)
    pairs = _paired(*sides)
    fsrs = tuple(_fsrs(repository, *sides))
    otherwise = {item.fsr for item in fsrs if item.is_measured_otherwise}
    tolerances = Tolerances().of_gate(totals.tolerance(repository, new))
    return Difference(
        old=Side.of(old, campaign=old.id),
        new=Side.of(new, campaign=new.id),
        edits=tuple(_edits(*sides)),
        fsrs=fsrs,
        cases=tuple(_cases(repository, sides, pairs)),
        flips=tuple(_flips(sides, pairs)),
        moves=tuple(_moves(sides, pairs, otherwise, tolerances)),
    )


@dataclass(frozen=True, eq=False)
class _Campaign:
    """A campaign with all that is compared of it."""

    info: CampaignInfo
    odd: Mapping[str, Any]
    concept: Mapping[str, Any]
    compared: Compared

    @classmethod
    def read(cls, repository: Repository, info: CampaignInfo) -> _Campaign:
        """Read it."""
        odd = repository.content("odd", info.odd_digest)
        compared = repository.compared(info.id, list(odd["architectures"]), is_named=True)
        concept = repository.content("concept", info.concept_digest)
        return cls(info, odd, concept, compared)

    def case(self, row: int) -> Case:
        """Describe a test case."""
        of = self.compared
        scenario = of.scenario[row]
        values = [
            f"{name} {axis_text(name, value, self.odd, scenario)}"
            for name, value in json.loads(of.place[row]).items()
        ]
        return Case(
            scenario=scenario,
            architecture=of.architecture[row],
            fault=of.fault_entry[row],
            values=", ".join(values),
            replicate=int(of.replicate[row]),
        )

    def margin(self, row: int, column: int) -> Margin | None:
        """Give the margin of a verdict, if it has one."""
        of = self.compared
        value, unit = float(of.margin[row, column]), int(of.measured[row, column])
        if not np.isfinite(value) or unit < 0:
            return None
        return Margin(value=value, unit=of.units[unit])


def _edits(old: _Campaign, new: _Campaign) -> Iterator[EditTold]:
    """Name what was edited but the FSRs, which are told apart, and the code that executes."""
    concepts = (dict(side.concept) for side in (old, new))
    then, now = ({**concept, "requirements": ()} for concept in concepts)
    made = [
        {
            name: side.info.provenance.get(name)
            for name in ("backend", "variant", "numerics_version")
        }
        for side in (old, new)
    ]
    parts: list[tuple[str, Any, Any]] = [("", old.odd["odd"], new.odd["odd"])]
    parts += [(name, old.odd.get(name, {}), new.odd.get(name, {})) for name in _FILES]
    parts += [("concept", then, now), ("engine", made[0], made[1])]
    for root, before, after in parts:
        yield from map(EditTold.of, edits_between(before, after, root))


_FILES: Final = ("scenarios", "architectures", "data", LEFT_OUT)


def _fsrs(repository: Repository, old: _Campaign, new: _Campaign) -> Iterator[FsrChange]:
    then, now = (
        {item.id: item for item in Concept.model_validate(side.concept, context=SI).requirements}
        for side in (old, new)
    )
    changed = [name for name in now if name in then and measured(now[name]) != measured(then[name])]
    again = _Again.read(repository, old, new) if changed else None
    recoded = _recoded(old, new, changed)
    for name in dict.fromkeys([*now, *then]):
        if name not in then:
            yield FsrChange(kind="added", fsr=name, new_measure=now[name].measure)
        elif name not in now:
            yield FsrChange(kind="removed", fsr=name, old_measure=then[name].measure)
        elif then[name] != now[name] or name in recoded:
            was, has = (item.model_dump(mode="json") for item in (then[name], now[name]))
            yield FsrChange(
                kind="changed",
                fsr=name,
                edits=(*map(EditTold.of, edits_between(was, has)), *recoded.get(name, ())),
                old_measure=then[name].measure,
                new_measure=now[name].measure,
                is_measured_otherwise=name in changed or name in recoded,
                rejudged=tuple(again.told(name)) if again and name in changed else (),
            )


def _recoded(
    old: _Campaign, new: _Campaign, changed: Collection[str]
) -> dict[str, tuple[EditTold]]:
    """Tell of FSRs that read as they did and are judged by something else: code, attributes."""
    was, has = old.compared.digest_of, new.compared.digest_of
    return {
        name: (EditTold(path=_JUDGED_BY, old=was[name][:12], new=has[name][:12]),)
        for name in has
        if name in was and was[name] != has[name] and name not in changed
    }


_JUDGED_BY: Final = "code of the metric, attributes of the ODD or version of judging"


@dataclass(frozen=True, eq=False)
class _Again:
    """The old results, and what they are under the FSRs of the new campaign."""

    before: Compared
    under_new: _Campaign

    @classmethod
    def read(cls, repository: Repository, old: _Campaign, new: _Campaign) -> _Again:
        names = list(old.odd["architectures"])
        under = repository.compared(old.info.id, names, is_named=True, judged_by=new.info.id)
        return cls(old.compared, _Campaign(old.info, old.odd, old.concept, under))

    def told(self, fsr: str) -> Iterator[Rejudged]:
        """Tell of each architecture what its old results say."""
        under = self.under_new.compared
        if fsr not in self.before.fsrs or fsr not in under.fsrs:
            return
        was = self.before.verdict[:, self.before.fsrs.index(fsr)]
        column = under.fsrs.index(fsr)
        has = under.verdict[:, column]
        for code, architecture in enumerate(under.architecture.words):
            here = under.architecture.codes == code
            rows = np.flatnonzero(here & np.isin(has, (PASS, FAIL, INCONCLUSIVE)))
            known = rows[np.isfinite(under.margin[rows, column])]
            worst = int(known[under.margin[known, column].argmin()]) if len(known) else -1
            yield Rejudged(
                architecture=architecture,
                before=_counted(was[here]),
                under_new=_counted(has[here]),
                # What was never executed, or is withdrawn, is NOT_RUN before as well.
                not_judged=int((here & (has == NOT_RUN) & (was != NOT_RUN)).sum()),
                worst=self.under_new.margin(worst, column) if worst >= 0 else None,
                run=under.result[worst] if worst >= 0 else "",
            )


def _counted(codes: Ints) -> dict[str, int]:
    counts = Counter(codes.tolist())
    return {
        str(word) if word else "not judged": counts[code]
        for code, word in _WORDS.items()
        if counts[code]
    }


_Pairs = tuple[Ints, Ints]
"""Rows (P,) of the old and of the new campaign that are one test case."""


def _paired(old: _Campaign, new: _Campaign) -> _Pairs:
    """Pair test cases by where they stand; those of one place in the order of the plan."""
    then = {place: row for row, place in enumerate(_places(old.compared))}
    rows = [(then[place], row) for row, place in enumerate(_places(new.compared)) if place in then]
    found: Ints = np.array(rows, dtype=np.int64).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def _places(of: Compared) -> Iterator[tuple[Any, ...]]:
    seen: Counter[tuple[Any, ...]] = Counter()
    for row in range(len(of)):
        place = (
            of.scenario[row], of.architecture[row], of.fault_entry[row], of.place[row],
            int(of.replicate[row]),
        )  # fmt: skip
        seen[place] += 1
        yield (*place, seen[place])


def _cases(
    repository: Repository, sides: tuple[_Campaign, _Campaign], pairs: _Pairs
) -> Iterator[CaseChange]:
    old, new = sides
    for kind, side, rows in (("removed", old, pairs[0]), ("added", new, pairs[1])):
        alone = np.setdiff1d(np.arange(len(side.compared)), rows)
        for row in alone.tolist():
            runs = {"old_run" if side is old else "new_run": side.compared.result[row]}
            yield CaseChange.model_validate({"kind": kind, "case": side.case(row), **runs})
    changed = [
        (before, after)
        for before, after in zip(pairs[0].tolist(), pairs[1].tolist(), strict=True)
        if old.compared.result[before] != new.compared.result[after]
    ]
    made = [repository.made(side.info.id) for side in sides] if changed else []

    @cache
    def executed(kind: str, stored: str) -> str:
        return executable_digest(kind, json.dumps(repository.content(kind, stored)))

    for before, after in changed:
        yield CaseChange(
            kind="changed",
            case=new.case(after),
            why=_why(executed, made[0][before], made[1][after]),
            old_run=old.compared.result[before],
            new_run=new.compared.result[after],
        )


def _why(executed: Callable[[str, str], str], then: Made, now: Made) -> tuple[str, ...]:
    """Name what two test cases of one place are made of otherwise."""
    digests = [
        {
            "scenario": executed("scenario", item.scenario_digest),
            "architecture": executed("architecture", item.architecture_digest),
            "faults": executable_digest("faults", item.faults),
            "parameters": item.parameters,
            "seed": item.seed,
            "step": item.step_s,
            "plugins": item.plugins_digest,
        }
        for item in (then, now)
    ]
    found = tuple(
        name
        for name in digests[0]
        if digests[0][name] != digests[1][name] and None not in {digests[0][name], digests[1][name]}
    )
    is_told = None not in {then.plugins_digest, now.plugins_digest}
    return found or (("numerics",) if is_told else ("plugins or numerics",))


def _shared(sides: tuple[_Campaign, _Campaign]) -> list[tuple[str, int, int]]:
    """List the FSRs that both have, with their columns."""
    old, new = (side.compared.fsrs for side in sides)
    return [(fsr, old.index(fsr), new.index(fsr)) for fsr in new if fsr in old]


def _flips(sides: tuple[_Campaign, _Campaign], pairs: _Pairs) -> Iterator[Flip]:
    old, new = sides
    found: list[Flip] = []
    for fsr, one, other in _shared(sides):
        was, has = old.compared.verdict[pairs[0], one], new.compared.verdict[pairs[1], other]
        for place in np.flatnonzero(was != has).tolist():
            before, after = int(pairs[0][place]), int(pairs[1][place])
            found.append(
                Flip(
                    fsr=fsr,
                    case=new.case(after),
                    old=_WORDS[int(was[place])],
                    new=_WORDS[int(has[place])],
                    old_margin=old.margin(before, one),
                    new_margin=new.margin(after, other),
                    old_run=old.compared.result[before],
                    new_run=new.compared.result[after],
                )
            )
    yield from sorted(found, key=lambda flip: (WORST_FIRST.index(flip.new), flip.fsr))


def _moves(
    sides: tuple[_Campaign, _Campaign],
    pairs: _Pairs,
    otherwise: Collection[str],
    tolerances: Tolerances,
) -> Iterator[Move]:
    """Name where margins moved, but of FSRs that are measured otherwise."""
    old, new = sides
    for fsr, one, other in _shared(sides):
        if fsr in otherwise:
            continue
        groups: dict[tuple[str, str, str], list[tuple[float, float, int]]] = defaultdict(list)
        was, has = old.compared.verdict[pairs[0], one], new.compared.verdict[pairs[1], other]
        counts = (was == has) & np.isin(was, (PASS, FAIL, INCONCLUSIVE))
        for place in np.flatnonzero(counts).tolist():
            before, after = int(pairs[0][place]), int(pairs[1][place])
            then, now = old.margin(before, one), new.margin(after, other)
            if then is not None and now is not None and then.unit == now.unit:
                key = new.compared.scenario[after], new.compared.architecture[after], now.unit
                groups[key].append((then.value, now.value, after))
        for (scenario, architecture, unit), items in groups.items():
            move = _move(
                new, (fsr, architecture, scenario), (unit_text(unit) or "1", items), tolerances
            )
            if move is not None:
                yield move


def _move(
    new: _Campaign,
    at: tuple[str, str, str],
    told: tuple[str, Sequence[tuple[float, float, int]]],
    tolerances: Tolerances,
) -> Move | None:
    unit, items = told
    beyond = [
        item
        for item in items
        if abs(item[1] - item[0]) > tolerances.without_step(at[0], unit, item[0])
    ]
    if not beyond:
        return None
    lost = [item for item in beyond if item[1] < item[0]]
    worst = (
        min(lost, key=lambda item: item[1] - item[0])
        if lost
        else max(beyond, key=lambda item: item[1] - item[0])
    )
    return Move(
        fsr=at[0],
        architecture=at[1],
        scenario=at[2],
        pairs=len(items),
        lost=len(lost),
        gained=len(beyond) - len(lost),
        unit=unit,
        tolerance=tolerances.without_step(at[0], unit, worst[0]),
        case=new.case(worst[2]),
        old_margin=worst[0],
        new_margin=worst[1],
        new_run=new.compared.result[worst[2]],
    )


def grouped(cases: Sequence[CaseChange]) -> Iterator[tuple[CaseChange, int]]:
    """Take together, for people, the test cases that changed alike: the first, and how many."""

    def alike(item: CaseChange) -> tuple[str, ...]:
        return item.kind, item.case.scenario, item.case.architecture, *item.why

    for _, items in groupby(sorted(cases, key=alike), key=alike):
        found = list(items)
        yield found[0], len(found)
