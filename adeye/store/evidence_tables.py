"""The collection of tables and the kinds of columns that they are made of.

A row of another table is worth what these say about it: the ledger counts and sums what every
transaction added, a seal says the same of one run, and a root is one hash over a whole campaign.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sqlalchemy import (
    BigInteger,
    Boolean,
    CheckConstraint,
    Column,
    ColumnElement,
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
    literal_column,
)

if TYPE_CHECKING:
    from sqlalchemy import Connection
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


def is_true(flag: ColumnElement[bool]) -> ColumnElement[bool]:
    """Ask for a flag, which is a number in the database."""
    return flag == literal_column("1")


def digest_column(name: str, references: str | None = None, *, key: bool = False) -> Column[str]:
    """Make a column of sha256 in hex."""
    keys = [] if references is None else [ForeignKey(references)]
    return Column(name, coded(64), *keys, primary_key=key, nullable=False)


def text_column(name: str, *, key: bool = False, null: bool = False) -> Column[str]:
    """Make a column of text."""
    return Column(name, TEXT, primary_key=key, nullable=null)


def number_column(name: str, *, null: bool = True) -> Column[float]:
    """Make a column of numbers, by default with gaps."""
    return Column(name, Float, nullable=null)


def count_column(name: str, *, key: bool = False) -> Column[int]:
    """Make a column of whole numbers."""
    return Column(name, Integer, primary_key=key, nullable=False, autoincrement=False)


def flag_column(name: str) -> Column[bool]:
    """Make a column of truth values."""
    return Column(name, _FLAG, nullable=False)


def row_hash_column() -> Column[str]:
    """Make the last column of a table that is only added to."""
    return Column("row_hash", coded(32), nullable=False)


def one_of(column: str, words: tuple[str, ...], name: str) -> CheckConstraint:
    """Let a column of text have some words only."""
    # SQLite makes a table of what follows IN, for every row that it checks.
    return CheckConstraint(" OR ".join(f"{column} = '{word}'" for word in words), name=name)


# --- The tables that a concept is taken apart into, for people who ask with SQL -------------------


def _part(name: str, *columns: Column[str] | Column[float] | Column[int] | Column[bool]) -> Table:
    return Table(
        name,
        metadata,
        digest_column("concept_digest", "concept.digest", key=True),
        text_column("id", key=True),
        *columns,
        text_column("content"),
        row_hash_column(),
    )


hazardous_event = _part(
    "hazardous_event",
    text_column("severity"),
    text_column("exposure"),
    text_column("controllability"),
    text_column("asil", null=True),
)
safety_goal = _part(
    "safety_goal",
    text_column("asil"),
    number_column("ftti_s", null=False),
    text_column("safe_state"),
    text_column("text"),
)
fsr = _part(
    "fsr",
    text_column("asil"),
    flag_column("mandatory"),
    count_column("min_exercised"),
    text_column("text"),
    text_column("measure"),
    text_column("threshold_source"),
)
element = _part(
    "element",
    text_column("kind"),
    text_column("asil_capability"),
    flag_column("legacy"),
    text_column("text"),
)
assumption = _part(
    "assumption", text_column("owner"), text_column("valid_until"), text_column("text")
)
allocation = Table(
    "allocation",
    metadata,
    digest_column("concept_digest", key=True),
    text_column("fsr_id", key=True),
    text_column("element_id", key=True),
    row_hash_column(),
    ForeignKeyConstraint(["concept_digest", "fsr_id"], ["fsr.concept_digest", "fsr.id"]),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
)
decomposition = _part("decomposition", text_column("scheme"), text_column("independence"))
"""By the id of the FSR that is decomposed."""
decomposition_child = Table(
    "decomposition_child",
    metadata,
    digest_column("concept_digest", key=True),
    text_column("fsr_id", key=True),
    text_column("child_id", key=True),
    row_hash_column(),
    ForeignKeyConstraint(
        ["concept_digest", "fsr_id"], ["decomposition.concept_digest", "decomposition.id"]
    ),
    ForeignKeyConstraint(["concept_digest", "child_id"], ["fsr.concept_digest", "fsr.id"]),
)
dependent_failure = _part(
    "dependent_failure", text_column("owner"), text_column("valid_until"), text_column("argument")
)
element_relation = Table(
    "element_relation",
    metadata,
    digest_column("concept_digest", key=True),
    text_column("element_id", key=True),
    text_column("kind", key=True),
    text_column("name", key=True),
    row_hash_column(),
    ForeignKeyConstraint(
        ["concept_digest", "element_id"], ["element.concept_digest", "element.id"]
    ),
    one_of("kind", ("resource", "software", "supplier", "provides", "consumes"), "kind"),
)


# --- The tables of twins with half the step, and of what they told --------------------------------

half_step = Table(
    "half_step",
    metadata,
    digest_column("result_digest", "run.result_digest", key=True),
    digest_column("test_case_digest", "test_case.digest"),
    digest_column("origin_digest"),
    row_hash_column(),
    Index(None, "test_case_digest"),
    Index(None, "origin_digest"),
)
uncertainty = Table(
    "uncertainty",
    metadata,
    Column("campaign_id", coded(32), ForeignKey("campaign.id"), primary_key=True, nullable=False),
    text_column("scenario", key=True),
    text_column("architecture", key=True),
    text_column("kind", key=True),
    text_column("name", key=True),
    text_column("unit", key=True),
    count_column("sampled"),
    count_column("pairs"),
    number_column("p95"),
    number_column("largest"),
    number_column("uncertainty"),
    count_column("differing"),
    text_column("changes"),
    Column("fsr_digest", coded(64), nullable=True),
    Column("judged_digest", coded(64), nullable=True),
    row_hash_column(),
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


def _campaign(*, key: bool = False) -> Column[str]:
    return Column(
        "campaign_id", String(32), ForeignKey("campaign.id"), primary_key=key, nullable=False
    )


ledger = Table(
    "ledger",
    metadata,
    _place_number(),
    count_column("place", key=True),
    text_column("table_name"),
    flag_column("is_last"),
    count_column("row_count"),
    Column("total", String(32), nullable=False),
    text_column("detail"),
    row_hash_column(),
)
"""What transaction ``number`` added to a table: how many rows, the sum of their hashes (and of a
hash of this row, see ``ledger.offset``), and, but for tables that seals cover, which rows."""

seal = Table(
    "seal",
    metadata,
    Column("run_number", Integer, ForeignKey("run.number"), primary_key=True, autoincrement=False),
    count_column("number", key=True),
    *(Column(f"{name}_sum", BigInteger, nullable=False) for name in SEALED),
    row_hash_column(),
)
"""What transaction ``number`` of the ledger added to one run: by table, the sum of the row hashes
modulo 2**48."""

campaign_root = Table(
    "campaign_root",
    metadata,
    _campaign(key=True),
    count_column("leaves"),
    digest_column("root"),
    row_hash_column(),
)
"""Merkle root over a complete campaign, see ``roots``."""

session = Table(
    "session",
    metadata,
    _place_number(),
    _campaign(),
    text_column("at"),
    text_column("who"),
    text_column("host"),
    text_column("tool"),
    text_column("packages_digest"),
    text_column("cpu"),
    text_column("provenance"),
    row_hash_column(),
    Index(None, "campaign_id"),
)
"""Who planned, executed or judged a campaign, when, and with what; one row for each command."""

withdrawal = Table(
    "withdrawal",
    metadata,
    _place_number(),
    digest_column("result_digest", "run.result_digest"),
    text_column("at"),
    text_column("author"),
    text_column("reason"),
    row_hash_column(),
    Index(None, "result_digest"),
)
"""Results that are no evidence any more. They stay as they are."""

LEDGER: Final = (ledger, seal)
"""Tables that tell of all others, and are told of by none."""


# --- The table of certificates: how deterministic a campaign was seen to be -----------------------

certificate = Table(
    "certificate",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("campaign_id", String(32), ForeignKey("campaign.id"), nullable=False),
    text_column("at"),
    text_column("tool"),
    text_column("class"),
    count_column("executed"),
    count_column("asked"),
    count_column("sampled"),
    count_column("machine_dependent"),
    text_column("conditions"),
    text_column("findings"),
    row_hash_column(),
    one_of("class", ("portable", "same platform"), "class"),
    CheckConstraint("sampled BETWEEN 1 AND executed", name="sampled"),
)
