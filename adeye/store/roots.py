"""The Merkle root of a campaign: one hash over its plan and all that came out of it.

A leaf is a case of the plan with the hash of its result and of its rows of metrics, its digest
chain, and the verdicts of the campaign's FSRs, in the order of the ordinals. Nothing is in it that
depends on the machine, the workers, the order or what else the database holds: no number of a
run, no time of day, nor what is only kept to judge again or comes from plug-ins. So one plan with
the same results has the same root wherever it is executed.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from adeye.errors import IntegrityError
from adeye.store import tables
from adeye.store.columns import hashed_names, row_hashes, stored_words
from adeye.store.encoding import row
from adeye.store.inserting import insert_rows
from adeye.store.merkle import Proof, Tree, leaf_hash
from adeye.store.pending import JUDGED
from adeye.store.stored import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy import Connection

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
_VERDICTS: Final = f"""SELECT c.ordinal, c.result_digest, {_COLUMNS}
FROM campaign_case c JOIN campaign_fsr f ON {JUDGED}
JOIN run r ON r.result_digest = c.result_digest
JOIN verdict v ON v.run_number = r.number AND v.fsr_digest = f.fsr_digest
{_WITHIN}, v.fsr_id"""  # noqa: S608 - own names


@dataclass(frozen=True, slots=True)
class Root:
    """The root of a complete campaign.

    Attributes:
        campaign: Its id.
        leaves: Number of its cases.
        root: sha256 in hex.
    """

    campaign: str
    leaves: int
    root: str


def tree_of(connection: Connection, campaign: str, *, watched: int | None = None) -> Tree:
    """Build the tree over all cases of a campaign, also over those that have no result yet.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.
        watched: Ordinal of a case that is to be proven.
    """
    tree = Tree(watched)
    for _, leaf in leaves(connection, campaign):
        tree.add(leaf)
    return tree


def leaves(connection: Connection, campaign: str) -> Iterator[tuple[int, bytes]]:
    """Give ordinal and leaf hash of the cases of a campaign."""
    planned = connection.exec_driver_sql(
        "SELECT planned FROM campaign WHERE id = ?", (campaign,)
    ).scalar()
    if planned is None:
        msg = "its plan is gone"
        raise ValueError(msg)
    for first in range(0, planned, _CHUNK):
        within = campaign, first, first + _CHUNK
        verdicts = _verdicts(connection, within)
        for ordinal, *parts in connection.exec_driver_sql(_CASES, within):
            content = [*("-" if part is None else str(part) for part in parts), *verdicts[ordinal]]
            yield ordinal, leaf_hash("\n".join(content).encode("utf-8", "surrogatepass"))


def _verdicts(connection: Connection, within: tuple[str, int, int]) -> dict[int, list[str]]:
    found = [tuple(item) for item in connection.exec_driver_sql(_VERDICTS, within)]
    by_ordinal: dict[int, list[str]] = defaultdict(list)
    if found:
        words = stored_words(tables.verdict, _VERDICT, [item[1:] for item in found])
        for item, hashed in zip(found, row_hashes(tables.verdict, words), strict=True):
            by_ordinal[item[0]].append(hashed)
    return by_ordinal


def stored_root(connection: Connection, campaign: str) -> Root | None:
    """Read the root of a campaign; None if it was never complete."""
    table = tables.campaign_root
    found = connection.execute(table.select().where(table.c.campaign_id == campaign)).first()
    return None if found is None else Root(campaign, found.leaves, found.root)


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
    try:
        tree = tree_of(connection, campaign)
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


def save_root(connection: Connection, root: Root) -> None:
    """Save the root of a complete campaign unless it is there.

    Raises:
        IntegrityError: Another one is there.
    """
    require_root(connection, root)
    values = (root.campaign, root.leaves, root.root)
    insert_rows(
        connection,
        tables.campaign_root,
        [row(tables.campaign_root, values)],
        ignore_existing=True,
    )


def proof_of(connection: Connection, campaign: str, ordinal: int) -> tuple[bytes, Proof, bytes]:
    """Prove that a case is in a campaign: hash of its leaf, proof, and root.

    Args:
        connection: In a transaction.
        campaign: Id of the campaign.
        ordinal: Of the case.
    """
    tree, own = Tree(ordinal), b""
    for place, leaf in leaves(connection, campaign):
        tree.add(leaf)
        own = leaf if place == ordinal else own
    return own, tree.proof(), tree.root()


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
