"""Executions held against what is stored: what differs is named, what is the machine's is not."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign.replay import recall
from adeye.campaign.studies.certify import Compared, Sampled
from adeye.campaign.work import BatchTask, execute
from adeye.judge.verdict import Verdict
from adeye.store.repository import Repository
from adeye.trace import LINK_TICKS

if TYPE_CHECKING:
    from adeye.store.block import RunBlock
    from tests.project import Executed


@pytest.fixture
def seen(mini: Executed) -> tuple[Sampled, RunBlock]:
    """A stored run, and what executing it again gives."""
    with Repository.open(mini.db) as repository:
        recalled = recall(repository, repository.find_run("0", campaign=mini.summary.campaign))
    case = recalled.case
    block = execute(BatchTask(0, (case,), (), mini.plan.work)).runs
    assert block is not None
    sampled = Sampled(recalled.run, case.fault_entry, case, recalled.stored, is_portable=True)
    return sampled, block


def compare(sampled: Sampled, block: RunBlock) -> Any:
    compared = Compared([sampled])
    assert compared.add("some", block) == 1
    return compared.findings()


def test_same_again_is_no_finding(seen: tuple[Sampled, RunBlock]) -> None:
    assert compare(*seen) == ()


def test_trace_metric_and_outcome_that_differ_are_named(seen: tuple[Sampled, RunBlock]) -> None:
    sampled, block = seen
    value = block.metrics.value.copy()
    place = block.metrics.ids.index("min_distance_m")
    value[0, place] += 1e-12
    other = replace(
        block,
        trace_digests=("0" * 32,),
        metrics=replace(block.metrics, value=value),
        outcome=block.outcome + 1,
    )
    (finding,) = compare(sampled, other)
    assert finding.differs == ("trace", "outcome", "min_distance_m")
    assert finding.conditions == ("some",)
    assert finding.traces == 2
    # Every link of the chain is as stored, so the end of the trace differs.
    assert finding.first_tick == sampled.stored.row["trace_rows"] // LINK_TICKS * LINK_TICKS


def test_first_link_that_differs_tells_the_ticks(seen: tuple[Sampled, RunBlock]) -> None:
    sampled, block = seen
    links = block.chains[0]
    assert len(links) >= 64, "the run has two links, else nothing is told here"
    broken = links[:32] + "f" * 32 + links[64:]
    other = replace(block, trace_digests=("0" * 32,), chains=(broken,))
    (finding,) = compare(sampled, other)
    assert finding.first_tick == 100


def test_metric_that_an_older_release_did_not_have_is_none_that_differs(
    seen: tuple[Sampled, RunBlock],
) -> None:
    sampled, block = seen
    fewer = {name: item for name, item in sampled.stored.metrics.items() if name != "contact"}
    older = replace(sampled, stored=replace(sampled.stored, metrics=fewer))
    assert compare(older, block) == ()


def test_run_that_a_deadline_ended_counts_as_nothing(seen: tuple[Sampled, RunBlock]) -> None:
    sampled, block = seen
    ended = replace(block, machine_dependent=np.array([True]), trace_digests=("0" * 32,))
    compared = Compared([sampled])
    assert compared.add("some", ended) == 0
    assert compared.findings() == ()


def test_verdict_that_differs_is_named_by_its_requirement(seen: tuple[Sampled, RunBlock]) -> None:
    sampled, block = seen
    first, *others = sampled.stored.verdicts
    other = Verdict.FAIL if first.verdict is Verdict.PASS else Verdict.PASS
    for forged in (replace(first, verdict=other), replace(first, margin=1234.5)):
        stored = replace(sampled.stored, verdicts=(forged, *others))
        (finding,) = compare(replace(sampled, stored=stored), block)
        assert finding.differs == (first.fsr_id,)
        assert finding.traces == 1


def test_verdict_of_another_requirement_is_none_that_differs(
    seen: tuple[Sampled, RunBlock],
) -> None:
    sampled, block = seen
    assert compare(replace(sampled, stored=replace(sampled.stored, verdicts=())), block) == ()
