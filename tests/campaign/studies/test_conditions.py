"""Conditions differ in batches, order, lanes and what the processor can do."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from adeye.campaign.executors import InProcess, Processes, Threads
from adeye.campaign.studies.certify import CONDITIONS, Condition, Mask, masks
from tests.campaign.work import perform

if TYPE_CHECKING:
    from tests.project import Executed


def test_conditions_cover_batches_lanes_and_orders() -> None:
    assert {item.batch for item in CONDITIONS} == {1, 7, 64, 1024}
    assert {item.order for item in CONDITIONS} == {"planned", "reversed", "shuffled"}
    lanes = {(item.kind, item.lanes) for item in CONDITIONS}
    threads = {("threads", 2), ("threads", 4)}
    assert lanes == {("here", 1), *threads, ("processes", 1), ("processes", 2)}
    assert len({item.name for item in CONDITIONS}) == len(CONDITIONS)


def test_name_says_everything() -> None:
    mask = Mask("without AVX", {})
    assert (
        Condition(1024, "planned", "threads", 4).name == "batches of 1,024, planned, in 4 threads"
    )
    assert Condition(7, "reversed").name == "batches of 7, reversed, in this process"
    masked = Condition(64, "shuffled", "processes", 1, mask).name
    assert masked == "batches of 64, shuffled, in 1 process, without AVX"


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda item: item.name)
def test_every_case_is_in_one_batch_of_one_structure(condition: Condition, mini: Executed) -> None:
    cases = list(mini.plan.cases)
    found = condition.batches(cases, 5)
    assert max(map(len, found)) <= min(condition.batch, 5)
    assert sorted(case.digest for batch in found for case in batch) == sorted(
        case.digest for case in cases
    )
    for batch in found:
        assert len({(case.scenario_id, case.fault_entry) for case in batch}) == 1


def test_orders_differ_and_are_the_same_every_time(mini: Executed) -> None:
    cases = list(mini.plan.cases)

    def order(condition: Condition) -> list[str]:
        return [case.digest for batch in condition.batches(cases, 64) for case in batch]

    planned, shuffled = order(Condition(1, "planned")), order(Condition(1, "shuffled"))
    assert planned == [case.digest for case in cases] or sorted(planned) == sorted(shuffled)
    backwards = Condition(1, "reversed")._ordered(cases)
    assert backwards == cases[::-1]
    drawn = Condition(1, "shuffled")._ordered(cases)
    assert drawn not in (cases, cases[::-1])
    assert drawn == Condition(1, "shuffled")._ordered(cases[::-1])
    # Two shuffled conditions are not one order.
    assert drawn != Condition(64, "shuffled", "threads", 2)._ordered(cases)


def test_lanes_are_those_of_the_campaign() -> None:
    assert isinstance(Condition(1, "planned").executor(perform), InProcess)
    threads = Condition(1, "planned", "threads", 2).executor(perform)
    assert isinstance(threads, Threads)
    threads.close()
    assert isinstance(Condition(1, "planned", "processes", 2).executor(perform), Processes)


def test_mask_is_only_for_what_is_started_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ADEYE_TEST_KNOWN", "before")
    monkeypatch.delenv("ADEYE_TEST_NEW", raising=False)
    mask = Mask("any", {"ADEYE_TEST_KNOWN": "masked", "ADEYE_TEST_NEW": "1"})
    script = "import os; print(os.environ['ADEYE_TEST_KNOWN'], os.environ['ADEYE_TEST_NEW'])"
    with mask.applied():
        done = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True
        )
    assert done.stdout.split() == ["masked", "1"]
    assert os.environ["ADEYE_TEST_KNOWN"] == "before"
    assert "ADEYE_TEST_NEW" not in os.environ


def test_masks_take_something_away() -> None:
    found = {item.name.partition(" ")[0]: item for item in masks()}
    assert "kernels" in found
    assert found["kernels"].environment["NUMBA_CPU_NAME"] == "generic"
    if "NumPy" in found:
        script = (
            "import numpy as n; u = (getattr(n, '_core', None) or n.core)._multiarray_umath; "
            "print(*[k for k, v in u.__cpu_features__.items() if v])"
        )
        hidden = found["NumPy"].environment["NPY_DISABLE_CPU_FEATURES"].split()
        with found["NumPy"].applied():
            done = subprocess.run(
                [sys.executable, "-c", script], capture_output=True, text=True, check=True
            )
        assert hidden
        assert not set(hidden) & set(done.stdout.split())
