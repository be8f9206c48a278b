"""Content that breaks its reader: a database that somebody else wrote or changed says so."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final, Protocol

from sqlalchemy.exc import MultipleResultsFound, NoResultFound

from adeye.errors import AdeyeError, IntegrityError

if TYPE_CHECKING:
    from adeye.store.location import Location
    from adeye.store.stored import Finding

UNFORESEEN: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    MultipleResultsFound,
    NoResultFound,
    RecursionError,
    TypeError,
    ValueError,
)
"""What readers raise on content that is not of the form in which it is written."""

LOOKED_AT: Final = "The database was verified because of this error."
"""Note on an error whose cause was looked for: of many runs that takes minutes."""


class Verified(Protocol):
    """A repository, as far as it is needed here."""

    @property
    def location(self) -> Location:
        """Where the database is."""

    def verify(self) -> tuple[Finding, ...]:
        """Compare everything with its digests."""

    def close(self) -> None:
        """Close the connections."""


def is_unexplained(raised: object) -> bool:
    """Tell whether an error may come of altered content, and nobody looked yet."""
    return (
        isinstance(raised, UNFORESEEN)
        and not isinstance(raised, AdeyeError)
        and LOOKED_AT not in getattr(raised, "__notes__", ())
    )


def close(repository: Verified, raised: object) -> None:
    """Close a repository; look for the cause if something unforeseen ended its use.

    Args:
        repository: What was used.
        raised: What ended its use; None if nothing did.

    Raises:
        IntegrityError: Something unforeseen was raised, and the database is not as it was written.
    """
    try:
        if isinstance(raised, Exception) and is_unexplained(raised):
            findings: tuple[Finding, ...] = ()
            # Whoever cannot even be verified keeps the error that was there first.
            with suppress(Exception):
                findings = repository.verify()
            raised.add_note(LOOKED_AT)
            if findings:
                first = findings[0]
                raise IntegrityError(
                    f"database {repository.location} is not as it was written: {first.table} "
                    f"{first.row}: {first.problem}. See 'adeye db verify'; restore it from a copy."
                ) from raised
    finally:
        repository.close()
