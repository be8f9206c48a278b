"""``certify``: execute a sample again under other conditions, and keep what came of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import Db, Json, Quiet
from adeye.cli.output import clean, emit, emit_fields, emit_json, emit_table, plain, short
from adeye.cli.progress import watching
from adeye.cli.uncertainty import What

if TYPE_CHECKING:
    from adeye.campaign.certificate import Certificate
    from adeye.campaign.differences import Finding

SHOWN: Final = 20
"""Findings that are listed; JSON has all."""

_VIOLATED: Final = 4

SampleSize = Annotated[
    int,
    typer.Option(
        "--sample",
        min=1,
        metavar="N",
        envvar="ADEYE_CERTIFY_SAMPLE",
        help="Runs that are executed again, the same every time, from every combination of "
        "scenario, architecture and fault entry in turn.",
    ),
]
Masks = Annotated[
    bool,
    typer.Option(
        "--masks",
        envvar="ADEYE_MASKS",
        help="Imitate lesser processors, too, in processes of their own; kernels are compiled "
        "anew for the first of them, which takes minutes.",
    ),
]


def certify(
    what: What = None,
    *,
    sample: SampleSize = 1000,
    masks: Masks = False,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Certify that a campaign is deterministic: no result depends on how it was executed.

    A sample of its runs is executed again in batches of 1 to 1,024, in other orders, in threads
    and processes, and each trace and metric is compared with what is stored. The certificate is
    kept in the database. A run that differs is named with the conditions and the first ticks that
    differ.

    Exit codes: 0 certified, 2 input error, 4 a run differs, 5 a batch could not be executed.
    """
    from adeye.campaign.certificate import certify as certify_campaign

    with watching(quiet=quiet) as report:
        found = certify_campaign(db, what, sample=sample, masked=masks, report=report)
    if json:
        emit_json("certify", plain(found) | {"certified": found.is_certified})
    else:
        _print(found)
    if not found.is_certified:
        raise typer.Exit(_VIOLATED)


def _print(found: Certificate) -> None:
    left_out = f"{found.machine_dependent:,} that a deadline of the machine ended"
    emit_fields(
        {
            "Campaign": f"{short(found.campaign)} of {found.odd}",
            "Tool": f"adeye {found.tool}",
            "Class": found.class_,
            "Sample": f"{found.sampled:,} of {found.executed:,} runs, from {found.strata:,} "
            "combinations of scenario, architecture and fault entry",
            "Left out": left_out if found.machine_dependent else "",
        }
    )
    emit("")
    emit_table(("Condition", "Compared"), found.conditions, right=("Compared",))
    if found.is_certified:
        emit("\nCertified: every trace, metric and verdict of the sample is as stored.")
        return
    emit_table(
        ("Run", "Scenario", "Architecture", "Faults", "Differs", "From tick", "Conditions"),
        [_row(item, len(found.conditions)) for item in found.findings[:SHOWN]],
        title="Runs that are not as stored",
    )
    if len(found.findings) > SHOWN:
        emit(f"{len(found.findings) - SHOWN:,} more; --json lists them.")
    emit(clean(f"\nNOT CERTIFIED: {_cause(found)}"))


def _row(item: Finding, conditions: int) -> list[object]:
    of = "every one" if len(item.conditions) == conditions else "; ".join(item.conditions)
    return [
        short(item.run),
        item.scenario,
        item.architecture,
        item.fault_entry,
        ", ".join(item.differs),
        None if item.first_tick is None else item.first_tick,
        of,
    ]


def _cause(found: Certificate) -> str:
    from adeye.campaign.reproduce import CHANGED, UNSTEADY

    count = f"{len(found.findings):,} of {found.sampled:,} runs differ"
    everywhere = all(
        len(item.conditions) == len(found.conditions) and item.traces <= 2
        for item in found.findings
    )
    if not found.findings:
        return "nothing could be compared under some condition."
    if everywhere:
        return f"{count}, in the same way under every condition. In each, {CHANGED}."
    return f"{count}. In each, {UNSTEADY}."
