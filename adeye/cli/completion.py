"""What the shell offers on TAB: scenarios, runs, campaigns, saved queries. Errors offer nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Final

import typer

_OFFERED: Final = 50

Offer = tuple[str, str]


def _quiet(complete: Callable[[typer.Context, str], Iterable[Offer]]) -> Callable[..., list[Offer]]:
    """Offer nothing instead of printing an error into the line that somebody types."""

    @wraps(complete)
    def offers(ctx: typer.Context, incomplete: str) -> list[Offer]:
        try:
            return [item for item in complete(ctx, incomplete) if item[0].startswith(incomplete)]
        except Exception:  # noqa: BLE001 - see above
            return []

    return offers


@_quiet
def complete_scenarios(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:  # noqa: ARG001
    """Offer the scenarios of the catalogue."""
    from adeye.cli.catalogue import catalogue_files
    from adeye.cli.output import clean

    chosen = ctx.params.get("catalogue")
    known = catalogue_files(None if chosen is None else Path(chosen))
    return [(clean(name), clean(path.parent.name)) for name, path in known.items()]


@_quiet
def complete_runs(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:
    """Offer runs of the database that begin so."""
    prefix = "".join(letter for letter in incomplete if letter in "0123456789abcdef")
    return _rows(
        ctx,
        "SELECT DISTINCT substr(run, 1, 10), scenario || ' ' || architecture FROM v_runs "  # noqa: S608
        f"WHERE run LIKE '{prefix}%' ORDER BY 1 LIMIT {_OFFERED}",
    )


@_quiet
def complete_campaigns(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:  # noqa: ARG001
    """Offer the campaigns of the database, the newest first."""
    return _rows(
        ctx,
        f"SELECT number, odd FROM v_campaigns ORDER BY recency LIMIT {_OFFERED}",  # noqa: S608
    )


@_quiet
def complete_queries(ctx: typer.Context, incomplete: str) -> Iterable[Offer]:  # noqa: ARG001
    """Offer the saved queries."""
    from adeye.cli.queries import SAVED

    return [(query.name, query.text) for query in SAVED.values()]


def _rows(ctx: typer.Context, sql: str) -> list[Offer]:
    from adeye.cli.output import clean
    from adeye.store.query import run_query

    result = run_query(ctx.params.get("db"), sql, timeout_s=1.0)
    return [(clean(value), clean(text)) for value, text in result.rows]
