"""Compile what a plan needs before it is needed: one test case of each structure, nothing kept."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from adeye.campaign.runner import Progress
from adeye.campaign.work import BatchTask, execute
from adeye.errors import PlatformError

if TYPE_CHECKING:
    from collections.abc import Callable

    from adeye.campaign.plan import CampaignPlan


def warm_up(plan: CampaignPlan, progress: Callable[[Progress], None] | None = None) -> float:
    """Execute and judge one test case of each structure of a plan, and throw the results away.

    Args:
        plan: A checked plan.
        progress: Called before each structure.

    Returns:
        How long it took [s].

    Raises:
        PlatformError: A test case could not be executed.
    """
    began = time.monotonic()
    examples = plan.examples()
    for number, case in enumerate(examples):
        if progress is not None:
            progress(Progress("compile", number, len(examples), 0))
        result = execute(BatchTask(0, (case,), (), plan.work))
        if result.failure:
            raise PlatformError(
                f"{case.scenario_id} with {case.architecture.architecture}: {result.failure}"
            )
    return time.monotonic() - began
