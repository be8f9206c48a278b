"""What came out of a campaign, for people and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from adeye.cli.output import clean, emit
from adeye.cli.verdicts import ordered, print_verdicts

if TYPE_CHECKING:
    from adeye.campaign.summary import CampaignSummary

_WAYS: Final = {
    "metric": "metric rows",
    "samples": "kept extremes",
    "trace": "kept traces",
    "invalid": "being invalid",
    "verdict": "verdicts without numeric uncertainty",
}
"""What told a verdict, in words, by the word of ``campaign.rejudging``."""


def print_summary(summary: CampaignSummary) -> None:
    """Print the verdicts, what was executed, and what the exit code means."""
    print_verdicts(summary)
    emit(f"\n{executed_text(summary)}")
    emit(clean(summary.message, lines=True))


def executed_text(summary: CampaignSummary) -> str:
    """Say how much was executed and how much was there already."""
    again = f" {rejudged_text(summary)}" if summary.judged or summary.to_replay else ""
    if summary.planned > 0 and summary.executed == 0 and summary.reused == summary.planned:
        twins = f" but {summary.twins:,} twins with half the step" if summary.twins else ""
        nothing = "nothing new" if summary.replayed else "nothing"
        return f"Executed {nothing}{twins}, all {summary.planned:,} results were there.{again}"
    executed = f"Executed {summary.executed:,} of {summary.planned:,} test cases"
    twins = f" and {summary.twins:,} twins with half the step" if summary.twins else ""
    others = f"; {summary.elsewhere:,} by other runners" if summary.elsewhere else ""
    return f"{executed}{twins}{others}; {summary.reused:,} reused.{again}"


def rejudged_text(summary: CampaignSummary) -> str:
    """Say what results were judged again from."""
    wanted = summary.judged + summary.to_replay
    ways = ", ".join(
        f"{summary.ways[way]:,} from {text}" for way, text in _WAYS.items() if way in summary.ways
    )
    judged = f"Re-judged {summary.judged:,} of {wanted:,} results"
    return f"{judged}{f' ({ways})' if ways else ''}; {summary.replayed:,} executed again for it."


def document(summary: CampaignSummary) -> dict[str, object]:
    """Describe a campaign as JSON."""
    return {
        "campaign": summary.campaign,
        "planned": summary.planned,
        "executed": summary.executed,
        "judged": summary.judged,
        "reused": summary.reused,
        **({"executed_by_others": summary.elsewhere} if summary.elsewhere else {}),
        **({"twins": summary.twins} if summary.twins else {}),
        "selected": summary.planned if summary.selected is None else summary.selected,
        "remaining": summary.to_execute,
        "replayed": summary.replayed,
        "to_replay": summary.to_replay,
        "rejudged_from": dict(summary.ways),
        "exit_code": int(summary.exit_code),
        "message": summary.message,
        "contacts": dict(summary.contacts),
        "channel_failures": summary.channel_failures,
        "never_began": summary.never_began,
        "verdicts": ordered(summary.verdicts),
    }
