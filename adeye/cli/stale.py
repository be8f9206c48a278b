"""``stale``: which evidence no longer counts under the files as they are, and what restores it."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adeye.cli.options import Backend, Db, Json, Variant
from adeye.cli.output import clean, emit, emit_json, emit_table

if TYPE_CHECKING:
    from adeye.campaign.staleness import Staleness

Odd = Annotated[
    Path | None,
    typer.Argument(
        metavar="[ODD]",
        help="The ODD's file; default: that of the newest campaign.",
        show_default=False,
    ),
]


def stale(
    odd: Odd = None,
    *,
    db: Db = None,
    backend: Backend = "batch",
    variant: Variant = None,
    json: Json = False,
) -> None:
    """Say which evidence of the newest campaign no longer counts, and why.

    Evidence is a run with a verdict of an FSR. It goes stale when a file is edited on which the run
    or the verdict depends: a scenario, the executable part of an architecture, a fault, a threshold
    or a formula, the attributes of the ODD, the code of a plug-in. Titles, texts and costs make
    nothing stale. Nothing is executed or saved.
    """
    from adeye.campaign.plan import make_plan
    from adeye.campaign.staleness import find_stale
    from adeye.errors import InputError
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        plan = None if odd is None else make_plan(odd, backend=backend, variant=variant)
        name = None if plan is None else plan.files.odd.spec.odd
        campaign = repository.latest_campaign(name)
        if campaign is None:
            what = "the database has no campaign" if name is None else f"no campaign of ODD {name}"
            raise InputError(what, remedy="Run an ODD first: adeye run ODD")
        path = odd or Path(str(campaign.provenance.get("odd_path", "")))
        if plan is None:
            if not path.is_file():
                raise InputError(
                    f"the ODD of campaign {campaign.number} is no longer at {path}",
                    remedy="Name its file: adeye stale ODD",
                )
            plan = make_plan(path, backend=backend, variant=variant)
        found = find_stale(repository, plan, campaign)
    if json:
        emit_json("stale", _document(found))
    else:
        _print(found, path, db)


def _document(found: Staleness) -> dict[str, object]:
    return {
        "campaign": found.campaign,
        "number": found.number,
        "odd": found.odd,
        "evidence": found.evidence,
        "counts": found.counts,
        "stale": [
            {
                "cause": item.cause,
                "subject": item.subject,
                "text": item.text,
                "evidence": item.evidence,
                "runs": item.runs,
                "fsrs": list(item.fsrs),
                "architectures": list(item.architectures),
            }
            for item in found.stale
        ],
        "now": {
            "evidence": found.planned,
            "there": found.there,
            "to_judge": found.to_judge,
            "to_replay": found.to_replay,
            "to_execute": found.to_execute,
        },
    }


def _print(found: Staleness, odd: Path, db: str | None) -> None:
    from adeye.store.location import option

    emit(
        f"Campaign {found.number} ({clean(found.odd)}): {found.counts:,} of {found.evidence:,} "
        "verdicts still count."
    )
    if found.stale:
        rows = [
            [
                f"{item.evidence:,}",
                f"{item.runs:,}",
                clean(", ".join(item.fsrs)),
                clean(item.text),
            ]
            for item in found.stale
        ]
        emit("")
        emit_table(("Verdicts", "Runs", "FSRs", "Why"), rows, right=("Verdicts", "Runs"))
    name = f"{shlex.quote(str(odd))}{option(db)}"
    needs = [
        (found.to_judge, "to judge again", f"adeye judge {name}"),
        (found.to_replay, "to execute again and judge", f"adeye judge {name} --replay"),
        (found.to_execute, "to execute", f"adeye run {name}"),
    ]
    emit(f"\nThe files ask for {found.planned:,} verdicts; {found.there:,} are there.")
    for count, what, command in needs:
        if count:
            emit(clean(f"{count:,} {'run' if count == 1 else 'runs'} {what}: {command}"))
