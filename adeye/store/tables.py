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

from typing import Final

from sqlalchemy import (
    BigInteger,
    CheckConstraint,
    Column,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    String,
    Table,
)
from sqlalchemy.schema import SchemaItem

from adeye.store.run_tables import (
    CONTENT,
    benchmark,
    campaign,
    campaign_case,
    campaign_fsr,
    campaign_use,
    fork,
    half_step,
    make_metric_table,
    run,
    test_case,
    withdrawal,
    work,
)
from adeye.store.table_parts import (
    INJECTION_CLASSES,
    INTERVALS,
    METRIC_IDS,
    MOMENTS,
    RUN_VERDICTS,
    TABLES,
    TAKEOVER_CLASSES,
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
    run_number,
    texts,
)

# Who asks for all tables finds these here, too.
__all__ = [
    "CONTENT", "INTERVALS", "METRIC_IDS", "MOMENTS", "RUN_VERDICTS",
    "TABLES", "benchmark", "campaign", "campaign_case", "campaign_fsr",
    "campaign_use", "fork", "half_step", "make_metric_table", "metadata", "run", "test_case",
    "withdrawal", "work",
]  # fmt: skip

# --- The tables that a concept is taken apart into, for people who ask with SQL -------------------


def _part(name: str, *columns: SchemaItem) -> Table:
    key = digest_column("concept_digest", "concept.digest", key=True)
    return insert_only(name, key, *texts("id", key=True), *columns, *texts("content"))


hazardous_event = _part(
    "hazardous_event",
    *texts("severity", "exposure", "controllability"),
    *texts("asil", null=True),
)
safety_goal = _part(
    "safety_goal",
    *texts("asil"),
    *numbers("ftti_s", null=False),
    *texts("safe_state", "text"),
)
fsr = _part(
    "fsr",
    *texts("asil"),
    *flags("mandatory"),
    *counts("min_exercised"),
    *texts("text", "measure", "threshold_source"),
)
element = _part(
    "element",
    *texts("kind", "asil_capability"),
    *flags("legacy"),
    *texts("text"),
)
assumption = _part("assumption", *texts("owner", "valid_until", "text"))
allocation = insert_only(
    "allocation",
    digest_column("concept_digest", key=True),
    *texts("fsr_id", "element_id", key=True),
    ForeignKeyConstraint(["concept_digest", "fsr_id"], ["fsr.concept_digest", "fsr.id"]),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
)
decomposition = _part("decomposition", *texts("scheme", "independence"))
"""By the id of the FSR that is decomposed."""
decomposition_child = insert_only(
    "decomposition_child",
    digest_column("concept_digest", key=True),
    *texts("fsr_id", "child_id", key=True),
    ForeignKeyConstraint(
        ["concept_digest", "fsr_id"], ["decomposition.concept_digest", "decomposition.id"]
    ),
    ForeignKeyConstraint(["concept_digest", "child_id"], ["fsr.concept_digest", "fsr.id"]),
)
dependent_failure = _part("dependent_failure", *texts("owner", "valid_until", "argument"))
element_relation = insert_only(
    "element_relation",
    digest_column("concept_digest", key=True),
    *texts("element_id", "kind", "name", key=True),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
    one_of("kind", ("resource", "software", "supplier", "provides", "consumes"), "kind"),
)


# --- The tables of twins with half the step, and of what they told --------------------------------

uncertainty = insert_only(
    "uncertainty",
    Column("campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=True, nullable=False),
    *texts("scenario", "architecture", "kind", "name", "unit", key=True),
    *counts("sampled", "pairs"),
    *numbers("p95", "largest", "uncertainty"),
    *counts("differing"),
    *texts("changes"),
    Column("fsr_digest", coded(64), nullable=True),
    Column("judged_digest", coded(64), nullable=True),
    one_of("kind", ("metric", "fsr"), "kind"),
    CheckConstraint("pairs BETWEEN 0 AND sampled", name="pairs"),
    CheckConstraint("(pairs = 0) = (p95 IS NULL)", name="p95"),
    CheckConstraint("(kind = 'fsr') = (judged_digest IS NOT NULL)", name="judged"),
)


# --- The tables that keep evidence whole: ledger and seals, roots, sessions, withdrawals ----------

SEALED: Final = (
    "run", "metric", "timing", "criticality", "verdict", "event", "chain", "basis", "extreme",
    "kept_trace", "plugin",
)  # fmt: skip
"""What a run has rows in; ``plugin`` is every table of metrics of plug-ins."""


def _its_campaign(*, key: bool = False) -> Column[str]:
    kind, reference = String(32), ForeignKey("campaign.id")
    return Column("campaign_id", kind, reference, primary_key=key, nullable=False)


ledger = insert_only(
    "ledger",
    place_number(),
    *counts("place", key=True),
    *texts("table_name"),
    *flags("is_last"),
    *counts("row_count"),
    Column("total", String(32), nullable=False),
    *texts("detail"),
)
"""What transaction ``number`` added to a table: how many rows, the sum of their hashes (and of a
hash of this row, see ``ledger.offset``), and, but for tables that seals cover, which rows."""

seal = insert_only(
    "seal",
    Column("run_number", Integer, ForeignKey("run.number"), primary_key=True, autoincrement=False),
    *counts("number", key=True),
    *(Column(f"{name}_sum", BigInteger, nullable=False) for name in SEALED),
)
"""What transaction ``number`` of the ledger added to one run: by table, the sum of the row hashes
modulo 2**48."""

campaign_root = insert_only(
    "campaign_root",
    _its_campaign(key=True),
    *counts("leaves"),
    digest_column("root"),
)
"""Merkle root over a complete campaign, see ``roots``."""

session = insert_only(
    "session",
    place_number(),
    _its_campaign(),
    *texts("at", "who", "host", "tool", "packages_digest", "cpu", "provenance"),
    Index(None, "campaign_id"),
)
"""Who planned, executed or judged a campaign, when, and with what; one row for each command."""

LEDGER: Final = (ledger, seal)
"""Tables that tell of all others, and are told of by none."""


# --- The table of certificates: how deterministic a campaign was seen to be -----------------------

certificate = insert_only(
    "certificate",
    place_number(),
    _its_campaign(),
    *texts("at", "tool", "class"),
    *counts("executed", "asked", "sampled", "machine_dependent"),
    *texts("conditions", "findings"),
    one_of("class", ("portable", "same platform"), "class"),
    CheckConstraint("sampled BETWEEN 1 AND executed", name="sampled"),
)


# --- Tables of what it takes to judge a run again without its trace -------------------------------


uid_set = insert_only("uid_set", digest_column("digest", key=True), *texts("uids"))
basis = insert_only(
    "basis",
    run_number(),
    *counts("version", key=True),
    digest_column("uid_set_digest", "uid_set.digest"),
    *flags("by_contact"),
    *texts("invalid", null=True),
)
extreme = insert_only(
    "extreme",
    run_number(),
    *texts("measure", key=True),
    *counts("version", key=True),
    *numbers("value", "time_s"),
    *texts("actor", null=True),
    *texts("samples"),
    with_rowid=False,
)
kept_trace = insert_only(
    "kept_trace",
    run_number(),
    *texts("file", key=True),
    *counts("place"),
)

BASIS_RESULTS: Final = (basis, extreme, kept_trace)
"""Of these, the tables written a block at a time."""


# --- Tables about the cases of a campaign: counts of them, what pairs them, and their runs --------


case_count = insert_only(
    "case_count",
    campaign_column(key=True),
    *texts("scenario", "architecture", "fault_entry", key=True),
    *counts("planned"),
)
"""How many cases a campaign plans."""

case_match = insert_only(
    "case_match",
    campaign_column(key=True),
    *counts("first_ordinal", "ordinal", key=True),
    *texts("fault_entry"),
    with_rowid=False,
)
"""Cases of several architectures in one situation of a scenario under the same faults: they go by
the first of them, so that those of one situation lie together and in the order of the plan."""

case_run = insert_only(
    "case_run",
    campaign_column(key=True),
    *counts("ordinal", key=True),
    Column("run_number", Integer, ForeignKey("run.number"), nullable=False),
    with_rowid=False,
)
"""The run of each case of the blocks that are done, by its number."""

case_tally = insert_only(
    "case_tally",
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    campaign_column(),
    *texts("scenario", "architecture", "fault_entry", key=True),
    *counts("runs", "exercised"),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
"""How many cases of a block that is done have a run, and a run that exercises an FSR."""

case_repeat = insert_only(
    "case_repeat",
    campaign_column(key=True),
    *texts("fsr_id", "architecture", "scenario", key=True),
    *counts("passed", "exercised", "unheld"),
)
"""How many of the runs that PASS, or exercise, an FSR repeat the result of another such run, once
all blocks are done: over all scenarios (an empty word) whether one does or not, with the number of
rows of ``never_held``, so that none is lost unseen; in a scenario only where one does."""

never_held = insert_only(
    "never_held",
    campaign_column(key=True),
    *texts("fsr_id", "architecture", key=True),
    *counts("place", key=True),
    *texts("antecedent"),
    *flags("decides"),
)
"""Implications below the top level whose antecedent held in no run that PASSes, once all blocks are
done; they decide where a run satisfies the FSR only because of that. At place 0, which decides,
that the faults an FSR names changed nothing in any run that exercises it; at the last one, which
does, that an FSR of everywhere is exercised by too few runs inside the ODD."""

RECOUNTED: Final = (case_count, case_match, case_run, case_tally, case_repeat, never_held)
"""Tables that plan and results tell whole: verification makes them again instead of trusting a
ledger, which would list a million of their rows."""


# --- The tables of the database, as SQLAlchemy Core -----------------------------------------------

metric, timing, criticality = (make_metric_table(name, metadata, TABLES[name]) for name in TABLES)
verdict = insert_only(
    "verdict",
    run_number(),
    digest_column("fsr_digest", key=True),
    *texts("fsr_id", "verdict"),
    *numbers("robustness_low", "robustness_high", "margin"),
    *texts("unit", "signal", "predicate", null=True),
    *numbers("time_s"),
    *texts("actor", null=True),
    *numbers("value", "threshold"),
    *flags("exercised"),
    *texts("detail", null=True),
    one_of("verdict", RUN_VERDICTS, "verdict"),
    with_rowid=False,
)
event = insert_only(
    "event",
    run_number(),
    *counts("seq", key=True),
    *numbers("time_s", null=False),
    *texts("kind"),
    *texts("subject", null=True),
    *texts("text"),
    with_rowid=False,
)
chain = insert_only("chain", run_number(), *counts("every_rows"), *texts("links"))
injection = insert_only(
    "injection",
    digest_column("result_digest", "run.result_digest", key=True),
    *counts("version", key=True),
    *numbers(*(f"{name}_s" for name in (*MOMENTS, *INTERVALS, "fault_free_violation"))),
    *texts("class", "without_mechanism", "twins"),
    one_of("class", INJECTION_CLASSES, "class"),
)
takeover = insert_only(
    "takeover",
    digest_column("fork_digest", "fork.result_digest", key=True),
    *counts("version", key=True),
    *texts("class"),
    *numbers("takeover_s", "violation_s", "fork_violation_s"),
    one_of("class", TAKEOVER_CLASSES, "class"),
)
tally = insert_only(
    "tally",
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    campaign_column(),
    *texts("fsr_id", key=True),
    digest_column("fsr_digest"),
    *texts("architecture", "scenario", "verdict", key=True),
    *counts("runs", "exercised"),
    *numbers("worst_robustness", "worst_margin"),
    *texts("worst_unit", null=True),
    digest_column("worst_result_digest", "run.result_digest"),
    one_of("verdict", RUN_VERDICTS, "verdict"),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
artifact = Table(
    "artifact",
    metadata,
    digest_column("digest", key=True),
    *texts("kind"),
    Column("result_digest", coded(64), ForeignKey("run.result_digest"), nullable=True),
    *counts("bytes"),
    *texts("created_at"),
    Index(None, "result_digest"),
)

INSERT_ONLY: Final = tuple(item for item in metadata.sorted_tables if item not in {work, artifact})
"""Tables whose rows are never changed or deleted, in dependency order."""

RESULTS: Final = (run, metric, timing, criticality, verdict, event, chain, *BASIS_RESULTS)
"""Tables written a block at a time; ``columns`` hashes their rows."""
