"""``fork`` and ``forks``: a run with another decision, and the takeovers of a campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli.options import CampaignId, Db, Json, Quiet, RunId
from adeye.cli.output import clean, emit, emit_fields, emit_json, emit_table, plain, short
from adeye.cli.progress import watching

if TYPE_CHECKING:
    from adeye.campaign.forks import Forked
    from adeye.campaign.takeovers import TakeoverMatrix

SHOWN: Final = 20
"""Runs that are listed; JSON has all."""

Start = Annotated[
    str,
    typer.Option(
        "--from",
        metavar="TICK|TIME",
        envvar="ADEYE_FROM",
        help="Tick, such as 40, or time, such as '2 s', from which the authority is another.",
    ),
]
AuthorityId = Annotated[
    str,
    typer.Option(
        "--authority",
        metavar="CHANNEL",
        envvar="ADEYE_AUTHORITY",
        help="The channel that acts from there on, whatever the switch decides.",
    ),
]
Sample = Annotated[
    int,
    typer.Option(
        "--sample",
        min=0,
        metavar="N",
        envvar="ADEYE_SAMPLE",
        help="Look at so many runs of the campaign, with and without faults, the same every "
        "time; 0 for all.",
    ),
]


def fork(
    run: RunId,
    start: Start,
    authority: AuthorityId,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Execute a stored run again with another authority from a tick on.

    The fork runs from the start. Before the tick it must be the stored run bit for bit, else
    nothing is kept. It is stored as a run of its own, which no campaign counts.

    Exit codes: 0 done, 4 the run or the beginning of its fork is not as it was recorded.
    """
    from adeye.campaign.forks import fork_run

    with watching(quiet=quiet) as report:
        forked = fork_run(db, run, start=start, authority=authority, report=report)
    if json:
        emit_json("fork", plain(forked))
        return
    _print_fork(forked)


def _print_fork(forked: Forked) -> None:
    origin, other = forked.origin, forked.fork
    emit_fields(
        {
            "Run": origin.run,
            "Fork": other.run,
            "Authority": f"{forked.authority} from tick {forked.from_tick}, "
            f"{forked.from_time_s:g} s",
            "Prefix": _prefix(forked),
        }
    )
    rows: list[list[object]] = [
        ["end", origin.end_reason, other.end_reason],
        ["duration [s]", origin.duration_s, other.duration_s],
        ["violation [s]", origin.violation_s, other.violation_s],
        ["outcome", origin.outcome, other.outcome],
    ]
    rows += [[name, verdict, other.verdicts.get(name)] for name, verdict in origin.verdicts.items()]
    emit("")
    emit_table(("", "Run", "Fork"), rows)
    if forked.is_same:
        emit("\nThe fork is the run itself, bit for bit: the switch decides so as well.")


def _prefix(forked: Forked) -> str:
    same = f"{forked.from_tick} ticks as recorded"
    if forked.links is None:
        return f"{same}; the run has no digest chain"
    if forked.links == 0:
        from adeye.trace import LINK_TICKS

        return (
            f"{same}, compared bit for bit with the run executed again; shorter than one link of "
            f"the digest chain ({LINK_TICKS} ticks)"
        )
    links = "1 link" if forked.links == 1 else f"{forked.links} links"
    return f"{same}, {links} of the digest chain"


def forks(
    campaign: CampaignId = None,
    sample: Sample = 200,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say of the takeovers of a campaign whether each was needed, done, late or missed.

    Every run is forked with the other decision: a takeover with the default channel going on, a
    run without one with another channel from its fault on, or from the start. The forks are stored
    and count in no campaign. A run violates if the ego touches something or leaves the road.
    """
    from adeye.campaign.takeovers import look_back

    with watching(quiet=quiet) as report:
        found = look_back(db, campaign, most=sample or None, report=report)
    if json:
        shares = {"precision": found.precision, "recall": found.recall}
        emit_json("forks", plain(found) | {name: list(pair) for name, pair in shares.items()})
        return
    _print_matrix(found)


def _share(pair: tuple[int, int]) -> str:
    return f"{pair[0]} of {pair[1]}"


def _print_matrix(found: TakeoverMatrix) -> None:
    counts = found.counts
    emit(
        f"Campaign {short(found.campaign)}: {found.looked_at} of {found.executed} runs forked"
        + (f", {found.without_choice} without a second channel" if found.without_choice else "")
    )
    rows: list[list[object]] = [
        ["takeover", counts["needed_and_done"], counts["late"], counts["spurious"]],
        ["no takeover", "", counts["missed"], counts["not_needed"]],
    ]
    headers = ("", "Needed and done", "Needed, but late or missed", "Not needed")
    emit_table(headers, rows, right=headers[1:])
    emit(
        f"Of the missed, {found.avoidable} would have been avoided by a takeover; of the takeovers "
        f"that were not needed, {found.harmful} violate."
    )
    emit(
        f"Precision: {_share(found.precision)} takeovers were needed. "
        f"Recall: {_share(found.recall)} runs that needed one had it in time."
    )
    lines = [line for line in found.lines if line.class_ not in {"not_needed", "needed_and_done"}]
    if lines:
        emit("")
        emit_table(
            ("Class", "Run", "Fork", "Scenario", "Architecture", "Fault entry", "Takeover [s]"),
            [
                [
                    clean(line.class_),
                    short(line.run),
                    short(line.fork),
                    line.scenario,
                    line.architecture,
                    line.fault_entry,
                    line.takeover_s,
                ]
                for line in lines[:SHOWN]
            ],
        )
    if len(lines) > SHOWN:
        emit(f"and {len(lines) - SHOWN} more; --json lists all.")
