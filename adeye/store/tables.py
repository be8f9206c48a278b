"""The tables of the database, as SQLAlchemy Core.

Every table but ``work`` and ``artifact`` is insert-only and carries ``row_hash``, a hash over the
row's other values, so that ``verify`` can name a row that was altered. JSON is kept as canonical
text, because the text is what is hashed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    Column,
    ForeignKey,
    Index,
    Integer,
    MetaData,
    Table,
)

from adeye.store import basis_tables, column_kinds
from adeye.store.case_tables import case_count as case_count
from adeye.store.case_tables import case_match as case_match
from adeye.store.case_tables import case_repeat as case_repeat
from adeye.store.case_tables import case_run as case_run
from adeye.store.case_tables import case_tally as case_tally
from adeye.store.case_tables import never_held as never_held
from adeye.store.certificate_tables import certificate as certificate
from adeye.store.column_kinds import coded
from adeye.store.concept_tables import allocation as allocation
from adeye.store.concept_tables import assumption as assumption
from adeye.store.concept_tables import decomposition as decomposition
from adeye.store.concept_tables import decomposition_child as decomposition_child
from adeye.store.concept_tables import dependent_failure as dependent_failure
from adeye.store.concept_tables import element as element
from adeye.store.concept_tables import element_relation as element_relation
from adeye.store.concept_tables import fsr as fsr
from adeye.store.concept_tables import hazardous_event as hazardous_event
from adeye.store.concept_tables import safety_goal as safety_goal
from adeye.store.evidence_tables import campaign_root as campaign_root
from adeye.store.evidence_tables import ledger as ledger
from adeye.store.evidence_tables import seal as seal
from adeye.store.evidence_tables import session as session
from adeye.store.evidence_tables import withdrawal as withdrawal
from adeye.store.half_tables import half_step as half_step
from adeye.store.half_tables import uncertainty as uncertainty
from adeye.store.metric_ids import CRITICALITY_IDS, FIRST_METRIC_IDS, TIMING_IDS
from adeye.store.metric_ids import METRIC_IDS as METRIC_IDS

if TYPE_CHECKING:
    from collections.abc import Sequence

METRIC_STATUSES: Final = (
    "value", "no_conflict", "not_applicable", "undefined", "incomplete", "error"
)  # fmt: skip
WORK_STATES: Final = ("pending", "leased", "done", "quarantined")
RUN_VERDICTS: Final = ("PASS", "FAIL", "INCONCLUSIVE", "VACUOUS", "INVALID", "ERROR")
"""Verdicts that a row can have; NOT_RUN is the absence of a row."""

INJECTION_CLASSES: Final = (
    "not_activated", "masked", "detected_in_time", "detected_late", "undetected_no_violation",
    "undetected_violation",
)  # fmt: skip
TAKEOVER_CLASSES: Final = ("needed_and_done", "late", "spurious", "missed", "not_needed")
MOMENTS: Final = (
    "fault", "effect", "deviation", "detect", "switch", "brake", "emergency", "safe", "violation"
)  # fmt: skip
"""Times of a timeline."""

metadata = column_kinds.metadata
_digest, _text = column_kinds.digest_column, column_kinds.text_column
_number, _count = column_kinds.number_column, column_kinds.count_column
_flag, _row_hash, _one_of = (
    column_kinds.flag_column,
    column_kinds.row_hash_column,
    column_kinds.one_of,
)


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


def _content(name: str) -> Table:
    columns = (_text("id"), _text("version"), _text("content"), _row_hash())
    return Table(name, metadata, _digest("digest", key=True), *columns)


odd = _content("odd")
scenario = _content("scenario")
architecture = _content("architecture")
concept = _content("concept")

test_case = Table(
    "test_case",
    metadata,
    _digest("digest", key=True),
    _digest("situation_digest"),
    _digest("scenario_digest", "scenario.digest"),
    _digest("architecture_digest", "architecture.digest"),
    _text("fault_entry"),
    _text("faults"),
    _text("parameters"),
    _count("replicate"),
    Column("seed", BigInteger, nullable=False),
    _number("step_s", null=False),
    _digest("odd_digest", "odd.digest"),
    _count("point_index"),
    _row_hash(),
    Index(None, "situation_digest"),
)

campaign = Table(
    "campaign",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("id", coded(32), nullable=False, unique=True),
    _text("created_at"),
    _text("odd_id"),
    _digest("odd_digest", "odd.digest"),
    _digest("concept_digest", "concept.digest"),
    _text("title"),
    _count("planned"),
    _text("factors"),
    _text("gate"),
    _text("units"),
    _text("judging"),
    _digest("judging_hash"),
    _text("provenance"),
    _row_hash(),
)
campaign_use = Table(
    "campaign_use",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    _campaign(),
    _text("at"),
    _row_hash(),
)
"""Which campaign was planned again after another one: going back to former files makes no new
campaign, and yet that one is the latest."""
campaign_case = Table(
    "campaign_case",
    metadata,
    _campaign(key=True),
    _count("ordinal", key=True),
    _digest("test_case_digest", "test_case.digest"),
    _digest("result_digest"),
    _text("scenario"),
    _text("architecture"),
    _flag("inside_odd"),
    _text("point"),
    _row_hash(),
    Index(None, "test_case_digest", "campaign_id"),
    Index(None, "result_digest"),
)
campaign_fsr = Table(
    "campaign_fsr",
    metadata,
    _campaign(key=True),
    _text("fsr_id", key=True),
    _text("architecture", key=True),
    _text("scenario", key=True),
    _digest("fsr_digest"),
    _text("asil"),
    _flag("mandatory"),
    _count("min_exercised"),
    _text("applies"),
    _flag("in_gate"),
    _flag("applicable"),
    _text("reason", null=True),
    _text("waived_until", null=True),
    _count("planned"),
    _row_hash(),
    _one_of("applies", ("inside", "outside", "everywhere"), "applies"),
)

work = Table(
    "work",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=True),
    _campaign(),
    _text("kind"),
    _count("from_ordinal"),
    _count("to_ordinal"),
    _text("state"),
    _text("owner", null=True),
    _count("attempt"),
    _count("failures"),
    _text("until", null=True),
    _number("until_boot_s"),
    _text("detail", null=True),
    _one_of("kind", ("execute", "judge", "reused"), "kind"),
    _one_of("state", WORK_STATES, "state"),
    CheckConstraint("from_ordinal < to_ordinal", name="range"),
    CheckConstraint("(state = 'leased') = (owner IS NOT NULL)", name="owner"),
    Index(None, "campaign_id", "state"),
)

run = Table(
    "run",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("result_digest", coded(64), nullable=False, unique=True),
    _digest("test_case_digest", "test_case.digest"),
    _text("backend"),
    _text("variant"),
    _count("numerics_version"),
    _text("plugins_digest"),
    _text("outcome"),
    _text("outcome_channel", null=True),
    _text("outcome_detail", null=True),
    _count("trace_rows"),
    _number("duration_s", null=False),
    Column("trace_digest", coded(32), nullable=False),
    _flag("realised"),
    _text("end_reason"),
    _flag("machine_dependent"),
    Column("result_hash", coded(64), nullable=False),
    _text("executed_by"),
    _text("executed_at"),
    _row_hash(),
)


def _run() -> Column[int]:
    """Refer to a run by its number: digests would scatter the rows of a block over the file."""
    key = ForeignKey(run.c.number)
    return Column("run_number", Integer, key, primary_key=True, autoincrement=False)


def make_metric_table(name: str, into: MetaData, metric_ids: Sequence[str]) -> Table:
    """Describe a wide table of metrics: value, status, time and actor of each, one row a run.

    Args:
        name: Name of the table.
        into: Collection of tables that it becomes part of.
        metric_ids: Identifiers in SQL, checked by the caller.
    """
    columns: list[Column[str] | Column[float]] = []
    checks: list[CheckConstraint] = []
    for metric_id in metric_ids:
        columns += [
            _number(metric_id),
            _text(f"{metric_id}_status"),
            _number(f"{metric_id}_time_s"),
            _text(f"{metric_id}_actor", null=True),
        ]
        empty = " ".join(f"WHEN '{word}' THEN {metric_id} IS NULL" for word in METRIC_STATUSES[1:])
        value = f"WHEN 'value' THEN {metric_id} IS NOT NULL"
        for dialect, nothing in (("sqlite", "0"), ("postgresql", "FALSE")):
            rule = f"CASE {metric_id}_status {value} {empty} ELSE {nothing} END"
            checks.append(CheckConstraint(rule, name=metric_id).ddl_if(dialect=dialect))
    return Table(name, into, _run(), *columns, _row_hash(), *checks)


metric = make_metric_table("metric", metadata, FIRST_METRIC_IDS)
timing = make_metric_table("timing", metadata, TIMING_IDS)
criticality = make_metric_table("criticality", metadata, CRITICALITY_IDS)
verdict = Table(
    "verdict",
    metadata,
    _run(),
    _digest("fsr_digest", key=True),
    _text("fsr_id"),
    _text("verdict"),
    _number("robustness_low"),
    _number("robustness_high"),
    _number("margin"),
    _text("unit", null=True),
    _text("signal", null=True),
    _text("predicate", null=True),
    _number("time_s"),
    _text("actor", null=True),
    _number("value"),
    _number("threshold"),
    _flag("exercised"),
    _text("detail", null=True),
    _row_hash(),
    _one_of("verdict", RUN_VERDICTS, "verdict"),
    sqlite_with_rowid=False,
)
event = Table(
    "event",
    metadata,
    _run(),
    _count("seq", key=True),
    _number("time_s", null=False),
    _text("kind"),
    _text("subject", null=True),
    _text("text"),
    _row_hash(),
    sqlite_with_rowid=False,
)
chain = Table("chain", metadata, _run(), _count("every_rows"), _text("links"), _row_hash())
fork = Table(
    "fork",
    metadata,
    _digest("result_digest", "run.result_digest", key=True),
    _digest("test_case_digest", "test_case.digest"),
    _digest("origin_digest", "run.result_digest"),
    _count("from_tick"),
    _text("authority"),
    _row_hash(),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
injection = Table(
    "injection",
    metadata,
    _digest("result_digest", "run.result_digest", key=True),
    _count("version", key=True),
    *(_number(f"{name}_s") for name in MOMENTS),
    *(_number(f"{name}_s") for name in ("fdti", "frti", "fhti", "eoti", "ftti")),
    _number("fault_free_violation_s"),
    _text("class"),
    _text("without_mechanism"),
    _text("twins"),
    _row_hash(),
    _one_of("class", INJECTION_CLASSES, "class"),
)
takeover = Table(
    "takeover",
    metadata,
    _digest("fork_digest", "fork.result_digest", key=True),
    _count("version", key=True),
    _text("class"),
    _number("takeover_s"),
    _number("violation_s"),
    _number("fork_violation_s"),
    _row_hash(),
    _one_of("class", TAKEOVER_CLASSES, "class"),
)
benchmark = Table(
    "benchmark",
    metadata,
    _digest("result_digest", "run.result_digest", key=True),
    *(_text("model", key=True), _text("edition", key=True), _count("version", key=True)),
    *(_digest("drive_digest", "run.result_digest"), _row_hash(), Index(None, "drive_digest")),
)
tally = Table(
    "tally",
    metadata,
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    _campaign(),
    _text("fsr_id", key=True),
    _digest("fsr_digest"),
    _text("architecture", key=True),
    _text("scenario", key=True),
    _text("verdict", key=True),
    _count("runs"),
    _count("exercised"),
    _number("worst_robustness"),
    _number("worst_margin"),
    _text("worst_unit", null=True),
    _digest("worst_result_digest", "run.result_digest"),
    _row_hash(),
    _one_of("verdict", RUN_VERDICTS, "verdict"),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
artifact = Table(
    "artifact",
    metadata,
    _digest("digest", key=True),
    _text("kind"),
    Column("result_digest", coded(64), ForeignKey("run.result_digest"), nullable=True),
    _count("bytes"),
    _text("created_at"),
    Index(None, "result_digest"),
)

INSERT_ONLY: Final = tuple(item for item in metadata.sorted_tables if item not in {work, artifact})
"""Tables whose rows are never changed or deleted, in dependency order."""

RESULTS: Final = (run, metric, timing, criticality, verdict, event, chain, *basis_tables.RESULTS)
"""Tables written a block at a time; ``columns`` hashes their rows."""

NONDETERMINISTIC: Final = {
    "run": ("number", "executed_by", "executed_at", "row_hash"),
    "tally": ("work_id", "row_hash"),
    "case_run": ("run_number", "row_hash"),
    "case_tally": ("work_id", "row_hash"),
    "campaign": ("number", "created_at", "provenance", "row_hash"),
    "campaign_use": ("number", "at", "row_hash"),
    "certificate": ("number", "at", "row_hash"),
}
"""Columns that differ between two executions of one plan and are in no result hash."""
