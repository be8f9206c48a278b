"""``selftest``: does this installation still find what is known to be bad."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli.options import Db, Json, Quiet
from adeye.cli.output import clean, emit, emit_json, emit_table, talk, wrote
from adeye.cli.progress import reporting

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.report.credibility import SelfTestResult
    from adeye.selftest.masters import Master
    from adeye.selftest.running import Examined

_INTEGRITY: Final = 4
REMARK: Final = (
    "The masters are chosen, not drawn at random: the bound is about defects of this kind, by "
    "assumption."
)

Quick = Annotated[
    bool,
    typer.Option(
        "--quick", envvar="ADEYE_QUICK", help="One master of each group; nothing is kept."
    ),
]
Only = Annotated[
    list[str] | None,
    typer.Option(
        "--only",
        metavar="NAME",
        envvar="ADEYE_ONLY",
        help="This master only; may be given again. Nothing is kept.",
    ),
]
List = Annotated[
    bool, typer.Option("--list", envvar="ADEYE_LIST", help="List the masters, run none.")
]


def selftest(
    quick: Quick = False,
    only: Only = None,
    listed: List = False,
    db: Db = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Take known-bad masters through plan, run, judge, store and exit code, and count the found.

    Each is a small deliberate defect with a good twin: the defect must be detected in the way that
    is stated for it, the twin must pass. All of it happens in a temporary folder. The result of a
    complete self-test is kept as selftest.json beside the database, for the report.

    Exit codes: 0 all detected and no twin rejected, 2 there is no such master, 4 otherwise.
    """
    from adeye.selftest.running import choose, conclude, examine

    masters = choose(only or (), quick=quick)
    if listed:
        _list(masters, json=json)
        return
    with reporting(f"{len(masters)} known-bad masters", quiet=quiet) as progress:
        from adeye.campaign.runner import Progress

        def tell(done: int) -> None:
            if progress is not None:
                progress(Progress("self-test", done, len(masters), 0))

        examined = examine(masters, tell)
    result = conclude(examined)
    if json:
        emit_json("selftest", {**result.model_dump(mode="json"), "results": _rows(examined)})
    else:
        _print(examined, result)
    if not (quick or only):
        _keep(result, db)
    if not result.is_good:
        names = dict.fromkeys((*result.undetected, *result.rejected_twins))
        talk(clean(f"IntegrityError: do not rely on this installation: {', '.join(names)}."))
        raise typer.Exit(_INTEGRITY)


def _keep(result: SelfTestResult, db: str | None) -> None:
    from adeye.report.credibility import write_result
    from adeye.store.location import locate

    wrote(write_result(result, locate(db).beside.parent))


def _list(masters: Sequence[Master], *, json: bool) -> None:
    rows = [
        {
            "name": item.name,
            "group": item.group,
            "wrong": item.wrong,
            "finder": item.finder,
            "exit_code": item.exit_code,
            "words": item.words,
        }
        for item in masters
    ]
    if json:
        emit_json("selftest-masters", {"masters": rows})
        return
    emit_table(
        ("Master", "Group", "What is wrong", "Found by", "Exit", "Shows as"),
        [list(row.values()) for row in rows],
        right=("Exit",),
    )


def _rows(examined: Sequence[Examined]) -> list[dict[str, Any]]:
    return [
        {
            "name": item.master.name,
            "group": item.master.group,
            "wrong": item.master.wrong,
            "finder": item.master.finder,
            "is_detected": item.is_detected,
            "exit_code": item.seen.exit_code,
            "text": item.seen.text,
            "is_twin_good": item.is_twin_good,
            "twin_exit_code": item.twin.exit_code,
            "twin_text": item.twin.text,
        }
        for item in examined
    ]


def _print(examined: Sequence[Examined], result: SelfTestResult) -> None:
    rows = [
        [
            item.master.name,
            item.master.group,
            item.master.wrong,
            item.master.words,
            item.seen.exit_code,
            "detected" if item.is_detected else "NOT DETECTED",
            "passes" if item.is_twin_good else "REJECTED",
        ]
        for item in examined
    ]
    headers = ("Master", "Group", "What is wrong", "Shows as", "Exit", "Master is", "Twin")
    emit_table(headers, rows, right=("Exit",))
    emit(f"\n{clean(result.text)}")
    emit(REMARK)
