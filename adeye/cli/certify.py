"""``certify|selftest``: is a campaign deterministic; are faults found that were put in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import Db, Json, Quiet, option
from adeye.cli.progress import reporting, watching
from adeye.cli.results.confidence import What
from adeye.judge.verdict import ExitCode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.studies.certify import Certificate, Finding
    from adeye.report.credibility import SelfTestResult
    from adeye.selftest.bench import Master
    from adeye.selftest.running import Examined

# --- ``certify``: execute a sample again under other conditions, and keep what came of it ---------

SHOWN: Final = 20
"""Findings that are listed; JSON has all."""


def certify(
    what: What = None,
    *,
    sample: Annotated[int, option("N", env="CERTIFY_SAMPLE", min=1)] = 1000,
    masks: bool = False,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Certify that a campaign is deterministic: no result depends on how it was executed.

    A sample of its runs is executed again in batches of 1 to 1,024, in other orders, in threads
    and processes, and each trace, metric and verdict is compared with what is stored. The
    certificate is kept in the database. A run that differs is named with the conditions and the
    first ticks that differ.

    Exit codes: 0 certified, 2 input error, 3 no verdict, or not all of the sample, could be
    compared, 4 a run differs, 5 a batch could not be executed.

    Parameters:
        sample: Runs that are executed again, the same every time, from every combination of
            scenario, architecture and fault entry in turn.
        masks: Imitate lesser processors, too, in processes of their own; kernels are compiled anew
            for the first of them, which takes minutes.

    Examples:
        adeye certify odd/motorway_chauffeur.yaml
        adeye certify 3 --sample 200 --masks --json
    """
    from adeye.campaign.studies.certify import certify as certify_campaign

    with watching(quiet=quiet) as report:
        found = certify_campaign(db, what, sample=sample, masked=masks, report=report)
    out.emit_found(
        "certify",
        found,
        _print_certificate,
        json=json,
        document=lambda found: out.plain(found) | {"certified": found.is_certified},
    )
    if not found.is_certified:
        raise typer.Exit(ExitCode.INTEGRITY if found.findings else ExitCode.INCOMPLETE)


def _print_certificate(found: Certificate) -> None:
    left_out = f"{found.machine_dependent:,} that depend on the machine"
    out.emit_fields(
        {
            "Campaign": f"{out.short(found.campaign)} of {found.odd}",
            "Tool": f"adeye {found.tool}",
            "Class": found.class_,
            "Sample": f"{found.sampled:,} of {found.executed:,} runs, from {found.strata:,} "
            "combinations of scenario, architecture and fault entry",
            "Verdicts": f"{found.verdicts:,} compared",
            "Left out": left_out if found.machine_dependent else "",
        }
    )
    out.emit("")
    out.emit_table(("Condition", "Compared"), found.conditions, right=("Compared",))
    if found.is_certified:
        out.emit("\nCertified: every trace, metric and verdict of the sample is as stored.")
        return

    def conditions(item: Finding) -> str:
        is_all = len(item.conditions) == len(found.conditions)
        return "every one" if is_all else "; ".join(item.conditions)

    out.emit_records(
        found.findings[:SHOWN],
        {
            "Run": lambda item: out.short(item.run),
            "Scenario": "scenario",
            "Architecture": "architecture",
            "Faults": "fault_entry",
            "Differs": lambda item: ", ".join(item.differs),
            "From tick": "first_tick",
            "Conditions": conditions,
        },
        title="Runs that are not as stored",
    )
    if len(found.findings) > SHOWN:
        out.emit(f"{len(found.findings) - SHOWN:,} more; --json lists them.")
    out.emit_line(f"\nNOT CERTIFIED: {_cause(found)}")


def _cause(found: Certificate) -> str:
    from adeye.campaign.replay import CHANGED, UNSTEADY

    count = f"{len(found.findings):,} of {found.sampled:,} runs differ"
    everywhere = all(
        len(item.conditions) == len(found.conditions) and item.traces <= 2
        for item in found.findings
    )
    if not found.findings and not (found.verdicts or found.lost):
        return "no verdict could be compared: those that are stored were judged otherwise."
    if not found.findings:
        return (
            f"{found.lost:,} executions could not be compared: they depended on the machine, as "
            "those of the sample did not. Certify again when it does nothing else."
        )
    if everywhere:
        return f"{count}, in the same way under every condition. In each, {CHANGED}."
    return f"{count}. In each, {UNSTEADY}."


# --- ``selftest``: does this installation still find what is known to be bad ----------------------

REMARK: Final = (
    "The masters are chosen, not drawn at random: the bound is about defects of this kind, by "
    "assumption."
)


def selftest(
    quick: bool = False,
    only: Annotated[list[str] | None, option("NAME")] = None,
    listed: Annotated[bool, option("--list")] = False,
    db: Db = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Take known-bad masters through plan, run, judge, store and exit code, and count the found.

    Each is a small deliberate defect with a good twin: the defect must be detected in the way that
    is stated for it, the twin must pass. All of it happens in a temporary folder. The result of a
    complete self-test is kept as selftest.json beside the database, for the report.

    Exit codes: 0 all detected and no twin rejected, 2 there is no such master, 4 otherwise.

    Parameters:
        quick: One master of each group; nothing is kept.
        only: This master only; may be given again. Nothing is kept.
        listed: List the masters, run none.

    Examples:
        adeye selftest
        adeye selftest --only never_brakes --only verdict_edited
    """
    from adeye.selftest.running import choose, conclude, examine

    masters = choose(only or (), quick=quick)
    if listed:
        _list(masters, json=json)
        return
    with reporting(f"{len(masters)} known-bad masters", quiet=quiet) as progress:
        from adeye.campaign.run import Progress

        def tell(done: int) -> None:
            if progress is not None:
                progress(Progress("self-test", done, len(masters), 0))

        examined = examine(masters, tell)
    result = conclude(examined)
    if json:
        out.emit_json("selftest", {**out.plain(result), "results": _rows(examined)})
    else:
        _print_masters(examined, result)
    if not (quick or only):
        from adeye.report.credibility import write_result
        from adeye.store.location import locate

        out.wrote(write_result(result, locate(db).beside.parent))
    if not result.is_good:
        names = dict.fromkeys((*result.undetected, *result.rejected_twins))
        out.talk(
            out.clean(f"IntegrityError: do not rely on this installation: {', '.join(names)}.")
        )
        raise typer.Exit(ExitCode.INTEGRITY)


_MASTER: Final = ("name", "group", "wrong", "finder")


def _list(masters: Sequence[Master], *, json: bool) -> None:
    rows = [out.fields_of(item, *_MASTER, "exit_code", "words") for item in masters]
    if json:
        out.emit_json("selftest-masters", {"masters": rows})
        return
    out.emit_table(
        ("Master", "Group", "What is wrong", "Found by", "Exit", "Shows as"),
        [list(row.values()) for row in rows],
        right=("Exit",),
    )


def _rows(examined: Sequence[Examined]) -> list[dict[str, Any]]:
    return [
        {
            **out.fields_of(item.master, *_MASTER),
            "is_detected": item.is_detected,
            "exit_code": item.seen.exit_code,
            "text": item.seen.text,
            "is_twin_good": item.is_twin_good,
            "twin_exit_code": item.twin.exit_code,
            "twin_text": item.twin.text,
        }
        for item in examined
    ]


def _print_masters(examined: Sequence[Examined], result: SelfTestResult) -> None:
    out.emit_records(
        examined,
        {
            "Master": lambda item: item.master.name,
            "Group": lambda item: item.master.group,
            "What is wrong": lambda item: item.master.wrong,
            "Shows as": lambda item: item.master.words,
            "Exit": lambda item: item.seen.exit_code,
            "Master is": lambda item: "detected" if item.is_detected else "NOT DETECTED",
            "Twin": lambda item: "passes" if item.is_twin_good else "REJECTED",
        },
        right=("Exit",),
    )
    out.emit(f"\n{out.clean(result.text)}")
    out.emit(REMARK)
