"""The tables of an export and their columns: name, kind, SI unit, meaning.

They hold what the views hold, by the same names, so that a query over ``v_verdicts`` runs over
``verdicts`` as well. ``runs`` has parameters and verdicts as columns in place of JSON.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from adeye.store.metric_ids import METRIC_IDS

Kind = Literal["text", "number", "count", "flag"]

SUFFIX_UNITS: Final = {
    "m": "m",
    "s": "s",
    "s2": "s²",
    "mps": "m/s",
    "mps2": "m/s²",
    "mps3": "m/s³",
    "rad": "rad",
    "radps": "rad/s",
    "radps2": "rad/s²",
    "hz": "Hz",
    "pm": "1/m",
}
"""SI unit by the suffix that names of columns carry."""


@dataclass(frozen=True, slots=True)
class ExportColumn:
    """A column of an exported table.

    Attributes:
        name: As in the view.
        kind: Text, number (64-bit floating point), count (64-bit integer) or flag.
        unit: SI unit; empty for none.
        text: What it means; empty if the name says it.
        is_provenance: Whether it differs between two executions of one plan.
    """

    name: str
    kind: Kind
    unit: str = ""
    text: str = ""
    is_provenance: bool = False


@dataclass(frozen=True, slots=True)
class ExportTable:
    """An exported table.

    Attributes:
        name: Of the table, and of its file.
        view: The view that it is read from.
        text: What one row is.
        order: Columns that its rows are sorted by.
        columns: In the order of the file.
    """

    name: str
    view: str
    text: str
    order: tuple[str, ...]
    columns: tuple[ExportColumn, ...]


def unit_of(name: str) -> str:
    """Read the SI unit from the suffix of a name; empty if it has none.

    >>> unit_of("max_jerk_mps3"), unit_of("min_time_headway_s"), unit_of("campaign")
    ('m/s³', 's', '')
    """
    stem, _, suffix = name.rpartition("_")
    return SUFFIX_UNITS.get(suffix, "") if stem else ""


def _column(kind: Kind, name: str, text: str = "") -> ExportColumn:
    return ExportColumn(name, kind, unit_of(name) if kind == "number" else "", text)


def _texts(*names: str) -> tuple[ExportColumn, ...]:
    return tuple(_column("text", name) for name in names)


def _numbers(*names: str) -> tuple[ExportColumn, ...]:
    return tuple(_column("number", name) for name in names)


def _counts(*names: str) -> tuple[ExportColumn, ...]:
    return tuple(_column("count", name) for name in names)


def _flags(*names: str) -> tuple[ExportColumn, ...]:
    return tuple(_column("flag", name) for name in names)


_CAMPAIGN: Final = _column("text", "campaign", "id of the campaign")
_ORDINAL: Final = _column("count", "ordinal", "place of the test case in the plan, from 0")
_RUN: Final = _column("text", "run", "digest of the result")
_UNIT: Final = _column("text", "unit", "unit of margin, value and threshold")
_CASE: Final = (_CAMPAIGN, _ORDINAL, *_texts("scenario", "architecture", "fault_entry"))

PARAMETERS_AFTER: Final = "inside_odd"
"""Column of ``runs`` that those of the parameters follow."""

RUNS: Final = ExportTable(
    "runs",
    "v_runs",
    "one row a run: a planned test case without a result is not in it, but in verdicts",
    ("ordinal",),
    (
        *_CASE,
        *_counts("replicate", "seed"),
        *_flags("inside_odd"),
        _RUN,
        *_texts("test_case", "situation", "outcome", "outcome_channel", "outcome_detail"),
        *_flags("realised"),
        *_texts("end_reason"),
        *_numbers("duration_s"),
        *_texts("backend", "trace_digest"),
        *_flags("machine_dependent"),
        ExportColumn("executed_at", "text", text="UTC time of execution", is_provenance=True),
    ),
)
"""Without metrics, parameters and verdicts, which ``campaign_tables`` adds."""

VERDICTS: Final = ExportTable(
    "verdicts",
    "v_verdicts",
    "one row a run and FSR that it is judged on; NOT_RUN where there is no result",
    ("ordinal", "fsr"),
    (
        *_CASE,
        _RUN,
        *_texts("test_case", "fsr", "asil"),
        *_flags("mandatory"),
        *_texts("verdict"),
        *_flags("exercised"),
        _column("number", "margin", "signed distance to the threshold, in its unit"),
        _UNIT,
        *_numbers("robustness_low", "robustness_high"),
        *_texts("signal", "predicate"),
        *_numbers("time_s"),
        *_texts("actor"),
        *_numbers("value", "threshold"),
        *_texts("detail"),
    ),
)
EVENTS: Final = ExportTable(
    "events",
    "v_timeline",
    "one row an event of a run: storyboard, faults, monitors, handovers, contact",
    ("ordinal", "seq"),
    (*_CASE, _RUN, *_counts("seq"), *_numbers("time_s"), *_texts("kind", "subject", "text")),
)
FSR_STATUS: Final = ExportTable(
    "fsr_status",
    "v_fsr_status",
    "one row an FSR, architecture and scenario: runs by verdict, the worst one, folded verdict",
    ("fsr", "architecture", "scenario"),
    (
        _CAMPAIGN,
        *_texts("fsr", "architecture", "scenario", "asil"),
        *_flags("mandatory", "in_gate", "applicable"),
        *_texts("reason"),
        *_counts("min_exercised"),
        *_texts("waived_until"),
        *_counts("planned", "n_fail", "n_error", "n_invalid", "n_inconclusive", "n_vacuous"),
        *_counts("n_pass", "n_not_run", "exercised"),
        *_numbers("worst_margin"),
        _UNIT,
        *_numbers("worst_robustness"),
        *_texts("worst_run", "verdict"),
        *_counts("runs_exercised", "repeated", "repeated_pass"),
    ),
)

TABLES: Final = {item.name: item for item in (RUNS, VERDICTS, EVENTS, FSR_STATUS)}
"""Every table that can be exported, by name."""


def metric_columns() -> tuple[ExportColumn, ...]:
    """List value, status, time and actor of every built-in metric with unit and meaning."""
    from adeye.evaluation.metrics import METRICS

    found: list[ExportColumn] = []
    for name in METRIC_IDS:
        known = METRICS.get(name)
        unit = unit_of(name) if known is None or known.unit == "1" else known.unit
        found += [
            ExportColumn(name, "number", unit, "" if known is None else known.text),
            ExportColumn(f"{name}_status", "text", text=f"whether {name} has a value, and why not"),
            ExportColumn(f"{name}_time_s", "number", "s", f"time of the worst case of {name}"),
            ExportColumn(f"{name}_actor", "text", text=f"actor of the worst case of {name}"),
        ]
    return tuple(found)
