"""What vouches for results: roots of campaigns, who executed them, and results withdrawn."""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import func, select

from adeye.errors import InputError
from adeye.identity import digest
from adeye.store import roots, tables
from adeye.store.campaign_sums import campaign_sums
from adeye.store.encoding import json_text, row, utc_text
from adeye.store.inserting import insert_rows
from adeye.store.reading import find_run

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sqlalchemy import Connection, Table

    from adeye.store.database import Database
    from adeye.store.roots import Root


@dataclass(frozen=True, slots=True)
class Session:
    """One command that worked on a campaign.

    Attributes:
        number: In the order in which they came.
        campaign: Id of the campaign.
        at: UTC time at which it began.
        who: User.
        host: Machine.
        tool: Version of adeye.
        packages_digest: Digest over the versions of all packages.
        cpu: Name of the processor.
        provenance: Everything that was noted.
    """

    number: int
    campaign: str
    at: str
    who: str
    host: str
    tool: str
    packages_digest: str
    cpu: str
    provenance: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Withdrawal:
    """A result that is no evidence any more.

    Attributes:
        result_digest: Which.
        at: UTC time.
        author: Who withdrew it.
        reason: Why.
    """

    result_digest: str
    at: str
    author: str
    reason: str


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


class Evidence:
    """Reads and keeps what vouches for results, each method in one transaction."""

    def __init__(self, database: Database) -> None:
        """Use an open database of the current schema."""
        self._database = database

    def record_root(self, campaign: str) -> Root | None:
        """Compute and save the root of a campaign once it is complete; None before.

        Raises:
            IntegrityError: A row of it is damaged, or another root was saved.
        """
        with self._database.read() as connection:
            known = roots.stored_root(connection, campaign)
            if known is not None or not roots.is_complete(connection, campaign):
                return known
            found = roots.computed_root(connection, campaign)
        with self._database.write() as connection:
            roots.save_root(connection, found)
        return found

    def root(self, campaign: str) -> Root | None:
        """Read the root of a campaign; None if it was never complete."""
        with self._database.read() as connection:
            return roots.stored_root(connection, campaign)

    def require_root(self, root: Root) -> None:
        """Refuse a computed root that is not the one that was saved.

        Raises:
            IntegrityError: It is another one.
        """
        with self._database.read() as connection:
            roots.require_root(connection, root)

    def computed_root(self, campaign: str) -> Root:
        """Compute the root from the rows as they are now, also of an incomplete campaign.

        Raises:
            IntegrityError: A row of it is damaged.
        """
        with self._database.read() as connection:
            return roots.computed_root(connection, campaign)

    def prove(self, run: str, campaign: str) -> RunProof:
        """Prove that a run is evidence of a campaign.

        Args:
            run: Beginning of its result digest, or its ordinal.
            campaign: Id of the campaign.

        Raises:
            InputError: There is no such run in the campaign.
        """
        with self._database.read() as connection:
            found = find_run(connection, run, campaign)
            leaf, proof, root = roots.proof_of(connection, campaign, found.ordinal)
        path = tuple(item.hex() for item in proof.path)
        return RunProof(
            campaign,
            found.result_digest,
            found.ordinal,
            proof.leaves,
            leaf.hex(),
            path,
            root.hex(),
        )

    def sums(self, campaign: str) -> dict[str, tuple[int, str]]:
        """Count the rows of a campaign by table and sum their hashes, see ``campaign_sums``."""
        with self._database.read() as connection:
            return campaign_sums(connection, campaign)

    def add_session(self, campaign: str, provenance: Mapping[str, Any]) -> None:
        """Note that a command begins to work on a campaign."""
        table = tables.session
        packages = provenance.get("packages", {})
        with self._database.write() as connection:
            values = (
                _next(connection, table),
                campaign,
                utc_text(None),
                str(provenance.get("who", "")),
                str(provenance.get("host", "")),
                str(provenance.get("adeye", "")),
                digest(packages),
                str(provenance.get("cpu", {}).get("name", "")),
                json_text(dict(provenance)),
            )
            insert_rows(connection, table, [row(table, values)])

    def sessions(self, campaign: str) -> tuple[Session, ...]:
        """List the commands that worked on a campaign, the first first."""
        table = tables.session
        wanted = table.select().where(table.c.campaign_id == campaign).order_by(table.c.number)
        with self._database.read() as connection:
            found = connection.execute(wanted).all()
        return tuple(
            Session(
                number=item.number,
                campaign=item.campaign_id,
                at=item.at,
                who=item.who,
                host=item.host,
                tool=item.tool,
                packages_digest=item.packages_digest,
                cpu=item.cpu,
                provenance=json.loads(item.provenance),
            )
            for item in found
        )

    def kept_files(self, campaign: str | None = None) -> dict[str, tuple[tuple[str, str], ...]]:
        """Name the files that keep traces, with digests of result and trace of each run in it.

        Args:
            campaign: Only files with runs of this campaign, and these.
        """
        found: dict[str, list[tuple[str, str]]] = defaultdict(list)
        source = "kept_trace k JOIN run r ON r.number = k.run_number"
        given: tuple[str, ...] = ()
        if campaign is not None:
            source += " JOIN campaign_case c ON c.result_digest = r.result_digest"
            source += " WHERE c.campaign_id = ?"
            given = (campaign,)
        with self._database.read() as connection:
            for name, result, trace in connection.exec_driver_sql(
                f"SELECT k.file, r.result_digest, r.trace_digest FROM {source} "  # noqa: S608
                "ORDER BY k.file, k.place",
                given,
            ):
                found[str(name)].append((str(result), str(trace)))
        return {name: tuple(runs) for name, runs in found.items()}

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
            values = (
                _next(connection, table),
                result_digest,
                utc_text(None),
                author.strip(),
                reason.strip(),
            )
            insert_rows(connection, table, [row(table, values)])
            return True

    def withdrawals(self, campaign: str | None = None) -> tuple[Withdrawal, ...]:
        """List withdrawn results, those of one campaign if its id is given."""
        table, cases = tables.withdrawal, tables.campaign_case
        wanted = table.select().order_by(table.c.number)
        if campaign is not None:
            of_campaign = select(cases.c.result_digest).where(cases.c.campaign_id == campaign)
            wanted = wanted.where(table.c.result_digest.in_(of_campaign))
        with self._database.read() as connection:
            found = connection.execute(wanted).all()
        return tuple(
            Withdrawal(item.result_digest, item.at, item.author, item.reason) for item in found
        )


def _next(connection: Connection, table: Table) -> int:
    last = connection.execute(select(func.max(table.c.number))).scalar_one()
    return int(last or 0) + 1
