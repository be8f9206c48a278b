"""``show`` and ``replay``: one run, as it is stored and as it comes out again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import Db, Json, RunId
from adeye.cli.output import clean, emit, emit_fields, emit_json, emit_value, plain, wrote
from adeye.errors import UsageError

if TYPE_CHECKING:
    from adeye.campaign.reproduce import Replayed

_SECTIONS: Final = ("parameters", "metrics", "verdicts", "events")
_COMMAND: Final = "command"
_DIFFERS: Final = 4

HtmlFile = Annotated[
    Path | None,
    typer.Option(
        "--html",
        metavar="FILE",
        envvar="ADEYE_HTML",
        help="Write the run as an HTML page with its replay.",
    ),
]


def show(run: RunId, db: Db = None, json: Json = False) -> None:
    """Show a run as it is stored: parameters, outcome, metrics, verdicts, events.

    RUN is any unique beginning of the run's digest, as the verdict table and the report print it.
    """
    from adeye.campaign.reproduce import describe_run

    description = describe_run(db, run)
    if json:
        emit_json("show", description)
        return
    head = {
        name: value
        for name, value in description.items()
        if name not in {*_SECTIONS, _COMMAND} and not isinstance(value, dict | list | tuple)
    }
    emit_fields(head)
    for name, value in description.items():
        if name not in head and name != _COMMAND:
            emit_value(name.capitalize().replace("_", " "), value)
    if _COMMAND in description:
        emit(f"\nReproduce it:  {clean(description[_COMMAND])}")


Channel = Annotated[
    str | None,
    typer.Option(
        "--channel",
        metavar="ID",
        envvar="ADEYE_CHANNEL",
        help="Channel whose observations are saved; needs --dump.",
    ),
]
DumpFile = Annotated[
    Path | None,
    typer.Option(
        "--dump",
        metavar="FILE",
        envvar="ADEYE_DUMP",
        help="Save what the channel is shown, as lines of JSON; needs --channel.",
    ),
]


def replay(
    run: RunId,
    db: Db = None,
    html: HtmlFile = None,
    channel: Channel = None,
    dump: DumpFile = None,
    json: Json = False,
) -> None:
    """Execute a stored run again and compare the digest of its trace.

    With --channel and --dump it saves what that channel is shown, which feeds it again without the
    simulator: `./program < FILE`, or `adeye.testing.feed`.

    Exit codes: 0 identical, 4 the trace differs.
    """
    from adeye.campaign.reproduce import replay_run

    if channel is None or dump is None:
        if channel is not None or dump is not None:
            raise UsageError(
                "--channel and --dump belong together",
                remedy="Give --channel ID --dump FILE, or neither.",
            )
        saved = None
    else:
        saved = channel, dump
    again = replay_run(db, run, saved)
    if json:
        emit_json("replay", plain(again))
    else:
        _print(again)
    if html is not None:
        from adeye.reporting import write_replay

        write_replay(db, run, html)
        wrote(html)
    if dump is not None:
        wrote(dump)
    if not again.identical:
        raise typer.Exit(_DIFFERS)


def _print(again: Replayed) -> None:
    emit_fields(
        {
            "Run": again.run,
            "Scenario": again.scenario,
            "Architecture": again.architecture,
            "Fault entry": again.fault_entry,
            "Outcome": again.outcome,
            "Rows": again.rows,
            "Stored trace": again.stored_digest,
            "Trace now": again.trace_digest,
        }
    )
    emit_value("Verdicts", again.verdicts)
    if again.identical:
        emit("\nIdentical: the trace has the stored digest.")
    else:
        cause = again.note or "the code of a part or the machine's arithmetic has changed"
        emit(clean(f"\nDIFFERENT: the trace does not have the stored digest; {cause}.", lines=True))
