"""``fork|forks|timeline|faults``: runs with another decision; what followed their faults."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Annotated, Final

from adeye.cli import output as out
from adeye.cli.options import CampaignId, Db, Json, Quiet, RunId, option
from adeye.cli.progress import watching
from adeye.cli.results.runs import LastFailed, RunName, Worst, run_called
from adeye.errors import amount

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from adeye.campaign.studies.fault_timing import InjectionTable
    from adeye.campaign.studies.forks import Forked, TakeoverMatrix
    from adeye.judge.timeline import Injection, InjectionCount
    from adeye.report.model.assessment import Rate, TradePoint

# --- ``fork`` and ``forks``: a run with another decision, and the takeovers of a campaign ---------

SHOWN: Final = 20
"""Runs that are listed; JSON has all."""


Sample = Annotated[
    int,
    option(
        "N",
        help="Look at so many runs of the campaign, with and without faults, the same every "
        "time; 0 for all.",
        min=0,
    ),
]


def fork(
    run: RunId,
    start: Annotated[str, option("--from TICK|TIME")],
    authority: Annotated[str, option("CHANNEL")],
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Execute a stored run again with another authority from a tick on.

    The fork runs from the start. Before the tick it must be the stored run bit for bit, else
    nothing is kept. It is stored as a run of its own, which no campaign counts.

    Exit codes: 0 done, 4 the run or the beginning of its fork is not as it was recorded.

    Parameters:
        start: Tick, such as 40, or time, such as '2 s', from which the authority is another.
        authority: The channel that acts from there on, whatever the switch decides.

    Examples:
        adeye fork 3f2a91c04b --from '2 s' --authority safety
        adeye fork 3f2a --from 0 --authority nominal --json
    """
    from adeye.campaign.replay import failures_beside
    from adeye.campaign.studies.forks import fork_run

    with watching(quiet=quiet) as report:
        forked = fork_run(db, run, start=start, authority=authority, report=report)
    _tell(failures_beside([forked.failed], "the fork"))
    out.emit_found("fork", forked, _print_fork, json=json)


def _tell(failed: Iterable[str]) -> None:
    for text in failed:
        out.talk(out.clean(f"note: {text}"))


def _print_fork(forked: Forked) -> None:
    origin, other = forked.origin, forked.fork
    out.emit_fields(
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
    out.emit("")
    out.emit_table(("", "Run", "Fork"), rows)
    if forked.is_same:
        out.emit("\nThe fork is the run itself, bit for bit: the switch decides so as well.")


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
    links = amount(forked.links, "link")
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

    Exit codes: 0 done, 3 there is no run to look at, 4 a run is not as it was recorded.

    Examples:
        adeye forks
        adeye forks 3 --sample 50 --json
    """
    from adeye.campaign.studies.forks import look_back

    with watching(quiet=quiet) as report:
        found = look_back(db, campaign, most=sample or None, report=report)
    _tell(found.failed)
    shares = {"precision": list(found.precision), "recall": list(found.recall)}
    out.emit_found(
        "forks",
        found,
        _print_matrix,
        json=json,
        document=lambda found: out.plain(found) | shares,
        looked_at=found.looked_at,
    )


def _share(pair: tuple[int, int]) -> str:
    return f"{pair[0]} of {pair[1]}"


def _print_matrix(found: TakeoverMatrix) -> None:
    counts = found.counts
    out.emit(
        f"Campaign {out.short(found.campaign)}: {found.looked_at} of {found.executed} runs forked"
        + (f", {found.without_choice} without a second channel" if found.without_choice else "")
    )
    rows: list[list[object]] = [
        ["takeover", counts["needed_and_done"], counts["late"], counts["spurious"]],
        ["no takeover", "", counts["missed"], counts["not_needed"]],
    ]
    headers = ("", "Needed and done", "Needed, but late or missed", "Not needed")
    out.emit_table(headers, rows, right=headers[1:])
    out.emit(
        f"Of the missed, {found.avoidable} would have been avoided by a takeover; of the takeovers "
        f"that were not needed, {found.harmful} violate."
    )
    out.emit(
        f"Precision: {_share(found.precision)} takeovers were needed. "
        f"Recall: {_share(found.recall)} runs that needed one had it in time."
    )
    lines = [line for line in found.lines if line.class_ not in {"not_needed", "needed_and_done"}]
    if lines:
        out.emit("")
        out.emit_records(
            lines[:SHOWN],
            {
                "Class": "class_",
                "Run": lambda line: out.short(line.run),
                "Fork": lambda line: out.short(line.fork),
                "Scenario": "scenario",
                "Architecture": "architecture",
                "Fault entry": "fault_entry",
                "Takeover [s]": "takeover_s",
            },
        )
    if len(lines) > SHOWN:
        out.emit(f"and {len(lines) - SHOWN} more; --json lists all.")


# --- ``timeline`` and ``faults``: what follows a fault, in one run and over a campaign ------------

_CLASSES: Final = ("not activated", "masked", "in time", "late", "undetected", "violating")
"""In the order in which they are counted."""

_MOMENTS: Final = {
    "fault": "fault_s",
    "effect": "effect_s",
    "deviation of the ego": "deviation_s",
    "detection": "detect_s",
    "switch": "switch_s",
    "brake": "brake_s",
    "emergency operation": "emergency_s",
    "safe state": "safe_s",
    "violation": "violation_s",
}
"""What follows a fault, by the name of its time."""

_WIDE: Final = 160


def timeline(
    run: RunName = None,
    *,
    worst: Worst = None,
    last_failed: LastFailed = False,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show what follows the fault of a run: times, intervals, and the FTTI that was measured.

    The run is executed again beside its fault-free twin, and beside its twin in which the default
    channel acts throughout: the time from the fault to that twin's violation is the FTTI. A
    violation is a contact, or leaving the road.

    Exit codes: 0 done, 4 the run is not as it was recorded.

    Examples:
        adeye timeline 3f2a91c04b
        adeye timeline 3f2a --json
    """
    from adeye.campaign.replay import failures_beside
    from adeye.campaign.studies.fault_timing import run_timeline

    called = run_called(db, run, worst, last_failed=last_failed)
    with watching(quiet=quiet) as report:
        found = run_timeline(db, called, report)
    _tell(failures_beside([found.failed], "a twin"))
    out.emit_found("timeline", found, _print_timeline, json=json, document=document)


def document(found: Injection) -> dict[str, object]:
    """Give an injection with what is derived from its times."""
    return {
        **out.plain(found),
        **out.fields_of(found.times, "fdti_s", "frti_s", "fhti_s", "emergency_operation_s"),
        **out.fields_of(found, "ftti_s", "margin_s"),
    }


def _print_timeline(found: Injection) -> None:
    out.emit_fields(
        {
            "Run": found.run,
            "Scenario": found.scenario,
            "Architecture": found.architecture,
            "Fault entry": found.fault_entry,
            "Class": found.class_,
        }
    )
    out.emit("")
    times = found.times
    rows = [[what, _time(getattr(times, name))] for what, name in _MOMENTS.items()]
    out.emit_table(("Moment", "Time [s]"), rows, right=("Time [s]",))
    intervals = [
        ["FDTI", "fault to detection", _time(times.fdti_s)],
        ["FRTI", "detection to safe state or emergency operation", _time(times.frti_s)],
        ["FHTI", "fault to safe state or emergency operation", _time(times.fhti_s)],
        ["FTTI", "fault to violation without the mechanism", _time(found.ftti_s)],
        ["margin", "FTTI minus FHTI", _time(found.margin_s)],
        ["emergency operation", "until the safe state", _time(times.emergency_operation_s)],
    ]
    out.emit("")
    out.emit_table(("Interval", "From and to", "[s]"), intervals, right=("[s]",))
    if found.ftti_s is not None and found.fault_free_violation_s is not None:
        out.emit("\nWithout the mechanism the situation ends in a violation without the fault too.")


def _time(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f}"


def faults(
    campaign: CampaignId = None,
    sample: Sample = 200,
    by: Annotated[str | None, option("AXIS")] = None,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Count what became of the faults of a campaign, by scenario, fault entry and architecture.

    Not activated: the fault never changed a bit. Masked: the ego does the same as without. Late:
    not handled within the FTTI that was measured, or at all. The share that is detected has an
    interval only where the points of the scenario are a random sample. What is found is kept, and
    not executed again.

    Exit codes: 0 done, 3 no run has a fault, 4 a run is not as it was recorded.

    Parameters:
        by: Hold trips without a fault against detection with one, for each value of a swept axis,
            such as safety.parameters.confirm. Nothing is executed.

    Examples:
        adeye faults
        adeye faults 3 --sample 0 --json
        adeye faults --by safety.parameters.confirm
    """
    from adeye.campaign.studies.fault_timing import campaign_injections

    if by is not None:
        _trade(db, campaign, by, json=json)
        return
    with watching(quiet=quiet) as report:
        found = campaign_injections(db, campaign, most=sample or None, report=report)
    _tell(found.failed)
    count = found.looked_at
    out.emit_found("faults", found, _print_table, json=json, document=_table, looked_at=count)


def _table(found: InjectionTable) -> dict[str, object]:
    return {**out.plain(found), "injections": [document(item) for item in found.injections]}


def _print_table(found: InjectionTable) -> None:
    out.emit(f"Campaign {out.short(found.campaign)}: {amount(found.looked_at, 'run')} with faults")
    columns: dict[str, str | Callable[[InjectionCount], object]]
    columns = {"Scenario": "scenario", "Fault entry": "fault_entry", "Architecture": "architecture"}
    if out.width() < _WIDE:
        # Nine columns of numbers, most of them zero, would leave no table.
        columns["Classes"] = _classes
        texts = 4
    else:
        columns |= {name.capitalize(): partial(_count, at) for at, name in enumerate(_CLASSES)}
        texts = 3
    columns["Detected"] = _coverage
    columns["Least FTTI [s]"] = lambda row: _time(row.least_ftti_s)
    columns["Most FHTI [s]"] = lambda row: _time(row.most_fhti_s)
    out.emit_records(found.rows, columns, right=list(columns)[texts:])


def _count(at: int, row: InjectionCount) -> int:
    return list(row.counts.values())[at]


def _classes(row: InjectionCount) -> str:
    """Write the classes that there are with their counts."""
    counts = zip(row.counts.values(), _CLASSES, strict=True)
    return ", ".join(f"{count} {word}" for count, word in counts if count)


def _coverage(row: InjectionCount) -> str:
    share = f"{row.detected} of {row.activated}"
    if row.coverage is None:
        return share
    return f"{share} ({row.coverage.low:.1%} to {row.coverage.high:.1%})"


def _trade(db: str | None, campaign: str | None, axis: str, *, json: bool) -> None:
    from adeye.report.faults import trades_by

    found, curves = trades_by(db, campaign, axis)
    if json:
        out.emit_json("faults-trade", {"campaign": found, "curves": curves})
        return
    columns: dict[str, str | Callable[[TradePoint], object]] = {
        "Value": "value",
        "Trips": lambda point: point.calm.trips,
        "Driving [h]": lambda point: f"{point.calm.hours:.3f}",
        "Trips per hour": lambda point: _rate(point.calm),
        "Detected": lambda point: f"{point.detected} of {point.faulty}",
        "Median FDTI [s]": lambda point: _time(point.median_fdti_s),
        "Worst FDTI [s]": lambda point: _time(point.worst_fdti_s),
    }
    for curve in curves:
        out.emit(f"{curve.axis} of {curve.architecture} in {', '.join(curve.scenarios)}")
        out.emit_records(curve.points, columns, right=columns)


def _rate(rate: Rate) -> str:
    if rate.per_hour is None:
        return "none"
    text = f"{rate.per_hour:.1f}"
    return text if rate.low is None else f"{text} ({rate.low:.1f} to {rate.high:.1f})"
