"""The tables of campaigns and runs: those that whoever looks for a run asks.

They are few of ``tables``, which takes a while to describe.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from sqlalchemy import BigInteger, CheckConstraint, Column, Index, Integer, MetaData, Table

from adeye.store.table_parts import (
    METRIC_STATUSES,
    WORK_STATES,
    campaign_column,
    coded,
    counts,
    digest_column,
    flags,
    insert_only,
    metadata,
    numbers,
    one_of,
    place_number,
    row_hash_column,
    run_number,
    texts,
)

# --- What users wrote -----------------------------------------------------------------------------


def _content(name: str) -> Table:
    return insert_only(name, digest_column("digest", key=True), *texts("id", "version", "content"))


CONTENT: Final = {name: _content(name) for name in ("odd", "scenario", "architecture", "concept")}
"""What users wrote, by its kind."""

# --- Campaigns: their cases, the requirements that these are judged by, and the work --------------

test_case = insert_only(
    "test_case",
    digest_column("digest", key=True),
    digest_column("situation_digest"),
    digest_column("scenario_digest", "scenario.digest"),
    digest_column("architecture_digest", "architecture.digest"),
    *texts("fault_entry", "faults", "parameters"),
    *counts("replicate"),
    Column("seed", BigInteger, nullable=False),
    *numbers("step_s", null=False),
    digest_column("odd_digest", "odd.digest"),
    *counts("point_index"),
    Index(None, "situation_digest"),
)

campaign = insert_only(
    "campaign",
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("id", coded(32), nullable=False, unique=True),
    *texts("created_at", "odd_id"),
    digest_column("odd_digest", "odd.digest"),
    digest_column("concept_digest", "concept.digest"),
    *texts("title"),
    *counts("planned"),
    *texts("factors", "gate", "units", "judging"),
    digest_column("judging_hash"),
    *texts("provenance"),
)
campaign_use = insert_only(
    "campaign_use",
    Column("number", Integer, primary_key=True, autoincrement=True),
    campaign_column(),
    *texts("at"),
)
"""Which campaign was planned again after another one: going back to former files makes no new
campaign, and yet that one is the latest."""
campaign_case = insert_only(
    "campaign_case",
    campaign_column(key=True),
    *counts("ordinal", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("result_digest"),
    *texts("scenario", "architecture"),
    *flags("inside_odd"),
    *texts("point"),
    Index(None, "test_case_digest", "campaign_id"),
    Index(None, "result_digest"),
)
campaign_fsr = insert_only(
    "campaign_fsr",
    campaign_column(key=True),
    *texts("fsr_id", "architecture", "scenario", key=True),
    digest_column("fsr_digest"),
    *texts("asil"),
    *flags("mandatory"),
    *counts("min_exercised"),
    *texts("applies"),
    *flags("in_gate", "applicable"),
    *texts("reason", "waived_until", null=True),
    *counts("planned"),
    one_of("applies", ("inside", "outside", "everywhere"), "applies"),
)

work = Table(
    "work",
    metadata,
    Column("id", Integer, primary_key=True, autoincrement=True),
    campaign_column(),
    *texts("kind"),
    *counts("from_ordinal", "to_ordinal"),
    *texts("state"),
    *texts("owner", null=True),
    *counts("attempt", "failures"),
    *texts("until", null=True),
    *numbers("until_boot_s"),
    *texts("detail", null=True),
    one_of("kind", ("execute", "judge", "reused"), "kind"),
    one_of("state", WORK_STATES, "state"),
    CheckConstraint("from_ordinal < to_ordinal", name="range"),
    CheckConstraint("(state = 'leased') = (owner IS NOT NULL)", name="owner"),
    Index(None, "campaign_id", "state"),
)

run = insert_only(
    "run",
    Column("number", Integer, primary_key=True, autoincrement=True),
    Column("result_digest", coded(64), nullable=False, unique=True),
    digest_column("test_case_digest", "test_case.digest"),
    *texts("backend", "variant"),
    *counts("numerics_version"),
    *texts("plugins_digest", "outcome"),
    *texts("outcome_channel", "outcome_detail", null=True),
    *counts("trace_rows"),
    *numbers("duration_s", null=False),
    Column("trace_digest", coded(32), nullable=False),
    *flags("realised"),
    *texts("end_reason"),
    *flags("machine_dependent"),
    Column("result_hash", coded(64), nullable=False),
    *texts("executed_by", "executed_at"),
)

# --- Runs beside runs, and those that are no evidence any more ------------------------------------

half_step = insert_only(
    "half_step",
    digest_column("result_digest", "run.result_digest", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("origin_digest"),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
fork = insert_only(
    "fork",
    digest_column("result_digest", "run.result_digest", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("origin_digest", "run.result_digest"),
    *counts("from_tick"),
    *texts("authority"),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
benchmark = insert_only(
    "benchmark",
    digest_column("result_digest", "run.result_digest", key=True),
    *texts("model", "edition", key=True),
    *counts("version", key=True),
    digest_column("drive_digest", "run.result_digest"),
    Index(None, "drive_digest"),
)
withdrawal = insert_only(
    "withdrawal",
    place_number(),
    digest_column("result_digest", "run.result_digest"),
    *texts("at", "author", "reason"),
    Index(None, "result_digest"),
)
"""Results that are no evidence any more. They stay as they are."""


# --- Wide tables of metrics, a row a run ----------------------------------------------------------


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
            *numbers(metric_id),
            *texts(f"{metric_id}_status"),
            *numbers(f"{metric_id}_time_s"),
            *texts(f"{metric_id}_actor", null=True),
        ]
        needs = dict.fromkeys(METRIC_STATUSES, f"{metric_id} IS NULL")
        # It may tell how bad it is at least.
        needs |= {
            "value": f"{metric_id} IS NOT NULL",
            "incomplete": f"{metric_id}_status IS NOT NULL",
        }
        cases = " ".join(f"WHEN '{word}' THEN {need}" for word, need in needs.items())
        for dialect, nothing in (("sqlite", "0"), ("postgresql", "FALSE")):
            rule = f"CASE {metric_id}_status {cases} ELSE {nothing} END"
            checks.append(CheckConstraint(rule, name=metric_id).ddl_if(dialect=dialect))
    return Table(name, into, run_number(run.c.number), *columns, row_hash_column(), *checks)
