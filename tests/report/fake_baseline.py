"""A baseline of two architectures, two scenarios and three FSRs, and changes of it."""

from typing import Any

from adeye.judge.verdict import ExitCode, Verdict
from adeye.report.gate.baseline import (
    LETTERS,
    Baseline,
    BaselineCase,
    BaselineCases,
    BaselineCell,
    BaselineFsr,
)
from adeye.report.model.part import Margin

FSRS = ("FSR-1", "FSR-2", "FSR-3")
GATE, OTHER = "candidate", "legacy"
CUT_IN, BRAKING = "cut_in", "braking"
CASES = 4
Verdicts = dict[tuple[str, str, str, int], str]
Margins = dict[tuple[str, str, str, int], float]


def sha(text: str) -> str:
    return text.encode().hex().ljust(64, "0")[:64]


def key_of(scenario: str, number: int) -> str:
    return f"{sha(scenario)[:14]}{number:02x}"


def baseline(
    *,
    verdicts: Verdicts | None = None,
    margins: Margins | None = None,
    numbers: range = range(CASES),
    scenarios: tuple[str, ...] = (CUT_IN, BRAKING),
    fsrs: tuple[str, ...] = FSRS,
    **changes: Any,
) -> Baseline:
    """Make a baseline: all PASS with margin 1 m, FSR-3 is optional.

    Args:
        verdicts: Letters that differ, by FSR, architecture, scenario and number.
        margins: Margins that differ.
        numbers: Test cases of each scenario.
        scenarios: Their ids.
        fsrs: Their ids.
        changes: Fields of the baseline.
    """
    parts, cells = [], []
    for name in (GATE, OTHER):
        totals: dict[str, list[str]] = {fsr: [] for fsr in fsrs}
        for scenario in sorted(scenarios):
            rows = []
            for number in numbers:
                at = [(fsr, name, scenario, number) for fsr in fsrs]
                values = tuple((margins or {}).get(place, 1.0) for place in at)
                rows.append(
                    BaselineCase(
                        key=key_of(scenario, number),
                        fault="none",
                        verdicts="".join((verdicts or {}).get(place, "P") for place in at),
                        margins=values,
                        robustness=tuple(value / 10.0 for value in values),
                    )
                )
            measures = tuple("m gap" for _ in fsrs)
            parts.append(
                BaselineCases(
                    architecture=name, scenario=scenario, fsrs=fsrs, measures=measures,
                    rows=tuple(rows),
                )
            )  # fmt: skip
            for place, fsr in enumerate(fsrs):
                letters = [row.verdicts[place] for row in rows]
                totals[fsr] += letters
                least = min(row.margins[place] or 0.0 for row in rows)
                cells.append(cell(fsr, name, scenario, letters, least))
        cells += [cell(fsr, name, None, letters, 1.0) for fsr, letters in totals.items()]
    fields: dict[str, Any] = {
        "odd": "small",
        "campaign": "c" * 32,
        "odd_digest": sha("odd"),
        "concept_digest": sha("concept"),
        "numerics": "batch reference-1 3",
        "gate": (GATE,),
        "exit_code": ExitCode.OK,
        "planned": sum(len(part.rows) for part in parts),
        "accounted": sum(len(part.rows) for part in parts),
        "architectures": {name: sha(name) for name in (GATE, OTHER)},
        "scenarios": {name: sha(name) for name in scenarios},
        "faults": {},
        "designs": dict.fromkeys(scenarios, "full_factorial"),
        "fsrs": {name: fsr_of(name) for name in fsrs},
        "cells": tuple(cells),
        "cases": tuple(parts),
    }
    return Baseline(**{**fields, **changes})


def fsr_of(name: str, **changes: Any) -> BaselineFsr:
    fields = {"digest": sha(name), "asil": "D", "mandatory": name != "FSR-3", "min_exercised": 2}
    return BaselineFsr(**{**fields, **changes})


def cell(
    name: str, architecture: str, scenario: str | None, letters: list[str], least: float
) -> BaselineCell:
    words = [LETTERS[letter] for letter in letters]
    judged = [word for word in words if word is not None]
    order = (Verdict.FAIL, Verdict.ERROR, Verdict.INCONCLUSIVE, Verdict.PASS, Verdict.VACUOUS)
    return BaselineCell(
        fsr=name,
        architecture=architecture,
        scenario=scenario,
        verdict=next((word for word in order if word in judged), None),
        counts={word: judged.count(word) for word in dict.fromkeys(judged)},
        exercised=sum(word is not Verdict.VACUOUS for word in judged),
        margin=Margin(value=least, unit="m"),
        run="ab" * 32,
    )
