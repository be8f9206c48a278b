"""Hold executions against what is stored: which runs differ, in what, and from when on."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.campaign.reproduce import same_ticks
from adeye.evaluation.judgement import MARGIN, VERDICTS
from adeye.evaluation.metrics.registry import STATUSES
from adeye.evaluation.outcome import OUTCOMES
from adeye.store.rows import MetricValue

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.store.block import MetricBlock, RunBlock
    from adeye.store.stored import RunRef, StoredRun
    from adeye.sweep.case import TestCase

TRACE: Final = "trace"
_LINK: Final = 32
"""Characters of a link of the digest chain."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A run that does not come out as it is stored.

    Attributes:
        run: Result digest.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        conditions: Under which it differs.
        differs: What differs: ``trace``, ``outcome``, ids of metrics, and of FSRs by their verdict.
        first_tick: Ticks that are as stored before the first that is known to differ, in steps of
            ``LINK_TICKS``; None where the trace does not differ or no chain is stored.
        traces: Different traces that it had, the stored one among them.
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    conditions: tuple[str, ...]
    differs: tuple[str, ...]
    first_tick: int | None
    traces: int


@dataclass(frozen=True)
class Sampled:
    """A run of the sample, with what of it is compared."""

    run: RunRef
    fault_entry: str
    case: TestCase
    stored: StoredRun
    is_portable: bool


@dataclass
class _Difference:
    """What was seen of a run that differs."""

    conditions: list[str] = field(default_factory=list)
    differs: dict[str, None] = field(default_factory=dict)
    ticks: list[int] = field(default_factory=list)
    traces: set[str] = field(default_factory=set)


class Compared:
    """Holds executions against what is stored."""

    def __init__(self, runs: Sequence[Sampled]) -> None:
        self._runs = {run.case.digest: run for run in runs}
        self._found: dict[str, _Difference] = defaultdict(_Difference)

    def add(self, condition: str, block: RunBlock) -> int:
        """Compare a batch; return how many of its runs count."""
        counted = 0
        dependent = block.machine_dependent.tolist()
        for place, digest in enumerate(block.test_cases):
            if dependent[place]:
                continue
            counted += 1
            self._compare(condition, self._runs[digest], block, place)
        return counted

    def findings(self) -> tuple[Finding, ...]:
        """List the runs that differ, in the order of the sample."""
        return tuple(
            Finding(
                run=run.run.result_digest,
                scenario=run.run.scenario,
                architecture=run.run.architecture,
                fault_entry=run.fault_entry,
                conditions=tuple(seen.conditions),
                differs=tuple(seen.differs),
                first_tick=min(seen.ticks, default=None),
                traces=len({*seen.traces, run.stored.trace_digest}),
            )
            for digest, run in self._runs.items()
            if (seen := self._found.get(digest)) is not None
        )

    def _compare(self, condition: str, run: Sampled, block: RunBlock, place: int) -> None:
        trace = block.trace_digests[place]
        differs = [TRACE] if trace != run.stored.trace_digest else []
        if OUTCOMES[int(block.outcome[place])].value != run.stored.row["outcome"]:
            differs.append("outcome")
        differs += _other_metrics(run.stored, block, place)
        differs += _other_verdicts(run.stored, block, place)
        if not differs:
            return
        seen = self._found[run.case.digest]
        seen.conditions.append(condition)
        seen.differs |= dict.fromkeys(differs)
        seen.traces.add(trace)
        ticks = same_ticks(run.stored, _links(block, place)) if TRACE in differs else None
        if ticks is not None:
            seen.ticks.append(ticks)


def _links(block: RunBlock, place: int) -> tuple[str, ...]:
    text = block.chains[place] if block.chains else ""
    return tuple(text[first : first + _LINK] for first in range(0, len(text), _LINK))


def _other_metrics(stored: StoredRun, block: RunBlock, place: int) -> list[str]:
    """Name the metrics that are not as stored; a result of an older release lacks later ones."""
    known: dict[str, list[MetricValue]] = defaultdict(list)
    for values in (stored.metrics, *stored.plugin_metrics.values()):
        for name, value in values.items():
            known[name].append(value)
    found = _values(block.metrics, place)
    for plugin in block.plugin_metrics:
        row = int(np.searchsorted(plugin.run, place))
        if row < len(plugin.run) and plugin.run[row] == place:
            found |= _values(plugin.metrics, row)
    return [name for name, value in found.items() if known[name] and value not in known[name]]


def _other_verdicts(stored: StoredRun, block: RunBlock, place: int) -> list[str]:
    """Name the FSRs whose verdict or margin is not as stored, of those that are stored."""
    known = {item.fsr_digest: (item.verdict, item.margin) for item in stored.verdicts}
    found = block.verdicts.take(np.flatnonzero(block.verdicts.run == place))
    margins = [_number(value) for value in found.numbers[:, MARGIN]]
    now = zip((VERDICTS[code] for code in found.verdict), margins, strict=True)
    return [
        str(fsr)
        for fsr, digest, item in zip(
            found.fsr_id.values(), found.fsr_digest.values(), now, strict=True
        )
        if known.get(str(digest), item) != item
    ]


def _values(metrics: MetricBlock, row: int) -> dict[str, MetricValue]:
    return {
        name: MetricValue(
            _number(metrics.value[row, place]),
            STATUSES[int(metrics.status[row, place])],
            _number(metrics.time_s[row, place]),
            metrics.actors.words[int(metrics.actor[row, place])],
        )
        for place, name in enumerate(metrics.ids)
    }


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
