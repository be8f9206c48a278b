"""Options of ``run`` that tell how much of a campaign is executed now, and what ends it."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Annotated, Final

import typer

if TYPE_CHECKING:
    from adeye.campaign.session import Session

ShardOption = Annotated[
    str | None,
    typer.Option(
        "--shard",
        metavar="I/N",
        envvar="ADEYE_SHARD",
        help="Execute the I-th of N parts of the blocks, such as 2/3, the same on every machine; "
        "'adeye db merge' brings the databases of the shards together.",
    ),
]
KeywordOption = Annotated[
    str | None,
    typer.Option(
        "-k",
        metavar="EXPR",
        envvar="ADEYE_K",
        help="Execute only test cases whose scenario, architecture, fault or parameters have these "
        "words, such as 'cut_in and not (legacy or gap=30)'; name=value is exact.",
    ),
]
LastFailed = Annotated[
    bool,
    typer.Option(
        "--last-failed",
        "--lf",
        envvar="ADEYE_LAST_FAILED",
        help="Execute only test cases that failed a mandatory FSR the last time, in this campaign "
        "or the ones before it, and those that never had a result.",
    ),
]
Maxfail = Annotated[
    int | None,
    typer.Option(
        "--maxfail",
        min=1,
        metavar="N",
        envvar="ADEYE_MAXFAIL",
        help="Begin no further block after N runs with a FAIL or an ERROR.",
    ),
]
Budget = Annotated[
    str | None,
    typer.Option(
        "--budget",
        metavar="TIME",
        envvar="ADEYE_BUDGET",
        help="Begin no block that would not end in this time, such as 8h or 1h30m, judged by the "
        "blocks before it; the same command goes on later.",
    ),
]
Deadline = Annotated[
    str | None,
    typer.Option(
        "--deadline",
        metavar="TIME",
        envvar="ADEYE_DEADLINE",
        help="Kill a worker process that takes longer than this for one block, and try the block "
        "again; default: 1h. Threads cannot be killed.",
    ),
]

_SECONDS: Final = {"d": 86_400.0, "h": 3_600.0, "m": 60.0, "min": 60.0, "s": 1.0}
_PART: Final = re.compile(r"\s*([0-9]{1,9}(?:\.[0-9]{1,9})?)\s*(d|h|min|m|s)(?![a-z])")


def seconds(text: str, option: str) -> float:
    """Read a time of day's length, such as ``8h``, ``1h30m``, ``90 min`` or ``30s``.

    Args:
        text: As written.
        option: Which option it is of, for the message.

    Returns:
        The time [s], more than 0.

    Raises:
        UsageError: It is no such time.

    >>> seconds("1h30m", "--budget"), seconds("0.5 min", "--budget")
    (5400.0, 30.0)
    """
    from adeye.errors import UsageError

    rest, found = text.strip(), 0.0
    while (part := _PART.match(rest)) is not None:
        found += float(part[1]) * _SECONDS[part[2]]
        rest = rest[part.end() :]
        if rest[:1].isdigit() or not rest:
            continue
        rest = rest.lstrip()
    if rest or found <= 0.0:
        raise UsageError(
            f"{option} is {text!r}",
            remedy="Write a time with its unit, such as 8h, 90m, 30s or 1h30m.",
        )
    return found


def make_session(
    *,
    shard: str | None,
    keyword: str | None,
    last_failed: bool,
    maxfail: int | None,
    budget: str | None,
    deadline: str | None,
) -> Session:
    """Read the options; the time of the budget begins now.

    Raises:
        UsageError: One of them cannot be read.
    """
    from adeye.campaign.choosing import Choice, Shard
    from adeye.campaign.keyword import Keyword
    from adeye.campaign.session import DEADLINE_S, Session
    from adeye.campaign.stopping import Limits

    return Session(
        choice=Choice(
            shard=None if shard is None else Shard.parse(shard),
            keyword=None if keyword is None else Keyword.parse(keyword),
            last_failed=last_failed,
        ),
        limits=Limits(
            budget_s=math.inf if budget is None else seconds(budget, "--budget"),
            most_failures=maxfail,
        ),
        deadline_s=DEADLINE_S if deadline is None else seconds(deadline, "--deadline"),
    )
