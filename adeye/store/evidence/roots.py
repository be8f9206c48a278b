"""What vouches for results: roots of campaigns, who executed them, and results withdrawn.

Source:
    RFC 6962, "Certificate Transparency", section 2.1: leaves and nodes are hashed with different
    first bytes, and a tree of n leaves is split at the largest power of two below n.

A leaf is a case of the plan with the hash of its result and of its rows of metrics, its digest
chain, and the verdicts of the campaign's FSRs, in the order of the ordinals. Nothing is in it that
depends on the machine, the workers, the order or what else the database holds: no number of a
run, no time of day, nor what is only kept to judge again or comes from plug-ins. So one plan with
the same results has the same root wherever it is executed.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, select

from adeye.errors import InputError, IntegrityError, PlatformError
from adeye.identity import digest, file_digest
from adeye.outputs import KEPT_FOLDER
from adeye.store import tables
from adeye.store.cases import JUDGED, JUDGED_CASES
from adeye.store.database import Door, reading
from adeye.store.encoding import hashed_names, read_chunks, row_hashes, stored_words
from adeye.store.evidence.vouched import Root, Vouched, stored_root
from adeye.store.ledger import add_numbered, add_row, summed
from adeye.store.read.campaigns import Executed as Executed  # who certifies imports it from here
from adeye.store.read.campaigns import executed_once, find_run
from adeye.store.records import Finding, of_row
from adeye.store.texts import json_text, utc_text
from adeye.store.write.results import numbers_of, require_unaltered

# --- A Merkle tree over leaves that come one after the other: its root, and proofs of one leaf ----

_LEAF: Final = b"\x00"
_NODE: Final = b"\x01"


def leaf_hash(content: bytes) -> bytes:
    """Hash the content of a leaf."""
    return hashlib.sha256(_LEAF + content).digest()


def node_hash(left: bytes, right: bytes) -> bytes:
    """Hash two subtrees."""
    return hashlib.sha256(_NODE + left + right).digest()


@dataclass(frozen=True)
class Proof:
    """That a leaf is at its place in a tree.

    Attributes:
        place: Of the leaf, from 0.
        leaves: Of the tree.
        path: Hashes of the other subtrees, from the leaf up.
    """

    place: int
    leaves: int
    path: tuple[bytes, ...]

    def root(self, leaf: bytes) -> bytes:
        """Give the root that the tree has if the leaf with this hash is at its place.

        Raises:
            ValueError: The path does not fit the size of the tree.
        """
        place, last, rest = self.place, self.leaves - 1, list(self.path)
        found = leaf
        while last > 0:
            # A last node on its own goes up as it is.
            if place % 2 == 1 or place < last:
                if not rest:
                    break
                other = rest.pop(0)
                found = node_hash(other, found) if place % 2 else node_hash(found, other)
            place, last = place // 2, last // 2
        if rest or last > 0 or not 0 <= self.place < self.leaves:
            msg = f"a path of {len(self.path)} does not fit leaf {self.place} of {self.leaves}"
            raise ValueError(msg)
        return found


_Node = tuple[int, int, bytes]
"""Number of leaves below, place of the first of them, hash."""


@dataclass
class Tree:
    """A tree that grows; it keeps one hash for each power of two in its size.

    Attributes:
        watched: Place of a leaf whose proof is wanted; None for none.
        leaves: Number of leaves.
    """

    watched: int | None = None
    leaves: int = 0
    _full: list[_Node] = field(default_factory=list)
    _path: list[bytes] = field(default_factory=list)

    def add(self, leaf: bytes) -> None:
        """Add the hash of the next leaf."""
        node = (1, self.leaves, leaf)
        self.leaves += 1
        while self._full and self._full[-1][0] == node[0]:
            node = self._joined(self._full.pop(), node, self._path)
        self._full.append(node)

    def root(self) -> bytes:
        """Give the root.

        Raises:
            ValueError: There is no leaf.
        """
        return self._folded([])

    def proof(self) -> Proof:
        """Prove the watched leaf.

        Raises:
            ValueError: There is no leaf at its place.
        """
        if self.watched is None or not 0 <= self.watched < self.leaves:
            raise ValueError(f"there is no leaf {self.watched} among {self.leaves}")
        path = list(self._path)
        self._folded(path)
        return Proof(self.watched, self.leaves, tuple(path))

    def _folded(self, path: list[bytes]) -> bytes:
        if not self._full:
            raise ValueError("a tree without leaves has no root")
        node = self._full[-1]
        for left in reversed(self._full[:-1]):
            node = self._joined(left, node, path)
        return node[2]

    def _joined(self, left: _Node, right: _Node, path: list[bytes]) -> _Node:
        if self.watched is not None:
            if left[1] <= self.watched < right[1]:
                path.append(right[2])
            elif right[1] <= self.watched < right[1] + right[0]:
                path.append(left[2])
        return left[0] + right[0], left[1], node_hash(left[2], right[2])


# --- The Merkle root of a campaign: one hash over its plan and all that came out of it ------------

_CHUNK: Final = 2_000
_COVERED: Final = ("timing", "criticality", "chain")
"""Tables with one row of a run that its result hash does not cover."""

_VERDICT: Final = tuple(name for name in hashed_names(tables.verdict) if name != "predicate")
"""What is hashed of a verdict: the words of its predicate are those of whoever asked first."""

_HASHES: Final = ", ".join(f"{name}.row_hash" for name in _COVERED)
_JOINS: Final = " ".join(f"LEFT JOIN {name} ON {name}.run_number = r.number" for name in _COVERED)
_WITHIN: Final = "WHERE c.campaign_id = ? AND c.ordinal >= ? AND c.ordinal < ? ORDER BY c.ordinal"
_CASES: Final = f"""SELECT c.ordinal, c.row_hash, r.result_hash, {_HASHES}
FROM campaign_case c LEFT JOIN run r ON r.result_digest = c.result_digest {_JOINS}
{_WITHIN}"""  # noqa: S608 - own names
_COLUMNS: Final = ", ".join(f"v.{name}" for name in _VERDICT[1:])
_VERDICTS: Final = f"""SELECT c.ordinal, c.result_digest, {_COLUMNS} FROM {JUDGED_CASES}
{_WITHIN}, v.fsr_id"""  # noqa: S608 - own names


def leaves(connection: Connection, campaign: str) -> Iterator[tuple[int, bytes]]:
    """Give ordinal and leaf hash of the cases of a campaign, also of those without a result."""
    planned = connection.exec_driver_sql(
        "SELECT planned FROM campaign WHERE id = ?", (campaign,)
    ).scalar()
    if planned is None:
        raise ValueError("its plan is gone")
    for first in range(0, planned, _CHUNK):
        within = campaign, first, first + _CHUNK
        verdicts = _verdicts(connection, within)
        for ordinal, *parts in connection.exec_driver_sql(_CASES, within):
            content = [*("-" if part is None else str(part) for part in parts), *verdicts[ordinal]]
            yield ordinal, leaf_hash("\n".join(content).encode("utf-8", "surrogatepass"))


def _verdicts(connection: Connection, within: tuple[str, int, int]) -> dict[int, list[str]]:
    found = [item for chunk in read_chunks(connection, _VERDICTS, *within) for item in chunk]
    by_ordinal: dict[int, list[str]] = defaultdict(list)
    if found:
        words = stored_words(tables.verdict, _VERDICT, [item[1:] for item in found])
        for item, hashed in zip(found, row_hashes(tables.verdict, words), strict=True):
            by_ordinal[item[0]].append(hashed)
    return by_ordinal


def is_complete(connection: Connection, campaign: str) -> bool:
    """Tell whether every block of a campaign is done."""
    counted = connection.exec_driver_sql(
        "SELECT COUNT(*), SUM(CASE state WHEN 'done' THEN 1 ELSE 0 END) FROM work "
        "WHERE campaign_id = ?",
        (campaign,),
    ).one()
    return bool(counted[0]) and counted[0] == counted[1]


def computed_root(connection: Connection, campaign: str) -> Root:
    """Compute the root of a campaign from its rows.

    Raises:
        IntegrityError: A row has what was never written.
    """
    tree = Tree()
    try:
        for _, leaf in leaves(connection, campaign):
            tree.add(leaf)
        return Root(campaign, tree.leaves, tree.root().hex())
    except (TypeError, ValueError, OverflowError) as error:
        raise IntegrityError(
            f"campaign {campaign[:12]}: a row of it is damaged ({error}). Run 'adeye db verify'."
        ) from error


def require_root(connection: Connection, root: Root) -> None:
    """Refuse a root that is not the one that was saved, if there is one.

    Raises:
        IntegrityError: It is another one.
    """
    known = stored_root(connection, root.campaign)
    if known is not None and known != root:
        raise IntegrityError(
            f"campaign {root.campaign[:12]}: its evidence has root {root.root[:12]}, not "
            f"{known.root[:12]} as when it was complete. Run 'adeye db verify'."
        )


def wrong_roots(connection: Connection) -> Iterator[Finding]:
    """Name the campaigns whose evidence has not the root that it had when it was complete."""
    table = tables.campaign_root
    for item in connection.execute(table.select().order_by(table.c.campaign_id)).all():
        try:
            found = computed_root(connection, item.campaign_id)
        except IntegrityError as error:
            yield Finding("campaign_root", item.campaign_id, str(error))
            continue
        if (found.leaves, found.root) != (item.leaves, item.root):
            yield Finding(
                "campaign_root",
                item.campaign_id,
                f"the evidence has root {found.root[:16]} over {found.leaves} cases",
            )


# --- Sums of the row hashes of one campaign by table: what a manifest says of its tables ----------

_RUNS: Final = ("metric", "timing", "criticality", "event", "chain")
_RUN: Final = "JOIN run r ON r.result_digest = c.result_digest"
_SOURCES: Final = {
    "campaign": "SELECT t.row_hash FROM campaign t WHERE t.id = ?",
    "campaign_fsr": "SELECT t.row_hash FROM campaign_fsr t WHERE t.campaign_id = ?",
    "campaign_case": "SELECT t.row_hash FROM campaign_case t WHERE t.campaign_id = ?",
    "test_case": "SELECT t.row_hash FROM campaign_case c "
    "JOIN test_case t ON t.digest = c.test_case_digest WHERE c.campaign_id = ?",
    "run": f"SELECT r.row_hash FROM campaign_case c {_RUN} WHERE c.campaign_id = ?",  # noqa: S608
    **{
        name: f"SELECT t.row_hash FROM campaign_case c {_RUN} "  # noqa: S608 - own names
        f"JOIN {name} t ON t.run_number = r.number WHERE c.campaign_id = ?"
        for name in _RUNS
    },
    "verdict": f"SELECT v.row_hash FROM campaign_case c {_RUN} "  # noqa: S608 - own names
    f"JOIN campaign_fsr f ON {JUDGED} "
    "JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest "
    "WHERE c.campaign_id = ?",
}


def campaign_sums(connection: Connection, campaign: str) -> dict[str, tuple[int, str]]:
    """Count and sum the row hashes of a campaign by table.

    What other campaigns add later changes none of them.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.

    Returns:
        By table: rows, and the sum of their hashes modulo 2**128 in hex.
    """
    sums: dict[str, tuple[int, str]] = {}
    for name, query in _SOURCES.items():
        count, total = summed(connection, query, (campaign,))
        sums[name] = count, f"{total:032x}"
    return sums


# --- What vouches for results: roots of campaigns, who executed them, and results withdrawn -------


@dataclass(frozen=True, slots=True)
class RunProof:
    """That a run is evidence of a campaign, to be checked with its root alone.

    Attributes:
        campaign: Id of the campaign.
        result_digest: The run.
        ordinal: Its place, from 0.
        leaves: Number of cases.
        leaf: sha256 of the leaf in hex.
        path: Hashes of the other subtrees, from the leaf up.
        root: Of the tree.
    """

    campaign: str
    result_digest: str
    ordinal: int
    leaves: int
    leaf: str
    path: tuple[str, ...]
    root: str


def prove(connection: Connection, run: str, campaign: str) -> RunProof:
    """Prove that a run is evidence of a campaign.

    Args:
        connection: In a transaction.
        run: Beginning of its result digest, or its ordinal.
        campaign: Id of the campaign.

    Raises:
        InputError: There is no such run in the campaign, or it was withdrawn.
        IntegrityError: The run or the campaign is not as it was written.
    """
    found = find_run(connection, run, campaign)
    case = "SELECT 1 FROM campaign_case WHERE campaign_id = ? AND ordinal = ? AND result_digest = ?"
    here = campaign, found.ordinal, found.result_digest
    if not found.is_done or connection.exec_driver_sql(case, here).first() is None:
        raise InputError(
            f"run {found.result_digest[:12]} is no result of a case of campaign {campaign[:12]}, "
            "so it has no leaf",
            remedy="Forks, twins and reference drives count in no campaign, nor does what is not "
            "executed; prove a run that 'adeye query' lists in v_runs.",
        )
    withdrawn = "SELECT 1 FROM withdrawal WHERE result_digest = ?"
    if connection.exec_driver_sql(withdrawn, (found.result_digest,)).first():
        raise InputError(
            f"run {found.result_digest[:12]} was withdrawn, so it is no evidence",
            remedy="See 'adeye db info' for who did so, and prove another run.",
        )
    number = list(numbers_of(connection, [found.result_digest]).values())
    for table in tables.RESULTS:
        require_unaltered(connection, table, number)
    tree, own = Tree(found.ordinal), b""
    for place, leaf in leaves(connection, campaign):
        tree.add(leaf)
        own = leaf if place == found.ordinal else own
    proof, root = tree.proof(), tree.root().hex()
    require_root(connection, Root(campaign, tree.leaves, root))
    path = tuple(item.hex() for item in proof.path)
    digest = found.result_digest
    return RunProof(campaign, digest, found.ordinal, proof.leaves, own.hex(), path, root)


class Evidence(Vouched):
    """Reads and keeps what vouches for results, each method in one transaction."""

    require_root = reading(require_root)
    computed_root = reading(computed_root)
    prove = reading(prove)
    sums = reading(campaign_sums)

    def record_root(self, campaign: str) -> Root | None:
        """Compute and save the root of a campaign once it is complete; None before.

        Raises:
            IntegrityError: A row of it is damaged, or another root was saved.
        """
        with self._database.read() as connection:
            known = stored_root(connection, campaign)
            if known is not None or not is_complete(connection, campaign):
                return known
            found = computed_root(connection, campaign)
        with self._database.write() as connection:
            # Somebody else may have saved it meanwhile.
            require_root(connection, found)
            values = found.campaign, found.leaves, found.root
            add_row(connection, tables.campaign_root, *values, ignore_existing=True)
        return found

    def add_session(self, campaign: str, provenance: Mapping[str, Any]) -> None:
        """Note that a command begins to work on a campaign."""
        packages = provenance.get("packages", {})
        with self._database.write() as connection:
            add_numbered(
                connection,
                tables.session,
                campaign,
                utc_text(None),
                *(str(provenance.get(name, "")) for name in ("who", "host", "adeye")),
                digest(packages),
                str(provenance.get("cpu", {}).get("name", "")),
                json_text(dict(provenance)),
            )

    def withdraw(self, result_digest: str, *, author: str, reason: str) -> bool:
        """Let a result count as evidence no more, in every campaign; its rows stay.

        Returns:
            False if it was withdrawn before; then nothing is added.

        Raises:
            InputError: Author or reason is empty.
        """
        for name, text in (("author", author), ("reason", reason)):
            if not text.strip():
                raise InputError(
                    f"--{name} is empty",
                    remedy="A withdrawal without one proves nothing; say who and why.",
                )
        table = tables.withdrawal
        with self._database.write() as connection:
            known = select(table.c.number).where(table.c.result_digest == result_digest)
            if connection.execute(known).first() is not None:
                return False
            values = result_digest, utc_text(None), author.strip(), reason.strip()
            add_numbered(connection, table, *values)
            return True


# --- Keep certificates of determinism beside their campaigns, and say which runs can have one -----


@dataclass(frozen=True)
class CertificateRecord:
    """A certificate as the database holds it, see ``campaign.studies.certify.Certificate``.

    Attributes:
        campaign: Id.
        tool: Release of adeye.
        class_: ``portable`` or ``same platform``.
        executed: Runs that have a result.
        asked: Size of the sample that was asked for.
        sampled: Runs that were executed again.
        machine_dependent: Runs that were left out.
        conditions: With the runs compared under each.
        findings: Runs that differ; none certifies.
        at: UTC time of day; empty before it is saved.
    """

    campaign: str
    tool: str
    class_: str
    executed: int
    asked: int
    sampled: int
    machine_dependent: int
    conditions: Sequence[Mapping[str, Any]]
    findings: Sequence[Mapping[str, Any]]
    at: str = ""


class Certificates(Door):
    """Reads and keeps certificates, each method in one transaction."""

    executed = reading(executed_once)

    def save(self, found: CertificateRecord) -> None:
        """Keep a certificate; earlier ones stay."""
        with self._database.write() as connection:
            add_numbered(
                connection,
                tables.certificate,
                *(found.campaign, utc_text(None), found.tool, found.class_),
                *(found.executed, found.asked, found.sampled, found.machine_dependent),
                json_text(list(found.conditions)),
                json_text(list(found.findings)),
            )

    def of(self, campaign: str) -> tuple[CertificateRecord, ...]:
        """Give the certificates of a campaign, the newest first."""
        query = "SELECT * FROM certificate WHERE campaign_id = ? ORDER BY number DESC"
        return tuple(
            of_row(
                CertificateRecord,
                item._mapping,
                campaign=item.campaign_id,
                conditions=json.loads(item.conditions),
                findings=json.loads(item.findings),
            )
            for item in self._ask(query, campaign)
        )


# --- Files of kept traces: where they are, and their names, which are hashes of their content -----

SUFFIX: Final = ".npz"
_NAME: Final = re.compile("[0-9a-f]{64}")


def folder_of(database: Path) -> Path:
    """Name the folder that the traces of a database are written to.

    It has the whole name of the file, so that no two databases share one, and is beside the file
    itself where that is reached through a link.

    >>> from pathlib import Path
    >>> folder_of(Path(".adeye/adeye.db")).as_posix()
    '.adeye/adeye.db.traces'
    """
    real = database.resolve() if database.is_symlink() else database
    return real.with_name(f"{real.name}{KEPT_FOLDER}")


def folders_of(database: Path) -> tuple[Path, ...]:
    """List the folders that traces of a database may be in, its own first.

    A file is named after its content, so that it is the right one wherever it is found: in the
    folder without the ending of the database, as the first releases called it, and in those of
    other databases beside it, where it was renamed, copied or merged since.
    """
    own = folder_of(database)
    beside = (own.parent, database.parent)
    others = (path for folder in beside for path in sorted(folder.glob(f"*{KEPT_FOLDER}")))
    return tuple(dict.fromkeys((own, *others)))


def find_kept(folders: Sequence[Path], name: str) -> Path | None:
    """Find a kept file in the first folder that has it, see ``kept_path``."""
    found = (kept_path(folder, name) for folder in folders)
    return next((path for path in found if path is not None), None)


def kept_path(folder: Path, name: str) -> Path | None:
    """Find a kept file by the name that a database gives it.

    A name is a hash in hex and nothing else, so that no database leads to another place.

    Returns:
        None if the name is none, or no file of its own has it.
    """
    if _NAME.fullmatch(name) is None:
        return None
    path = folder / f"{name}{SUFFIX}"
    return path if path.is_file() and not path.is_symlink() else None


def copy_kept(name: str, folders: Sequence[Path], into: Path) -> Path | None:
    """Copy a kept file into the folder of another database, whole or not at all.

    Args:
        name: As a database gives it.
        folders: Where it may be.
        into: The other folder, which is made.

    Returns:
        The new file; None if it is there already.

    Raises:
        IntegrityError: It is nowhere, or the copy is not the same.
        PlatformError: It cannot be read or written.
    """
    found = find_kept(folders, name)
    if found is None:
        raise IntegrityError(f"the kept trace {name[:12]}{SUFFIX} is gone. Run 'adeye db verify'.")
    try:
        content = file_digest(found)
        into.mkdir(parents=True, exist_ok=True)
        here = kept_path(into, name)
        if here is not None and file_digest(here) == content:
            return None
        descriptor, temporary = tempfile.mkstemp(suffix=".tmp", dir=into)
        os.close(descriptor)
        try:
            shutil.copyfile(found, temporary)
            if file_digest(Path(temporary)) != content:
                raise IntegrityError(f"the copy of {name[:12]}{SUFFIX} is not the same. Try again.")
            return Path(temporary).replace(into / f"{name}{SUFFIX}")
        finally:
            Path(temporary).unlink(missing_ok=True)
    except OSError as error:
        raise PlatformError(
            f"traces cannot be copied to {into}: {error.strerror}. Free space, or allow it."
        ) from error
