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

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from sqlalchemy import (
    BigInteger,
    Boolean,
    CheckConstraint,
    Column,
    Connection,
    Float,
    ForeignKey,
    ForeignKeyConstraint,
    Index,
    Integer,
    MetaData,
    SmallInteger,
    String,
    Table,
    Text,
)
from sqlalchemy.schema import SchemaItem
from sqlalchemy.types import TypeEngine

# --- The collection of tables and the kinds of columns that they are made of ----------------------

metadata = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)


# Texts are in the order of their bytes, in every database and language.
TEXT: TypeEngine[str] = Text().with_variant(Text(collation="C"), "postgresql")
# Numbers, as SQLite has it: one reading for whoever writes SQL.
_FLAG: TypeEngine[bool] = Boolean().with_variant(SmallInteger(), "postgresql")


def coded(length: int) -> TypeEngine[str]:
    """Give the type of a text of a fixed length, such as a digest."""
    return String(length).with_variant(String(length, collation="C"), "postgresql")


def digest_column(name: str, references: str | None = None, *, key: bool = False) -> Column[str]:
    """Make a column of sha256 in hex."""
    keys = [] if references is None else [ForeignKey(references)]
    return Column(name, coded(64), *keys, primary_key=key, nullable=False)


def row_hash_column() -> Column[str]:
    """Make the last column of a table that is only added to."""
    return Column("row_hash", coded(32), nullable=False)


def texts(*names: str, key: bool = False, null: bool = False) -> list[Column[str]]:
    """Make columns of text."""
    return [Column(name, TEXT, primary_key=key, nullable=null) for name in names]


def numbers(*names: str, null: bool = True) -> list[Column[float]]:
    """Make columns of numbers, by default with gaps."""
    return [Column(name, Float, nullable=null) for name in names]


def counts(*names: str, key: bool = False) -> list[Column[int]]:
    """Make columns of whole numbers."""
    return [
        Column(name, Integer, primary_key=key, nullable=False, autoincrement=False)
        for name in names
    ]


def flags(*names: str) -> list[Column[bool]]:
    """Make columns of truth values."""
    return [Column(name, _FLAG, nullable=False) for name in names]


def insert_only(name: str, *columns: SchemaItem, with_rowid: bool = True) -> Table:
    """Make a table that is only added to: behind its columns stands the hash of the row."""
    return Table(name, metadata, *columns, row_hash_column(), sqlite_with_rowid=with_rowid)


def one_of(column: str, words: tuple[str, ...], name: str) -> CheckConstraint:
    """Let a column of text have some words only."""
    # SQLite makes a table of what follows IN, for every row that it checks.
    return CheckConstraint(" OR ".join(f"{column} = '{word}'" for word in words), name=name)


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

half_step = insert_only(
    "half_step",
    digest_column("result_digest", "run.result_digest", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("origin_digest"),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
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


def plain_digests(connection: Connection, campaign_id: str) -> dict[str, str]:
    """Give the digest of each FSR of a campaign without what half the step told.

    Args:
        connection: In a transaction.
        campaign_id: The campaign.
    """
    found = connection.exec_driver_sql(
        "SELECT f.fsr_id, COALESCE(u.fsr_digest, f.fsr_digest) FROM campaign_fsr f "
        "LEFT JOIN uncertainty u ON u.judged_digest = f.fsr_digest WHERE f.campaign_id = ?",
        (campaign_id,),
    )
    return {str(name): str(digest) for name, digest in found}


# --- The tables that keep evidence whole: ledger and seals, roots, sessions, withdrawals ----------

SEALED: Final = (
    "run", "metric", "timing", "criticality", "verdict", "event", "chain", "basis", "extreme",
    "kept_trace", "plugin",
)  # fmt: skip
"""What a run has rows in; ``plugin`` is every table of metrics of plug-ins."""


def _place_number() -> Column[int]:
    return Column("number", Integer, primary_key=True, autoincrement=False)


def _its_campaign(*, key: bool = False) -> Column[str]:
    kind, reference = String(32), ForeignKey("campaign.id")
    return Column("campaign_id", kind, reference, primary_key=key, nullable=False)


ledger = insert_only(
    "ledger",
    _place_number(),
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
    _place_number(),
    _its_campaign(),
    *texts("at", "who", "host", "tool", "packages_digest", "cpu", "provenance"),
    Index(None, "campaign_id"),
)
"""Who planned, executed or judged a campaign, when, and with what; one row for each command."""

withdrawal = insert_only(
    "withdrawal",
    _place_number(),
    digest_column("result_digest", "run.result_digest"),
    *texts("at", "author", "reason"),
    Index(None, "result_digest"),
)
"""Results that are no evidence any more. They stay as they are."""

LEDGER: Final = (ledger, seal)
"""Tables that tell of all others, and are told of by none."""


# --- The table of certificates: how deterministic a campaign was seen to be -----------------------

certificate = insert_only(
    "certificate",
    _place_number(),
    _its_campaign(),
    *texts("at", "tool", "class"),
    *counts("executed", "asked", "sampled", "machine_dependent"),
    *texts("conditions", "findings"),
    one_of("class", ("portable", "same platform"), "class"),
    CheckConstraint("sampled BETWEEN 1 AND executed", name="sampled"),
)


# --- Tables of what it takes to judge a run again without its trace -------------------------------


def _run_number(number: str | Column[int] = "run.number") -> Column[int]:
    """Refer to a run by its number: digests would scatter the rows of a block over the file."""
    key = ForeignKey(number)
    return Column("run_number", Integer, key, primary_key=True, autoincrement=False)


uid_set = insert_only("uid_set", digest_column("digest", key=True), *texts("uids"))
basis = insert_only(
    "basis",
    _run_number(),
    *counts("version", key=True),
    digest_column("uid_set_digest", "uid_set.digest"),
    *flags("by_contact"),
    *texts("invalid", null=True),
)
extreme = insert_only(
    "extreme",
    _run_number(),
    *texts("measure", key=True),
    *counts("version", key=True),
    *numbers("value", "time_s"),
    *texts("actor", null=True),
    *texts("samples"),
    with_rowid=False,
)
kept_trace = insert_only(
    "kept_trace",
    _run_number(),
    *texts("file", key=True),
    *counts("place"),
)

BASIS_RESULTS: Final = (basis, extreme, kept_trace)
"""Of these, the tables written a block at a time."""


# --- Tables about the cases of a campaign: counts of them, what pairs them, and their runs --------


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


case_count = insert_only(
    "case_count",
    _campaign(key=True),
    *texts("scenario", "architecture", "fault_entry", key=True),
    *counts("planned"),
)
"""How many cases a campaign plans."""

case_match = insert_only(
    "case_match",
    _campaign(key=True),
    *counts("first_ordinal", "ordinal", key=True),
    *texts("fault_entry"),
    with_rowid=False,
)
"""Cases of several architectures in one situation of a scenario under the same faults: they go by
the first of them, so that those of one situation lie together and in the order of the plan."""

case_run = insert_only(
    "case_run",
    _campaign(key=True),
    *counts("ordinal", key=True),
    Column("run_number", Integer, ForeignKey("run.number"), nullable=False),
    with_rowid=False,
)
"""The run of each case of the blocks that are done, by its number."""

case_tally = insert_only(
    "case_tally",
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    _campaign(),
    *texts("scenario", "architecture", "fault_entry", key=True),
    *counts("runs", "exercised"),
    CheckConstraint("exercised BETWEEN 0 AND runs", name="exercised"),
    Index(None, "campaign_id"),
)
"""How many cases of a block that is done have a run, and a run that exercises an FSR."""

case_repeat = insert_only(
    "case_repeat",
    _campaign(key=True),
    *texts("fsr_id", "architecture", "scenario", key=True),
    *counts("passed", "exercised", "unheld"),
)
"""How many of the runs that PASS, or exercise, an FSR repeat the result of another such run, once
all blocks are done: over all scenarios (an empty word) whether one does or not, with the number of
rows of ``never_held``, so that none is lost unseen; in a scenario only where one does."""

never_held = insert_only(
    "never_held",
    _campaign(key=True),
    *texts("fsr_id", "architecture", key=True),
    *counts("place", key=True),
    *texts("antecedent"),
    *flags("decides"),
)
"""Implications below the top level whose antecedent held in no run that PASSes, once all blocks are
done; they decide where a run satisfies the FSR only because of that. At place 0, which decides,
that the faults an FSR names changed nothing in any run that exercises it."""

RECOUNTED: Final = (case_count, case_match, case_run, case_tally, case_repeat, never_held)
"""Tables that plan and results tell whole: verification makes them again instead of trusting a
ledger, which would list a million of their rows."""


# --- Built-in metrics by the table that holds them ------------------------------------------------


def _metric_tables() -> dict[str, tuple[str, ...]]:
    found: dict[str, list[str]] = {}
    for line in Path(__file__).with_name("metric_tables.txt").read_text("utf-8").splitlines():
        if line.startswith("["):
            found[line.strip("[]")] = own = []
        elif line and not line.startswith("#"):
            own.append(line)
    return {table: tuple(names) for table, names in found.items()}


TABLES: Final = _metric_tables()
"""Built-in metrics by the table that holds them, see ``metric_tables.txt``."""

METRIC_IDS: Final = tuple(name for names in TABLES.values() for name in names)
"""All of them, four columns each: value, status, time of the worst case, actor."""


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
INTERVALS: Final = ("fdti", "frti", "fhti", "eoti", "ftti")
"""Intervals between them."""


def _content(name: str) -> Table:
    return insert_only(name, digest_column("digest", key=True), *texts("id", "version", "content"))


CONTENT: Final = {name: _content(name) for name in ("odd", "scenario", "architecture", "concept")}
"""What users wrote, by its kind."""
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
    _campaign(),
    *texts("at"),
)
"""Which campaign was planned again after another one: going back to former files makes no new
campaign, and yet that one is the latest."""
campaign_case = insert_only(
    "campaign_case",
    _campaign(key=True),
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
    _campaign(key=True),
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
    _campaign(),
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
    return Table(name, into, _run_number(run.c.number), *columns, row_hash_column(), *checks)


metric, timing, criticality = (make_metric_table(name, metadata, TABLES[name]) for name in TABLES)
verdict = insert_only(
    "verdict",
    _run_number(),
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
    _run_number(),
    *counts("seq", key=True),
    *numbers("time_s", null=False),
    *texts("kind"),
    *texts("subject", null=True),
    *texts("text"),
    with_rowid=False,
)
chain = insert_only("chain", _run_number(), *counts("every_rows"), *texts("links"))
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
benchmark = insert_only(
    "benchmark",
    digest_column("result_digest", "run.result_digest", key=True),
    *texts("model", "edition", key=True),
    *counts("version", key=True),
    digest_column("drive_digest", "run.result_digest"),
    Index(None, "drive_digest"),
)
tally = insert_only(
    "tally",
    Column("work_id", Integer, ForeignKey("work.id"), primary_key=True, autoincrement=False),
    _campaign(),
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
