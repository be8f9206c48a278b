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

from adeye.store import basis_tables
from adeye.store.case_tables import case_count as case_count
from adeye.store.case_tables import case_match as case_match
from adeye.store.case_tables import case_repeat as case_repeat
from adeye.store.case_tables import case_run as case_run
from adeye.store.case_tables import case_tally as case_tally
from adeye.store.case_tables import never_held as never_held
from adeye.store.certificate_tables import certificate as certificate
from adeye.store.column_kinds import (
    coded,
    count_column,
    digest_column,
    flag_column,
    number_column,
    one_of,
    row_hash_column,
    text_column,
)
from adeye.store.column_kinds import metadata as metadata
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


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


def _content(name: str) -> Table:
    columns = (text_column("id"), text_column("version"), text_column("content"), row_hash_column())
    return Table(name, metadata, digest_column("digest", key=True), *columns)


odd = _content("odd")
scenario = _content("scenario")
architecture = _content("architecture")
concept = _content("concept")

test_case = Table(
    "test_case",
    metadata,
    digest_column("digest", key=True),
    digest_column("situation_digest"),
    digest_column("scenario_digest", "scenario.digest"),
    digest_column("architecture_digest", "architecture.digest"),
    text_column("fault_entry"),
    text_column("faults"),
    text_column("parameters"),
    count_column("replicate"),
    Column("seed", BigInteger, nullable=False),
    number_column("step_s", null=False),
    digest_column("odd_digest", "odd.digest"),
    count_column("point_index"),
    row_hash_column(),
    Index(None, "situation_digest"),
)

campaign = Table(
    "campaign",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("id", coded(32), nullable=False, unique=True),
    text_column("created_at"),
    text_column("odd_id"),
    digest_column("odd_digest", "odd.digest"),
    digest_column("concept_digest", "concept.digest"),
    text_column("title"),
    count_column("planned"),
    text_column("factors"),
    text_column("gate"),
    text_column("units"),
    text_column("judging"),
    digest_column("judging_hash"),
    text_column("provenance"),
    row_hash_column(),
)
campaign_use = Table(
    "campaign_use",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    _campaign(),
    text_column("at"),
    row_hash_column(),
)
"""Which campaign was planned again after another one: going back to former files makes no new
campaign, and yet that one is the latest."""
campaign_case = Table(
    "campaign_case",
    metadata,
    _campaign(key=True),
    count_column("ordinal", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("result_digest"),
    text_column("scenario"),
    text_column("architecture"),
    flag_column("inside_odd"),
    text_column("point"),
    row_hash_column(),
    Index(None, "test_case_digest", "campaign_id"),
    Index(None, "result_digest"),
)
campaign_fsr = Table(
    "campaign_fsr",
    metadata,
    _campaign(key=True),
    text_column("fsr_id", key=True),
    text_column("architecture", key=True),
    text_column("scenario", key=True),
    digest_column("fsr_digest"),
    text_column("asil"),
    flag_column("mandatory"),
    count_column("min_exercised"),
    text_column("applies"),
    flag_column("in_gate"),
    flag_column("applicable"),
    text_column("reason", null=True),
    text_column("waived_until", null=True),
    count_column("planned"),
    row_hash_column(),
    one_of("applies", ("inside", "outside", "everywhere"), "applies"),
)

work = Table(
    "work",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=True),
    _campaign(),
    text_column("kind"),
    count_column("from_ordinal"),
    count_column("to_ordinal"),
    text_column("state"),
    text_column("owner", null=True),
    count_column("attempt"),
    count_column("failures"),
    text_column("until", null=True),
    number_column("until_boot_s"),
    text_column("detail", null=True),
    one_of("kind", ("execute", "judge", "reused"), "kind"),
    one_of("state", WORK_STATES, "state"),
    CheckConstraint("from_ordinal < to_ordinal", name="range"),
    CheckConstraint("(state = 'leased') = (owner IS NOT NULL)", name="owner"),
    Index(None, "campaign_id", "state"),
)

run = Table(
    "run",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("result_digest", coded(64), nullable=False, unique=True),
    digest_column("test_case_digest", "test_case.digest"),
    text_column("backend"),
    text_column("variant"),
    count_column("numerics_version"),
    text_column("plugins_digest"),
    text_column("outcome"),
    text_column("outcome_channel", null=True),
    text_column("outcome_detail", null=True),
    count_column("trace_rows"),
    number_column("duration_s", null=False),
    Column("trace_digest", coded(32), nullable=False),
    flag_column("realised"),
    text_column("end_reason"),
    flag_column("machine_dependent"),
    Column("result_hash", coded(64), nullable=False),
    text_column("executed_by"),
    text_column("executed_at"),
    row_hash_column(),
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
            number_column(metric_id),
            text_column(f"{metric_id}_status"),
            number_column(f"{metric_id}_time_s"),
            text_column(f"{metric_id}_actor", null=True),
        ]
        empty = " ".join(f"WHEN '{word}' THEN {metric_id} IS NULL" for word in METRIC_STATUSES[1:])
        value = f"WHEN 'value' THEN {metric_id} IS NOT NULL"
        for dialect, nothing in (("sqlite", "0"), ("postgresql", "FALSE")):
            rule = f"CASE {metric_id}_status {value} {empty} ELSE {nothing} END"
            checks.append(CheckConstraint(rule, name=metric_id).ddl_if(dialect=dialect))
    return Table(name, into, _run(), *columns, row_hash_column(), *checks)


metric = make_metric_table("metric", metadata, FIRST_METRIC_IDS)
timing = make_metric_table("timing", metadata, TIMING_IDS)
criticality = make_metric_table("criticality", metadata, CRITICALITY_IDS)
verdict = Table(
    "verdict",
    metadata,
    _run(),
    digest_column("fsr_digest", key=True),
    text_column("fsr_id"),
    text_column("verdict"),
    number_column("robustness_low"),
    number_column("robustness_high"),
    number_column("margin"),
    text_column("unit", null=True),
    text_column("signal", null=True),
    text_column("predicate", null=True),
    number_column("time_s"),
    text_column("actor", null=True),
    number_column("value"),
    number_column("threshold"),
    flag_column("exercised"),
    text_column("detail", null=True),
    row_hash_column(),
    one_of("verdict", RUN_VERDICTS, "verdict"),
    sqlite_with_rowid=False,
)
event = Table(
    "event",
    metadata,
    _run(),
    count_column("seq", key=True),
    number_column("time_s", null=False),
    text_column("kind"),
    text_column("subject", null=True),
    text_column("text"),
    row_hash_column(),
    sqlite_with_rowid=False,
)
chain = Table(
    "chain", metadata, _run(), count_column("every_rows"), text_column("links"), row_hash_column()
)
fork = Table(
    "fork",
    metadata,
    digest_column("result_digest", "run.result_digest", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("origin_digest", "run.result_digest"),
    count_column("from_tick"),
    text_column("authority"),
    row_hash_column(),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
injection = Table(
    "injection",
    metadata,
    digest_column("result_digest", "run.result_digest", key=True),
    count_column("version", key=True),
    *(number_column(f"{name}_s") for name in MOMENTS),
    *(number_column(f"{name}_s") for name in ("fdti", "frti", "fhti", "eoti", "ftti")),
    number_column("fault_free_violation_s"),
    text_column("class"),
    text_column("without_mechanism"),
    text_column("twins"),
    row_hash_column(),
    one_of("class", INJECTION_CLASSES, "class"),
)
takeover = Table(
    "takeover",
    metadata,
    digest_column("fork_digest", "fork.result_digest", key=True),
    count_column("version", key=True),
    text_column("class"),
    number_column("takeover_s"),
    number_column("violation_s"),
    number_column("fork_violation_s"),
    row_hash_column(),
    one_of("class", TAKEOVER_CLASSES, "class"),
)
benchmark = Table(
    "benchmark",
    metadata,
    digest_column("result_digest", "run.result_digest", key=True),
    *(
        text_column("model", key=True),
        text_column("edition", key=True),
        count_column("version", key=True),
    ),
    *(
        digest_column("drive_digest", "run.result_digest"),
        row_hash_column(),
        Index(None, "drive_digest"),
    ),
)
tally = Table(
    "tally",
    metadata,
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    _campaign(),
    text_column("fsr_id", key=True),
    digest_column("fsr_digest"),
    text_column("architecture", key=True),
    text_column("scenario", key=True),
    text_column("verdict", key=True),
    count_column("runs"),
    count_column("exercised"),
    number_column("worst_robustness"),
    number_column("worst_margin"),
    text_column("worst_unit", null=True),
    digest_column("worst_result_digest", "run.result_digest"),
    row_hash_column(),
    one_of("verdict", RUN_VERDICTS, "verdict"),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
artifact = Table(
    "artifact",
    metadata,
    digest_column("digest", key=True),
    text_column("kind"),
    Column("result_digest", coded(64), ForeignKey("run.result_digest"), nullable=True),
    count_column("bytes"),
    text_column("created_at"),
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
