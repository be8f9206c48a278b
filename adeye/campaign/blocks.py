"""How many test cases are executed together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adeye.channels.factory import PROCESS
from adeye.channels.process import MOST_PROGRAMS
from adeye.recorder import trace_bytes
from adeye.sensors.lidar import sample_bytes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.campaign.plan import CampaignPlan
    from adeye.spec.architecture import Architecture
    from adeye.sweep.case import TestCase

SMALLEST_BLOCK, LARGEST_BLOCK = 16, 1_024
BLOCKS = 16
"""Blocks that a plan is cut into, if they become neither too small nor too large."""
TRACE_MEMORY = 192 * 2**20
"""Memory for the traces of one block [bytes]: two of them at once leave room below one gigabyte."""


def block_size(plan: CampaignPlan) -> int:
    """Choose how many test cases a block has at most.

    A small plan has small blocks, so that a kill costs little and every worker has something to
    do; a large one has large blocks, over which compiled code and inserts cost least, as far as
    their traces and the returns of their lidars fit into memory.
    """
    return _block_size(plan.expansion.count, fitting(plan.examples()))


def fitting(examples: Sequence[TestCase]) -> int:
    """Count the runs that fit into memory together, and whose programs may run at once."""
    largest = max(trace_bytes(case) + sample_bytes(case.architecture) for case in examples)
    most = TRACE_MEMORY // largest
    programs = max(_programs(case.architecture) for case in examples)
    return min(most, max(1, MOST_PROGRAMS // programs)) if programs else most


def _programs(architecture: Architecture) -> int:
    """Count the channels that have a program of their own in each run."""
    return sum(channel.kind == PROCESS for channel in architecture.channels.values())


def _block_size(planned: int, most: int) -> int:
    """Choose the size for some planned test cases of which some fit into memory together.

    >>> [_block_size(planned, 2_000) for planned in (28, 1_000, 8_000, 65_536, 1_000_000)]
    [16, 62, 500, 1024, 1024]
    >>> _block_size(1_000_000, 640)
    640
    """
    wanted = min(max(planned // BLOCKS, SMALLEST_BLOCK), LARGEST_BLOCK)
    return max(1, min(wanted, most))
