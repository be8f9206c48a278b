"""What changed between a baseline and a campaign.

Test cases are paired by situation, faults and swept values of the architecture. All have the same
random numbers on both sides, so a pair that differs was changed by something that was edited.

Where the points are a random sample the mean over points is tested; chosen points are no sample,
so there every pair counts, and the worst case.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from adeye.errors import UsageError, amount
from adeye.judge.statistics import MIN_UNITS, RESOLUTION, bca, resampled_sums
from adeye.judge.verdict import Verdict, exercised_of
from adeye.report.claims import is_sample
from adeye.report.gate.baseline import Baseline, BaselineCase, BaselineCell, Finding, Kind
from adeye.report.words import counted, quantity, unit_text
from adeye.signals import Floats
from adeye.spec.asil import rank
from adeye.units import MOST_TOLERANCE, TOLERANCES, shown

# --- Losses of margin against a baseline: how large, in how many pairs, and whether they count ----

NUMERIC: Final = 1e-6
"""Tolerance that always applies, relative and in the unit of the margin: a baseline is rounded."""
_VACUOUS: Final = "V"
"""Letter of a verdict whose margin says nothing."""
CONFIDENCE: Final = 0.95
"""Of the interval of a mean change."""


@dataclass(frozen=True, slots=True)
class Column:
    """Where an FSR is in the rows of test cases, and what its margins measure.

    Attributes:
        fsr: Id of the FSR.
        at: Its place in the rows.
        measure: Unit and signal; None where they differ between test cases.
    """

    fsr: str
    at: int
    measure: str | None


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Losses of margin that do not count.

    Attributes:
        sizes: Size by id of an FSR, or by unit for all others, as a margin has it.
        steps: Numeric uncertainty of the margin by FSR, architecture and scenario, and by unit:
            what the step is worth is no loss.
        usual: Size by unit where none is given, see ``of_odd``.
    """

    sizes: Mapping[str, float] = field(default_factory=dict)
    steps: Mapping[tuple[str, str, str], Mapping[str, float]] = field(default_factory=dict)
    usual: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def given(cls, sizes: Mapping[str, float]) -> Tolerances:
        """Take sizes whose units may be written with ``^``.

        >>> Tolerances.given({"m/s^2": 0.1}).sizes
        {'m/s²': 0.1}
        """
        return cls(_by_text(sizes))

    def of_gate(self, sizes: Mapping[str, float]) -> Tolerances:
        """Fall back on what the gate of an ODD tolerates by unit, then on what is usual for it."""
        return replace(self, usual={**_by_text(TOLERANCES), **_by_text(sizes)})

    def of(self, place: tuple[str, str, str], unit: str, value: float) -> float:
        """Return the loss that does not count, at least what rounding and the step make.

        Args:
            place: FSR, architecture and scenario.
            unit: Unit of the margin; ``1`` for one without or divided by its scale.
            value: Margin in the baseline.
        """
        return max(self.without_step(place[0], unit, value), self.step(place, unit))

    def without_step(self, fsr: str, unit: str, value: float) -> float:
        """Return the loss that does not count if the step were worth nothing."""
        numeric = NUMERIC * max(1.0, abs(value))
        usual = self.usual.get(unit_text(unit) or unit, 0.0)
        return max(numeric, self.sizes.get(fsr, self.sizes.get(unit, usual)))

    def step(self, place: tuple[str, str, str], unit: str) -> float:
        """Return what the step is worth in a margin, 0 where that is not known."""
        return self.steps.get(place, {}).get(unit, 0.0)

    def check(self, fsrs: Sequence[str], units: Sequence[str]) -> None:
        """Refuse names that nothing has.

        Raises:
            UsageError: A name is neither an FSR nor a unit of a margin, or a size is not plausible.
        """
        for name, size in self.sizes.items():
            if not 0.0 <= size <= MOST_TOLERANCE:
                raise UsageError(
                    f"--tolerance of {shown(name)} is {size:g}, beyond which nothing would be lost",
                    remedy=f"Give 0 to {MOST_TOLERANCE:g}.",
                )
            if name not in {*fsrs, *units}:
                raise UsageError(
                    f"--tolerance {name!r} is neither an FSR nor a unit of a margin",
                    remedy=f"There are: {', '.join([*sorted(set(fsrs)), *sorted(set(units))])}.",
                )


def _by_text(sizes: Mapping[str, float]) -> dict[str, float]:
    return {unit_text(name) or name: size for name, size in sizes.items()}


@dataclass(frozen=True, slots=True)
class Loss:
    """What pairs lost.

    Attributes:
        text: For people.
        is_regression: Whether it counts.
        keys: Test cases that lost most, the worst first.
    """

    text: str
    is_regression: bool
    keys: tuple[str, ...]


def compare_cells(was: BaselineCell, has: BaselineCell, tolerances: Tolerances) -> str:
    """Compare worst margins of one cell; empty unless the worst is worse beyond tolerance.

    Args:
        was: Of the baseline.
        has: Of the campaign.
        tolerances: Losses that do not count.
    """
    if was.margin is None or has.margin is None or was.margin.unit != has.margin.unit:
        return ""
    unit, before, after = was.margin.unit, was.margin.value, has.margin.value
    tolerance = tolerances.of((was.fsr, was.architecture, was.scenario or ""), unit, before)
    if before - after <= tolerance:
        return ""
    return f"worst margin {_signed(after, unit)}, {_signed(before, unit)} in the baseline"


def compare_pairs(
    keys: Sequence[str],
    then: tuple[Mapping[str, BaselineCase], Column],
    now: tuple[Mapping[str, BaselineCase], Column],
    tolerances: Tolerances,
    *,
    points: Mapping[str, int] | None,
    place: tuple[str, str],
) -> Loss | None:
    """Compare the margins of pairs of test cases of one FSR.

    Args:
        keys: Test cases that both have.
        then: Those of the baseline by key, and where the FSR is.
        now: Those of the campaign.
        tolerances: Losses that do not count.
        points: Point of the design by key, if the points are a random sample.
        place: Architecture and scenario.

    Returns:
        None if no pair lost anything but rounding, or more than was asked for by name; a loss that
        is no regression if none lost more than is usually tolerated, or than the step is worth.
    """
    measure = then[1].measure
    is_plain = measure is not None and measure == now[1].measure
    unit = measure.split(" ", 1)[0] if is_plain and measure else "1"
    pairs: list[tuple[str, float, float]] = []
    for key in keys:
        before, after = (
            (rows[key].margins if is_plain else rows[key].robustness)[column.at]
            for rows, column in (then, now)
        )
        is_judged = all(rows[key].verdicts[c.at] != _VACUOUS for rows, c in (then, now))
        if is_judged and before is not None and after is not None:
            pairs.append((key, before, after))
    at = (then[1].fsr, *place)
    what = "margin" if is_plain else "margin divided by its scale"
    lost = [
        item for item in pairs if item[1] - item[2] > tolerances.without_step(at[0], unit, item[1])
    ]
    if not lost:
        return _tolerated(pairs, tolerances, at, (what, unit))
    lost.sort(key=lambda item: (item[2] - item[1], item[0]))
    worst_before, worst_after = min(item[1] for item in pairs), min(item[2] for item in pairs)
    text = (
        f"{what} lost in {counted(len(lost))} of {counted(len(pairs))} pairs, most "
        f"{_signed(lost[0][2] - lost[0][1], unit)}; worst {_signed(worst_after, unit)}, "
        f"{_signed(worst_before, unit)} in the baseline"
    )
    worst = tuple(item[0] for item in lost)
    step = tolerances.step(at, unit)
    if step:
        text += f"; the step is worth {quantity(step, unit)}"
    if max(item[1] - item[2] for item in lost) <= step:
        return Loss(f"{text}, so nothing is known to be lost", is_regression=False, keys=worst)
    if points is None:
        return Loss(text, is_regression=True, keys=worst)
    tolerance = tolerances.of(at, unit, worst_before)
    return _tested(pairs, points, tolerance, (text, unit, place[1]), worst)


def _tolerated(
    pairs: Sequence[tuple[str, float, float]],
    tolerances: Tolerances,
    at: tuple[str, str, str],
    said: tuple[str, str],
) -> Loss | None:
    """Say what was lost without counting, whoever named that size."""
    what, unit = said
    nothing = Tolerances()
    lost = [
        item for item in pairs if item[1] - item[2] > nothing.without_step(at[0], unit, item[1])
    ]
    if not lost:
        return None
    lost.sort(key=lambda item: (item[2] - item[1], item[0]))
    text = (
        f"{what} lost in {counted(len(lost))} of {counted(len(pairs))} pairs, most "
        f"{_signed(lost[0][2] - lost[0][1], unit)}, which is tolerated: up to "
        f"{quantity(tolerances.without_step(at[0], unit, 0.0), unit)}"
    )
    return Loss(text, is_regression=False, keys=tuple(item[0] for item in lost))


def _tested(
    pairs: Sequence[tuple[str, float, float]],
    points: Mapping[str, int],
    tolerance: float,
    said: tuple[str, str, str],
    worst: tuple[str, ...],
) -> Loss:
    """Test the mean change over drawn points; with too few of them every pair counts."""
    text, unit, name = said
    of_point: dict[int, list[float]] = defaultdict(list)
    for key, before, after in pairs:
        of_point[points[key]].append(after - before)
    means: Floats = np.array([np.mean(of_point[point]) for point in sorted(of_point)])
    if len(means) < MIN_UNITS:
        return Loss(f"{text}; too few points to test", is_regression=True, keys=worst)
    means = np.round(means / RESOLUTION) * RESOLUTION
    mean = float(means.mean())
    sums = resampled_sums(means[:, np.newaxis], name)[:, 0]
    found = bca(mean, sums / len(means), means - mean, CONFIDENCE)
    said_of = (
        f"{text}; mean change over {counted(len(means))} drawn points {_signed(mean, unit)} "
        f"[{_signed(found.low, unit)}, {_signed(found.high, unit)}], {CONFIDENCE:.0%}"
    )
    return Loss(said_of, is_regression=found.high < -tolerance, keys=worst)


def _signed(value: float, unit: str) -> str:
    return quantity(value, unit, signed=True)


# --- What changed between a baseline and a campaign -----------------------------------------------

NAMED_RUNS: Final = 3
"""Runs that a finding names."""


@dataclass(frozen=True)
class Snapshot:
    """A campaign as it is now.

    Attributes:
        state: As a baseline would keep it.
        runs: Result digest by architecture and key of the test case.
        points: Number of the point of the design by key of the test case.
    """

    state: Baseline
    runs: Mapping[tuple[str, str], str] = field(default_factory=dict)
    points: Mapping[str, int] = field(default_factory=dict)


def check_same_odd(then: Baseline, now: Baseline, path: str) -> None:
    """Refuse a baseline that is about something else.

    Raises:
        UsageError: It is of another ODD.
    """
    if then.odd != now.odd:
        raise UsageError(
            f"{path} is a baseline of ODD {then.odd!r}, the campaign is of {now.odd!r}",
            remedy="Name the campaign of that ODD, or its own baseline.",
        )


def state_of(now: Baseline) -> list[Finding]:
    """Name every FSR of the gate that does not pass, whatever a baseline says."""
    return [
        Finding(
            Kind.FAILING if cell.verdict is Verdict.FAIL else Kind.UNDECIDED,
            _verdict_text(cell, now.fsrs[cell.fsr].min_exercised),
            fsr=cell.fsr,
            architecture=cell.architecture,
            runs=(cell.run,) if cell.run else (),
        )
        for cell in now.cells
        if cell.scenario is None
        and cell.verdict is not Verdict.PASS
        and cell.architecture in now.gate
        and now.fsrs[cell.fsr].mandatory
    ]


def _verdict_text(cell: BaselineCell, needed: int) -> str:
    if cell.verdict is None:
        return "not applicable, and the architecture is in the gate"
    counts = ", ".join(f"{word} {counted(count)}" for word, count in cell.counts.items())
    text = f"{cell.verdict}; runs: {counts or 'none'}"
    if cell.verdict is Verdict.VACUOUS and needed > 1:
        runs = sum(cell.counts.values())
        text += f"; exercised in {exercised_of(cell.verdict, cell.exercised, runs, needed)}"
    return text


def changes(then: Baseline, now: Snapshot, tolerances: Tolerances) -> list[Finding]:
    """Name everything that differs from a baseline, what is worse first.

    Args:
        then: The baseline.
        now: The campaign.
        tolerances: Losses of margin that do not count.
    """
    found = [*_relaxed(then, now.state), *_notes(then, now.state)]
    found += _Cells(then, now, tolerances).changes()
    order = list(Kind)
    return sorted(found, key=lambda item: (not item.decides, order.index(item.kind)))


def _relaxed(then: Baseline, now: Baseline) -> Iterator[Finding]:
    """Name what asks for less than the baseline did."""
    for name in sorted(set(then.gate) - set(now.gate)):
        if name in now.architectures:
            text = "was in the gate and is not any more"
            yield Finding(Kind.RELAXED, text, architecture=name)
    if now.channel_failures == "allow" != then.channel_failures:
        yield Finding(Kind.RELAXED, "failures of channels were refused and are allowed now")
    # Every driver that is named has to have the contact too: one more asks for more.
    drivers = now.preventable_by
    if drivers and not set(then.preventable_by or ("none",)) <= set(drivers):
        text = f"contacts that {' and '.join(drivers)} cannot avoid blocked and are set aside now"
        yield Finding(Kind.RELAXED, text)
    if now.uncertainty < then.uncertainty:
        text = f"what the step is worth is told by {now.uncertainty} situations, {then.uncertainty}"
        yield Finding(Kind.RELAXED, f"{text} before")
    yield from _tolerating(then, now)
    for fsr, was in then.fsrs.items():
        has = now.fsrs.get(fsr)
        if has is None:
            continue
        asks, asked = has.min_exercised, was.min_exercised
        waived, before = has.waived_until or "", was.waived_until or ""
        less = {
            "was mandatory and is not any more": was.mandatory and not has.mandatory,
            f"has ASIL {has.asil}, {was.asil} before": rank(has.asil) < rank(was.asil),
            f"asks for {asks} exercised runs, {asked} before": asks < asked,
            f"is waived until {waived}, {before or 'no waiver'} before": waived > before,
        }
        for text in (text for text, is_less in less.items() if is_less):
            yield Finding(Kind.RELAXED, text, was.mandatory, fsr)


def _tolerating(then: Baseline, now: Baseline) -> Iterator[Finding]:
    """Name the units of which a larger loss is tolerated than it was."""
    for unit in sorted({*then.tolerance, *now.tolerance}):
        usual = TOLERANCES.get(unit, 0.0)
        former, size = then.tolerance.get(unit, usual), now.tolerance.get(unit, usual)
        if size > former:
            text = f"a loss of {quantity(size, unit)} is tolerated, of {quantity(former, unit)}"
            yield Finding(Kind.RELAXED, f"{text} before")


def _notes(then: Baseline, now: Baseline) -> Iterator[Finding]:
    """Name content that was edited or added; what follows from it is told apart."""
    parts = ("architectures", "scenarios", "faults")
    for part in parts:
        was, has = getattr(then, part), getattr(now, part)
        edited = sorted(name for name in was if has.get(name, was[name]) != was[name])
        if edited:
            yield Finding(Kind.NOTE, f"{part} edited: {', '.join(edited)}", decides=False)
        added = sorted(set(has) - set(was))
        if added:
            text = f"{part} not in the baseline: {', '.join(added)}"
            yield Finding(Kind.NOTE, text, decides=False)
    if then.attributes and then.attributes != now.attributes:
        text = "attributes of the ODD edited: the evidence is to stand for another domain"
        yield Finding(Kind.NOTE, text, decides=False)
    if then.concept_digest != now.concept_digest:
        # FTTI, classes of hazards, goals and capabilities: no verdict hangs on them.
        text = "the concept was edited; adeye check says whether it holds together"
        yield Finding(Kind.NOTE, text, decides=False)
    added = sorted(set(now.fsrs) - set(then.fsrs))
    if added:
        yield Finding(Kind.NOTE, f"FSRs not in the baseline: {', '.join(added)}", decides=False)
    if then.numerics != now.numerics:
        text = f"computed by {now.numerics}, the baseline by {then.numerics}"
        yield Finding(Kind.NOTE, text, decides=False)
    if now.cases is None or then.cases is None:
        which = "the campaign has" if now.cases is None else "the baseline has"
        text = f"{which} too many test cases to pair them: counts and worst cases are compared"
        yield Finding(Kind.NOTE, text, decides=False)


_TURNS: Final = (
    (Kind.NEWLY_FAILING, "runs fail that did not", "P?VIEN-", "F"),
    (Kind.NEWLY_PASSING, "runs do not fail any more", "F", "PV"),
    (Kind.UNDECIDED, "runs are undecided that were not", "PVF", "?IEN-"),
    (Kind.NOTE, "runs do not exercise it any more", "PF", "V"),
)
"""What may happen to the verdict of a test case: letters that it had, and letters that it has."""


class _Cells:
    """Compares cell by cell, and in each cell test case by test case."""

    def __init__(self, then: Baseline, now: Snapshot, tolerances: Tolerances) -> None:
        self._then, self._now, self._tolerances = then, now, tolerances
        self._cells = {_place(cell): cell for cell in now.state.cells}
        self._rows_then = _rows(then)
        self._rows_now = _rows(now.state)
        self._gate = {*then.gate, *now.state.gate}

    def changes(self) -> Iterator[Finding]:
        """Name what changed."""
        yield from self._missing_parts()
        yield from self._missing_cases()
        for was in self._then.cells:
            has = self._cells.get(_place(was))
            if not self._is_missing(was):
                yield from self._cell(was, has)

    def _is_missing(self, was: BaselineCell) -> bool:
        """Whether a larger part than the cell is missing, which is named once."""
        now = self._now.state
        changed = (
            was.fsr in now.fsrs and now.fsrs[was.fsr].digest != self._then.fsrs[was.fsr].digest
        )
        return (
            changed
            or was.fsr not in now.fsrs
            or was.architecture not in now.architectures
            or (was.scenario is not None and was.scenario not in now.scenarios)
        )

    def _decides(self, architecture: str, fsr: str = "") -> bool:
        known = [
            part.fsrs[fsr].mandatory for part in (self._then, self._now.state) if fsr in part.fsrs
        ]
        return architecture in self._gate and (not fsr or any(known))

    def _missing_parts(self) -> Iterator[Finding]:
        then, now = self._then, self._now.state
        for fsr, was in then.fsrs.items():
            if fsr not in now.fsrs:
                yield Finding(Kind.MISSING, "the FSR is gone", was.mandatory, fsr)
            elif now.fsrs[fsr].digest != was.digest:
                text = "the FSR was changed; its results are compared with nothing"
                mandatory = was.mandatory or now.fsrs[fsr].mandatory
                yield Finding(Kind.CHANGED, text, mandatory, fsr)
        for name in then.architectures:
            if name not in now.architectures:
                text = "the architecture is gone"
                yield Finding(Kind.MISSING, text, name in then.gate, architecture=name)
        for name in then.scenarios:
            if name not in now.scenarios:
                yield Finding(Kind.MISSING, "the scenario is gone", scenario=name)

    def _missing_cases(self) -> Iterator[Finding]:
        if self._now.state.cases is None:
            return
        for (architecture, scenario), rows in self._rows_then.items():
            now = self._now.state
            if architecture not in now.architectures or scenario not in now.scenarios:
                continue
            have = self._rows_now.get((architecture, scenario), {})
            gone = [row for key, row in rows.items() if key not in have]
            if gone:
                faults = ", ".join(sorted({row.fault for row in gone}))
                text = (
                    f"{counted(len(gone))} of {counted(len(rows))} test cases are gone or have "
                    f"another situation (fault entries {faults}; {_some(row.key for row in gone)})"
                )
                decides = self._decides(architecture)
                yield Finding(Kind.MISSING, text, decides, "", architecture, scenario)

    def _cell(self, was: BaselineCell, has: BaselineCell | None) -> Iterator[Finding]:
        decides = self._decides(was.architecture, was.fsr)
        at = (was.fsr, was.architecture, was.scenario or "")
        if has is None or (has.verdict is None and was.verdict is not None):
            what = "not planned" if has is None else "not applicable"
            yield Finding(Kind.MISSING, f"{was.verdict} in the baseline, {what} now", decides, *at)
            return
        if was.scenario is not None:
            yield from self._in_scenario(was, has, decides=decides)
        elif was.verdict is Verdict.FAIL is not has.verdict:
            kind = Kind.NEWLY_PASSING if has.verdict is Verdict.PASS else Kind.UNDECIDED
            yield Finding(kind, f"FAIL in the baseline, {has.verdict} now", decides, *at)
        elif was.verdict is Verdict.PASS and has.verdict not in {Verdict.PASS, Verdict.FAIL}:
            text = f"PASS in the baseline, {has.verdict} now"
            yield Finding(Kind.UNDECIDED, text, decides, *at)

    def _in_scenario(
        self, was: BaselineCell, has: BaselineCell, *, decides: bool
    ) -> Iterator[Finding]:
        place = (was.architecture, was.scenario or "")
        at = (was.fsr, *place)
        if was.exercised and not has.exercised:
            text = f"exercised in {amount(was.exercised, 'run')} in the baseline, in none now"
            yield Finding(Kind.MISSING, text, decides, *at)
        if place in self._rows_then and place in self._rows_now:
            yield from self._pairs(was.fsr, place, decides=decides)
            return
        failed, fails = (cell.counts.get(Verdict.FAIL, 0) for cell in (was, has))
        if failed != fails:
            kind = Kind.NEWLY_FAILING if fails > failed else Kind.NEWLY_PASSING
            text = f"{amount(fails, 'run fails', 'runs fail')}, {counted(failed)} in the baseline"
            yield Finding(kind, text, decides, *at, runs=(has.run,) if has.run else ())
        loss = compare_cells(was, has, self._tolerances)
        if loss:
            yield Finding(Kind.MARGIN, loss, decides, *at, runs=(has.run,) if has.run else ())

    def _pairs(self, fsr: str, place: tuple[str, str], *, decides: bool) -> Iterator[Finding]:
        then, now = self._rows_then[place], self._rows_now[place]
        before, after = _column(self._then, place, fsr), _column(self._now.state, place, fsr)
        if before is None or after is None:
            return
        keys = [key for key in then if key in now]
        letters = {
            key: (then[key].verdicts[before.at], now[key].verdicts[after.at]) for key in keys
        }
        at = (fsr, *place)
        for kind, text, former, present in _TURNS:
            wanted = [
                key for key, (was, has) in letters.items() if was in former and has in present
            ]
            if wanted:
                runs = tuple(self._run(place[0], key) for key in wanted[:NAMED_RUNS])
                said = f"{counted(len(wanted))} of {counted(len(keys))} {text}"
                yield Finding(kind, said, decides, *at, runs=runs)
        loss = compare_pairs(
            keys,
            (then, before),
            (now, after),
            self._tolerances,
            points=self._now.points if self._is_sample(place[1]) else None,
            place=place,
        )
        if loss is not None:
            kind = Kind.MARGIN if loss.is_regression else Kind.NOTE
            runs = tuple(self._run(place[0], key) for key in loss.keys[:NAMED_RUNS])
            yield Finding(kind, loss.text, decides, *at, runs=runs)

    def _is_sample(self, scenario: str) -> bool:
        designs = (self._then.designs.get(scenario, ""), self._now.state.designs.get(scenario, ""))
        return all(map(is_sample, designs))

    def _run(self, architecture: str, key: str) -> str:
        return self._now.runs.get((architecture, key), "")


def _column(baseline: Baseline, place: tuple[str, str], fsr: str) -> Column | None:
    for part in baseline.cases or ():
        if (part.architecture, part.scenario) == place and fsr in part.fsrs:
            at = part.fsrs.index(fsr)
            return Column(fsr, at, part.measures[at])
    return None


def compared_units(then: Baseline, now: Baseline) -> set[str]:
    """Return the units of margins, with ``1`` only if some have none or are divided by a scale.

    Args:
        then: The baseline.
        now: The campaign as a baseline would keep it.
    """
    units = {cell.margin.unit for cell in (*then.cells, *now.cells) if cell.margin}
    former, present = _scaled(then), _scaled(now)
    if any(former[at] is None or former[at] != present[at] for at in former.keys() & present):
        units.add("1")
    return units


def _scaled(baseline: Baseline) -> dict[tuple[str, str, str], str | None]:
    """Give the measure of what has a margin, by architecture, scenario and FSR."""
    return {
        (part.architecture, part.scenario, fsr): part.measures[at]
        for part in baseline.cases or ()
        for at, fsr in enumerate(part.fsrs)
        if any(row.robustness[at] is not None for row in part.rows)
    }


def _place(cell: BaselineCell) -> tuple[str, str, str | None]:
    return cell.fsr, cell.architecture, cell.scenario


def _rows(baseline: Baseline) -> dict[tuple[str, str], dict[str, BaselineCase]]:
    return {
        (part.architecture, part.scenario): {row.key: row for row in part.rows}
        for part in baseline.cases or ()
    }


def _some(keys: Iterable[str]) -> str:
    found: Sequence[str] = sorted(keys)
    more = ", …" if len(found) > NAMED_RUNS else ""
    return ", ".join(found[:NAMED_RUNS]) + more
