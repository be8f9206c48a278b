"""Run the masters and their twins, and count what was detected."""

from __future__ import annotations

import logging
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from adeye.campaign.parts import use_plugin_metrics
from adeye.errors import AdeyeError, code_of, require_known
from adeye.judge.statistics import clopper_pearson
from adeye.report.credibility import SelfTestResult
from adeye.selftest.bench import GROUPS, Bench, Master, Seen, is_good
from adeye.selftest.inputs import FILES, METRICS, THRESHOLDS
from adeye.selftest.runs import CHANNELS, DATABASE, MONITORS, REPORT, SENSORS, SWITCHES
from adeye.simulate.engine import NUMERICS_VERSION
from adeye.supervision import is_asked
from adeye.version import __version__

MASTERS: Final[tuple[Master, ...]] = (
    *(*CHANNELS, *SENSORS, *SWITCHES, *MONITORS),
    *(*THRESHOLDS, *FILES, *METRICS, *DATABASE, *REPORT),
)
"""Every master, by group."""
CONFIDENCE: Final = 0.95


@dataclass(frozen=True, slots=True)
class Examined:
    """A master and what came of it.

    Attributes:
        master: The master.
        seen: What the production path made of the defect.
        twin: What it made of the good twin.
    """

    master: Master
    seen: Seen
    twin: Seen

    @property
    def is_detected(self) -> bool:
        """Whether the defect showed in the way that it must."""
        return self.master.is_detected(self.seen)

    @property
    def is_twin_good(self) -> bool:
        """Whether the good twin was taken for good."""
        return is_good(self.twin)


def choose(names: Sequence[str] = (), *, quick: bool = False) -> tuple[Master, ...]:
    """Choose masters.

    Args:
        names: Those of these names; none for all.
        quick: The first of each group only.

    Raises:
        UsageError: There is no such master.
    """
    known = {master.name: master for master in MASTERS}
    require_known(names, known, lambda name: f"there is no master {name!r}")
    chosen = [known[name] for name in dict.fromkeys(names)] or list(MASTERS)
    if quick:
        chosen = [
            next(master for master in chosen if master.group == group)
            for group in GROUPS
            if any(master.group == group for master in chosen)
        ]
    return tuple(chosen)


def examine(
    masters: Sequence[Master], tell: Callable[[int], None] = lambda _: None
) -> tuple[Examined, ...]:
    """Take masters and twins through the production path, in a folder that is deleted.

    Args:
        masters: Which.
        tell: Called with the number of those that are done.
    """
    found = []
    with tempfile.TemporaryDirectory(prefix="adeye-selftest-") as folder, _quiet():
        bench = Bench(Path(folder))
        for place, master in enumerate(masters):
            tell(place)
            found.append(Examined(master, _look(master.examine, bench), _look(master.twin, bench)))
        tell(len(masters))
        # The plug-in metrics of the bench are no metrics of whatever comes next.
        use_plugin_metrics((), Path(folder))
    return tuple(found)


def _look(look: Callable[[Bench], Seen], bench: Bench) -> Seen:
    """Whatever goes wrong with a master is not its detection."""
    try:
        return look(bench)
    except AdeyeError as error:
        return Seen(code_of(error), str(error))
    except BaseException as error:
        if is_asked(error):
            raise
        return Seen(-1, f"{type(error).__name__}: {error}")


@contextmanager
def _quiet() -> Iterator[None]:
    """Let what fails on purpose say nothing in the log."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def conclude(
    examined: Sequence[Examined], clock: Callable[[], datetime] = lambda: datetime.now(UTC)
) -> SelfTestResult:
    """Count what was detected.

    The interval is exact for masters drawn at random. They are chosen: it speaks of masters of this
    kind, by assumption, and of no other defects.
    """
    undetected = tuple(item.master.name for item in examined if not item.is_detected)
    detected = len(examined) - len(undetected)
    return SelfTestResult(
        version=__version__,
        numerics_version=NUMERICS_VERSION,
        created=clock().strftime("%Y-%m-%dT%H:%M:%S"),
        masters=len(examined),
        detected=detected,
        low=clopper_pearson(detected, len(examined), CONFIDENCE).low,
        confidence=CONFIDENCE,
        undetected=undetected,
        rejected_twins=tuple(item.master.name for item in examined if not item.is_twin_good),
    )
