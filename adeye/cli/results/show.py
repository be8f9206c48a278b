"""``show`` and ``replay``: one run, as it is stored and as it comes out again."""

from __future__ import annotations

from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryFile
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, BinaryIO, Final, cast

import typer

from adeye.cli.options import Db, Json, named, named_page, named_place, option
from adeye.cli.output import (
    clean,
    emit,
    emit_fields,
    emit_found,
    emit_prose,
    emit_value,
    listed,
    short,
    verdict_cell,
    wrote,
)
from adeye.cli.results.runs import LastFailed, RunName, Worst, run_called
from adeye.errors import IntegrityError, UsageError
from adeye.judge.verdict import ExitCode
from adeye.outputs import write_atomically
from adeye.units import Dimension, parse_quantity

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from adeye.campaign.replay import Dump, Replayed
    from adeye.trace import Album, Trace

_SECTIONS: Final = ("parameters", "swept_paths", "metrics", "verdicts", "events")
_COMMAND: Final = "command"
_SAID: Final = (
    _COMMAND, "outcome", "end_reason", "duration_s", "scenario", "architecture", "fault_entry",
)  # fmt: skip
"""What the first lines about a run say."""
_BAD: Final = ("FAIL", "ERROR", "INVALID")
"""Verdicts that are told with their reason."""


def show(
    run: RunName = None,
    *,
    worst: Worst = None,
    last_failed: LastFailed = False,
    all_: Annotated[bool, option("--all -a")] = False,
    db: Db = None,
    json: Json = False,
) -> None:
    """Show a run as it is stored: outcome, what failed and why, parameters, events.

    RUN is any unique beginning of the run's digest, as the verdict table and the report print it.

    Parameters:
        all_: Also every verdict with its margin, metrics, and ids.

    Examples:
        adeye show 3f2a91c04b
        adeye show --worst FSR-02 --all
        adeye show 3f2a --json
    """
    from adeye.answers import describe_run

    called = run_called(db, run, worst, last_failed=last_failed)
    print_run = partial(_print_run, is_whole=all_)
    emit_found("show", describe_run(db, called), print_run, json=json)


def _print_run(description: Mapping[str, Any], *, is_whole: bool) -> None:
    """Print what one wants to know first; the rest on demand."""
    emit_fields(_head(description))
    verdicts = description.get("verdicts", ())
    for item in verdicts:
        if item["verdict"] in _BAD:
            _print_failing(item)
    _print_other_verdicts(verdicts)
    for name in ("parameters", "swept_paths", "events"):
        emit_value(_titled(name), description.get(name))
    if is_whole:
        for name in ("verdicts", "metrics"):
            emit_value(_titled(name), description.get(name))
        ids = {
            name: value
            for name, value in description.items()
            if name not in {*_SECTIONS, *_SAID} and not isinstance(value, dict | list | tuple)
        }
        emit_value("Ids", ids)
    if _COMMAND in description:
        if not is_whole:
            emit("\nAll verdicts, metrics and ids:  add --all")
        emit(f"\nReproduce it:  {clean(description[_COMMAND])}")


def _titled(name: str) -> str:
    return name.capitalize().replace("_", " ")


def _head(description: Mapping[str, Any]) -> dict[str, object]:
    """Give the run in a few lines: what it was, and how it ended."""
    told = {name: value for name, value in description.items() if value not in (None, "")}
    outcome = told.get("outcome")
    if outcome is not None and "duration_s" in told:
        outcome = f"{outcome}, ended by {told.get('end_reason')} at {told['duration_s']:g} s"
    broken = (told.get("outcome_channel"), told.get("outcome_detail"))
    return {
        "Run": short(told["run"]),
        "Outcome": ": ".join(str(part) for part in (outcome, *broken) if part is not None),
        "Scenario": told.get("scenario"),
        "Architecture": told.get("architecture"),
        "Fault entry": told.get("fault_entry"),
        "Fork of": short(told["fork_of"]) if "fork_of" in told else None,
        "Note": "it depends on the machine" if told.get("machine_dependent") else None,
        "Not certified": f"adeye certify executed it again on {told['not_certified']}, and it came "
        "out otherwise"
        if "not_certified" in told
        else None,
        "Executed": None if told.get("is_done", True) else "not yet",
    }


def _print_failing(item: Mapping[str, Any]) -> None:
    """Print an FSR that did not hold: what was asked for, and where that was missed."""
    from adeye.judge.verdict import Verdict
    from adeye.report.words import binding_sentence

    reason = item.get("detail") or ""
    why = reason or "nothing says why"
    if item.get("predicate") is not None:
        names = ("predicate", "time_s", "actor", "value", "threshold")
        told: dict[str, Any] = {name: item.get(name) for name in names}
        told |= {name: item.get(name) or "" for name in ("signal", "unit")}
        # As a ``report.model.part.Binding`` has it: what the database tells needs no check.
        binding: Any = SimpleNamespace(**told, difference=item.get("margin"), note=reason)
        why = binding_sentence(binding)
    emit("")
    sign = verdict_cell(Verdict(item["verdict"])).plain
    emit_prose(f"{sign} {clean(item['fsr'])}  {clean(item.get('measure', ''))}".rstrip())
    emit_prose(f"  {clean(why)}")


def _print_other_verdicts(verdicts: Sequence[Mapping[str, Any]]) -> None:
    others: dict[str, list[str]] = {}
    for item in verdicts:
        if item["verdict"] not in _BAD:
            others.setdefault(item["verdict"], []).append(item["fsr"])
    has_bad = sum(map(len, others.values())) < len(verdicts)
    title = "Other verdicts" if has_bad else "Verdicts"
    emit_value(title, {name: listed(fsrs) for name, fsrs in others.items()})


def replay(
    run: RunName = None,
    *,
    worst: Worst = None,
    last_failed: LastFailed = False,
    db: Db = None,
    html: Annotated[Path | None, option("FILE", callback=named_page)] = None,
    channel: Annotated[str | None, option("ID")] = None,
    dump: Annotated[Path | None, option("FILE", callback=named)] = None,
    grid: Annotated[str | None, option("TIME")] = None,
    cells: Annotated[str | None, option("FILE|adeye")] = None,
    mcap: Annotated[Path | None, option("FILE", env="REPLAY_MCAP", callback=named)] = None,
    osi: Annotated[Path | None, option("DIR", env="REPLAY_OSI", callback=named_place)] = None,
    commonroad: Annotated[Path | None, option("DIR", callback=named_place)] = None,
    rosbag: Annotated[Path | None, option("PATH", callback=named_place)] = None,
    json: Json = False,
) -> None:
    """Execute a stored run again and compare the digest of its trace.

    With --channel and --dump it saves what that channel is shown, which feeds it again without the
    simulator: `./program < FILE`, or `adeye.testing.feed`.

    With --grid and --dump it saves the grid map around the ego at a time, layer by layer, as a
    NumPy archive: with what is true, or with --channel what that channel believes.

    With --mcap, --osi, --commonroad and --rosbag it writes the run for viewers and tools of others.

    Exit codes: 0 identical, 4 the trace differs, or with --html the evidence is not as it was
    written.

    Parameters:
        html: Write the run as an HTML page with its replay.
        channel: Channel whose observations are saved, or with --grid whose view; needs --dump or
            --rosbag.
        dump: Save what the channel is shown, as lines of JSON; with --grid, the grid map.
        grid: Time, such as '4.2 s', of the grid map to save; needs --dump.
        cells: Window, cells and costs of the grid map: a YAML file, or the costs of AD-EYE; by
            default the ratings of the safety channel.
        mcap: Write the run for Foxglove and Lichtblick; needs adeye[viz].
        osi: Folder for traces of ASAM OSI, in single files and in MCAP; needs adeye[osi].
        commonroad: Folder for the run as a scenario of CommonRoad, and what the ego drove as its
            solution.
        rosbag: Write what the default channel is shown, or --channel: a folder for a bag of ROS 2,
            a file in .bag for one of ROS 1; needs adeye[viz].

    Examples:
        adeye replay 3f2a91c04b
        adeye replay --last-failed --html replay.html
        adeye replay 3f2a91c04b --grid '4.2 s' --dump grid.npz
        adeye replay 3f2a91c04b --mcap run.mcap
    """
    from adeye.campaign.replay import replay_run

    called = run_called(db, run, worst, last_failed=last_failed)
    look = None if grid is None else _grid_saver(grid, cells, channel, dump)
    shown = _shown(channel, dump, cells, is_grid=grid is not None, is_bag=rosbag is not None)
    handed = {"mcap": mcap, "osi": osi, "commonroad": commonroad, "rosbag": rosbag}
    album: Album | None = None
    hand_out = None
    with _opened(shown) as taken:
        if any(path is not None for path in handed.values()):
            from adeye.reporting import handing_out

            album = {} if mcap is not None else None
            hand_out = handing_out(**handed, shown=taken, album=album)
        again = replay_run(db, called, shown, look, album, hand_out)
    emit_found("replay", again, _print, json=json)
    written = None
    if html is not None:
        from adeye.reporting import write_replay

        written = write_replay(db, called, html)
        wrote(html)
    for path in (dump, *handed.values()):
        if path is not None:
            wrote(path)
    if not again.identical:
        raise typer.Exit(ExitCode.INTEGRITY)
    if written is not None and written.exit_code is ExitCode.INTEGRITY:
        raise IntegrityError(written.message)


def _shown(
    channel: str | None, dump: Path | None, cells: str | None, *, is_grid: bool, is_bag: bool
) -> Dump | None:
    """Give the channel whose observations are saved, and where."""
    if is_bag and (is_grid or dump is not None):
        raise UsageError(
            "--rosbag stands beside neither --grid nor --dump", remedy="Replay the run twice."
        )
    if is_grid:
        return None
    if cells is not None:
        raise UsageError("--cells belongs to --grid", remedy="Give --grid TIME --dump FILE, too.")
    if is_bag:
        return channel, cast("BinaryIO", TemporaryFile())
    if channel is None and dump is None:
        return None
    if channel is None or dump is None:
        raise UsageError(
            "--channel and --dump belong together",
            remedy="Give --channel ID --dump FILE, --grid TIME --dump FILE, or neither.",
        )
    return channel, dump


@contextmanager
def _opened(shown: Dump | None) -> Iterator[BinaryIO | None]:
    """Close at the end what was opened for a bag."""
    if shown is None or isinstance(shown[1], Path):
        yield None
        return
    with shown[1] as stream:
        yield stream


def _grid_saver(
    time: str, cells: str | None, channel: str | None, dump: Path | None
) -> Callable[[Trace], None]:
    """Give what saves the grid map of a trace; everything that was given is checked before."""
    from adeye.judge.grid import TRUTH, grid_map
    from adeye.spec.grid import ADEYE_COSTS, GridSettings
    from adeye.spec.load import load_grid

    if dump is None:
        raise UsageError("--grid needs --dump", remedy="Give --grid TIME --dump FILE.")
    at = parse_quantity(time, Dimension.TIME)
    if cells is None:
        settings = GridSettings()
    elif cells == "adeye":
        settings = GridSettings(costs=ADEYE_COSTS)
    else:
        settings = load_grid(cells).spec

    def save(trace: Trace) -> None:
        found = grid_map(trace, 0, at, settings, view=channel or TRUTH)
        write_atomically(found.archive(), dump)

    return save


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
        cause = f"; {why}" if (why := again.note or again.cause) else ""
        emit(clean(f"\nDIFFERENT: the trace does not have the stored digest{cause}.", lines=True))
        if again.same_ticks is not None:
            emit(f"The first {again.same_ticks} ticks are as recorded.")
