"""Which run a verb is about: by the beginning of its digest, or by what it is among the others."""

from __future__ import annotations

from typing import Annotated

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.errors import UsageError

RunName = Annotated[
    str | None,
    typer.Argument(
        metavar="[RUN]",
        autocompletion=opt.complete_runs,
        help="Beginning of the run's digest, at least 4 characters.",
        show_default=False,
    ),
]
Worst = Annotated[
    str | None,
    opt.option(
        "--worst FSR",
        env="",
        help="In place of RUN: the one with the least margin for an FSR in the latest campaign.",
    ),
]
LastFailed = Annotated[
    bool,
    opt.option(
        "--last-failed",
        env="",
        help="In place of RUN: the worst of the first FSR that fails in the latest campaign.",
    ),
]


def run_called(db: str | None, run: str | None, worst: str | None, *, last_failed: bool) -> str:
    """Return the digest, or its beginning, of the run that somebody means.

    What was not named by a digest is told, with its campaign.

    Raises:
        UsageError: It is named in no way or in several, no such run is there, or none fails.
    """
    if sum((run is not None, worst is not None, last_failed)) != 1:
        raise UsageError(
            "which run?", remedy="Give the beginning of its digest, --worst FSR or --last-failed."
        )
    if run is not None:
        return run
    from adeye.store.read.reader import Reader

    with Reader.open(db) as reader:
        campaign = reader.find_campaign()
        fsr, found = reader.worst_run(campaign.id, worst)
    out.talk(
        f"note: run {out.short(found)}, the worst of {fsr} in campaign {campaign.number} of "
        f"{campaign.odd}"
    )
    return found
