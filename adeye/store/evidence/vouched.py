"""What is stored of what vouches for results: roots, sessions, withdrawals, files of traces.

It is read without what computes roots.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import Connection

from adeye.store.cases import TWINS
from adeye.store.database import Door, reading
from adeye.store.records import of_row


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


def stored_root(connection: Connection, campaign: str) -> Root | None:
    """Read the root of a campaign; None if it was never complete."""
    query = "SELECT leaves, root FROM campaign_root WHERE campaign_id = ?"
    found = connection.exec_driver_sql(query, (campaign,)).first()
    return None if found is None else Root(campaign, found.leaves, found.root)


_RESTS_ON: Final = f"""(
    SELECT result_digest FROM campaign_case WHERE campaign_id = ?
    UNION SELECT h.result_digest FROM {TWINS} WHERE c.campaign_id = ?)"""  # noqa: S608 - own names
"""Results that the verdicts of a campaign rest on."""


class Vouched(Door):
    """Reads what vouches for results, each method in one transaction."""

    root = reading(stored_root)

    def sessions(self, campaign: str) -> tuple[Session, ...]:
        """List the commands that worked on a campaign, the first first."""
        query = "SELECT * FROM session WHERE campaign_id = ? ORDER BY number"
        return tuple(
            of_row(
                Session,
                item._mapping,
                campaign=item.campaign_id,
                provenance=json.loads(item.provenance),
            )
            for item in self._ask(query, campaign)
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
        for name, result, trace in self._ask(
            f"SELECT k.file, r.result_digest, r.trace_digest FROM {source} "  # noqa: S608
            "ORDER BY k.file, k.place",
            *given,
        ):
            found[str(name)].append((str(result), str(trace)))
        return {name: tuple(runs) for name, runs in found.items()}

    def kept_places(self, result_digest: str) -> list[tuple[str, int, str]]:
        """Tell where traces of a result are kept: file, place in it, digest of the trace."""
        query = (
            "SELECT k.file, k.place, r.trace_digest FROM kept_trace k "
            "JOIN run r ON r.number = k.run_number WHERE r.result_digest = ? "
            "ORDER BY k.file, k.place"
        )
        rows = self._ask(query, result_digest)
        return [(str(name), int(place), str(digest)) for name, place, digest in rows]

    def withdrawals(self, campaign: str | None = None) -> tuple[Withdrawal, ...]:
        """List withdrawn results, those of one campaign if its id is given.

        A campaign has its twins with half the step as well: its margins rest on them.
        """
        query = "SELECT * FROM withdrawal"
        given: tuple[str, ...] = ()
        if campaign is not None:
            query += " WHERE result_digest IN "
            query += _RESTS_ON
            given = (campaign, campaign)
        found = self._ask(f"{query} ORDER BY number", *given)
        return tuple(of_row(Withdrawal, item._mapping) for item in found)
