"""The tables of the database, as SQLAlchemy Core.

Every table but ``work`` and ``artifact`` is insert-only and carries ``row_hash``, a hash over the
row's other values, so that ``verify`` can name a row that was altered. JSON is kept as canonical
text, because the text is what is hashed.

They are in no result hash: a run from before they were there is judged again by executing it.

Every one can be told from plan and results, which ``verification`` does; they are there so that the
views need not look at a million test cases.

The rows of ``metric`` are part of the hash of a result. A metric that came later must not change
what was hashed: it stands in a table of its own, and a result that is older lacks it.
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

from adeye.store.evidence_tables import allocation as allocation
from adeye.store.evidence_tables import assumption as assumption
from adeye.store.evidence_tables import campaign_root as campaign_root
from adeye.store.evidence_tables import certificate as certificate
from adeye.store.evidence_tables import (
    coded,
    count_column,
    digest_column,
    flag_column,
    number_column,
    one_of,
    row_hash_column,
    text_column,
)
from adeye.store.evidence_tables import decomposition as decomposition
from adeye.store.evidence_tables import decomposition_child as decomposition_child
from adeye.store.evidence_tables import dependent_failure as dependent_failure
from adeye.store.evidence_tables import element as element
from adeye.store.evidence_tables import element_relation as element_relation
from adeye.store.evidence_tables import fsr as fsr
from adeye.store.evidence_tables import half_step as half_step
from adeye.store.evidence_tables import hazardous_event as hazardous_event
from adeye.store.evidence_tables import ledger as ledger
from adeye.store.evidence_tables import metadata as metadata
from adeye.store.evidence_tables import safety_goal as safety_goal
from adeye.store.evidence_tables import seal as seal
from adeye.store.evidence_tables import session as session
from adeye.store.evidence_tables import uncertainty as uncertainty
from adeye.store.evidence_tables import withdrawal as withdrawal

if TYPE_CHECKING:
    from collections.abc import Sequence

# --- Tables of what it takes to judge a run again without its trace -------------------------------


def _run_number() -> Column[int]:
    key = ForeignKey("run.number")
    return Column("run_number", Integer, key, primary_key=True, autoincrement=False)


uid_set = Table(
    "uid_set", metadata, digest_column("digest", key=True), text_column("uids"), row_hash_column()
)
basis = Table(
    "basis",
    metadata,
    _run_number(),
    count_column("version", key=True),
    digest_column("uid_set_digest", "uid_set.digest"),
    flag_column("by_contact"),
    text_column("invalid", null=True),
    row_hash_column(),
)
extreme = Table(
    "extreme",
    metadata,
    _run_number(),
    text_column("measure", key=True),
    count_column("version", key=True),
    number_column("value"),
    number_column("time_s"),
    text_column("actor", null=True),
    text_column("samples"),
    row_hash_column(),
    sqlite_with_rowid=False,
)
kept_trace = Table(
    "kept_trace",
    metadata,
    _run_number(),
    text_column("file", key=True),
    count_column("place"),
    row_hash_column(),
)

BASIS_RESULTS: Final = (basis, extreme, kept_trace)
"""Of these, the tables written a block at a time."""


# --- Tables about the cases of a campaign: counts of them, what pairs them, and their runs --------


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


case_count = Table(
    "case_count",
    metadata,
    _campaign(key=True),
    text_column("scenario", key=True),
    text_column("architecture", key=True),
    text_column("fault_entry", key=True),
    count_column("planned"),
    row_hash_column(),
)
"""How many cases a campaign plans."""

case_match = Table(
    "case_match",
    metadata,
    _campaign(key=True),
    count_column("first_ordinal", key=True),
    count_column("ordinal", key=True),
    text_column("fault_entry"),
    row_hash_column(),
    sqlite_with_rowid=False,
)
"""Cases of several architectures in one situation of a scenario under the same faults: they go by
the first of them, so that those of one situation lie together and in the order of the plan."""

case_run = Table(
    "case_run",
    metadata,
    _campaign(key=True),
    count_column("ordinal", key=True),
    Column("run_number", Integer, ForeignKey("run.number"), nullable=False),
    row_hash_column(),
    sqlite_with_rowid=False,
)
"""The run of each case of the blocks that are done, by its number."""

case_tally = Table(
    "case_tally",
    metadata,
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    _campaign(),
    text_column("scenario", key=True),
    text_column("architecture", key=True),
    text_column("fault_entry", key=True),
    count_column("runs"),
    count_column("exercised"),
    row_hash_column(),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
"""How many cases of a block that is done have a run, and a run that exercises an FSR."""

case_repeat = Table(
    "case_repeat",
    metadata,
    _campaign(key=True),
    text_column("fsr_id", key=True),
    text_column("architecture", key=True),
    text_column("scenario", key=True),
    count_column("passed"),
    count_column("exercised"),
    count_column("unheld"),
    row_hash_column(),
)
"""How many of the runs that PASS, or exercise, an FSR repeat the result of another such run, once
all blocks are done: over all scenarios (an empty word) whether one does or not, with the number of
rows of ``never_held``, so that none is lost unseen; in a scenario only where one does."""

never_held = Table(
    "never_held",
    metadata,
    _campaign(key=True),
    text_column("fsr_id", key=True),
    text_column("architecture", key=True),
    count_column("place", key=True),
    text_column("antecedent"),
    flag_column("decides"),
    row_hash_column(),
)
"""Implications below the top level whose antecedent held in no run that PASSes, once all blocks are
done; they decide where a run satisfies the FSR only because of that."""

RECOUNTED: Final = (case_count, case_match, case_run, case_tally, case_repeat, never_held)
"""Tables that plan and results tell whole: verification makes them again instead of trusting a
ledger, which would list a million of their rows."""


# --- Built-in metrics by the table that holds them ------------------------------------------------

FIRST_METRIC_IDS: Final = (
    "contact",
    "impact_speed_mps",
    "min_distance_m",
    "min_ttc_s",
    "min_time_headway_s",
    "max_drac_mps2",
    "max_required_deceleration_mps2",
    "rss_violation_s",
    "fault_to_safe_state_s",
    "max_jerk_mps3",
    "max_deceleration_mps2",
    "max_lane_offset_m",
    "first_detection_distance_m",
    "takeover_time_s",
    "standstill_gap_m",
    "detection_latency_s",
    "missed_time_s",
    "false_track_time_s",
    "range_error_rms_m",
    "position_error_p95_m",
    "rear_detection_margin_m",
)
"""Of the first schema, in ``metric``."""

TIMING_IDS: Final = (
    "fault_detection_time_s",
    "fault_reaction_time_s",
    "fault_handling_time_s",
    "emergency_operation_time_s",
    "nominal_availability",
    "takeovers",
    "trips",
    "stop_rating",
    "stop_regret",
)
"""In the table ``timing``."""

CRITICALITY_IDS: Final = (
    "min_time_gap_s",
    "min_mttc_s",
    "min_ettc_s",
    "max_mdrac_mps2",
    "max_dst_mps2",
    "min_mtc",
    "min_psd",
    "max_btn",
    "max_stn",
    "min_ttb_s",
    "min_tts_s",
    "min_ttk_s",
    "min_ttr_s",
    "tet_s",
    "tit_s2",
    "tet_share",
    "tit_mean_s",
    "crash_potential",
    "time_to_accident_s",
    "min_rss_ratio",
    "rss_response_violation_s",
    "min_ttc_2d_s",
    "min_wttc_s",
    "min_dce_m",
    "min_ttce_s",
    "min_pet_s",
    "pet_overlap_s",
    "max_encroachment_time_s",
    "min_predicted_pet_s",
    "min_rear_ttc_s",
    "max_follower_deceleration_mps2",
    "delta_v_mps",
    "other_delta_v_mps",
    "fatality_probability",
    "max_acceleration_mps2",
    "max_lateral_acceleration_mps2",
    "max_total_jerk_mps3",
    "max_yaw_rate_radps",
    "max_yaw_acceleration_radps2",
    "uncomfortable_time_s",
    "contact_at_fault",
    "distance_to_safe_state_m",
    "max_acceleration_disagreement_mps2",
    "max_steering_disagreement_rad",
)
"""In the table ``criticality``."""

METRIC_IDS: Final = (*FIRST_METRIC_IDS, *TIMING_IDS, *CRITICALITY_IDS)
"""All of them, four columns each: value, status, time of the worst case, actor."""

TABLES: Final = {
    "metric": FIRST_METRIC_IDS,
    "timing": TIMING_IDS,
    "criticality": CRITICALITY_IDS,
}
"""The tables that hold them."""


# --- The tables of the database, as SQLAlchemy Core -----------------------------------------------

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

RESULTS: Final = (run, metric, timing, criticality, verdict, event, chain, *BASIS_RESULTS)
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
