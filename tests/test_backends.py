"""Both traffic implementations come to the same verdicts; where not, the difference is listed."""

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.work import BatchTask, execute
from adeye.judge.verdict import VERDICTS
from adeye.sweep.case import TestCase, batches

ROOT = Path(__file__).resolve().parents[1]
SEED = 20_260
CASES = int(os.environ.get("PARITY_CASES", "200"))
"""Test cases of the million that are looked at."""

EXPLAINED: dict[str, str] = {}
"""Why a verdict may differ, by test case and FSR: nothing does."""

Judged = dict[tuple[str, str], tuple[str, float]]


def judged(plan: CampaignPlan, cases: Iterable[TestCase]) -> Judged:
    """Verdict and margin by test case and FSR."""
    found: Judged = {}
    for batch in batches(cases, 256):
        result = execute(BatchTask(0, tuple(batch), (), plan.work))
        assert result.runs is not None, result.failure
        verdicts = result.runs.verdicts
        for place, fsr in enumerate(verdicts.fsr_id.values()):
            case = result.runs.test_cases[int(verdicts.run[place])]
            margin = float(verdicts.numbers[place, 2])
            found[case, str(fsr)] = (VERDICTS[verdicts.verdict[place]].value, margin)
    return found


def differences(odd: str, chosen: slice | list[int]) -> tuple[list[str], Judged]:
    """List what the two traffics judge differently."""
    by_backend = []
    for backend in ("highway", "batch"):
        plan = make_plan(ROOT / "odd" / odd, backend=backend)
        numbers = range(len(plan.cases))[chosen] if isinstance(chosen, slice) else chosen
        by_backend.append(judged(plan, (plan.cases[number] for number in numbers)))
    highway, batch = by_backend
    assert highway.keys() == batch.keys()
    listed = [
        f"{case[:12]} {fsr}: {highway[case, fsr]} and {batch[case, fsr]}"
        for case, fsr in highway
        if highway[case, fsr][0] != batch[case, fsr][0] and f"{case} {fsr}" not in EXPLAINED
    ]
    return listed, batch


@pytest.mark.slow
def test_motorway_is_judged_alike_in_full() -> None:
    listed, found = differences("motorway_chauffeur.yaml", slice(None))
    assert not listed
    assert len({case for case, _ in found}) == 228
    assert {"PASS", "FAIL"} <= {verdict for verdict, _ in found.values()}


@pytest.mark.slow
def test_a_sample_of_the_million_is_judged_alike() -> None:
    chosen = np.random.default_rng(SEED).choice(1_000_000, CASES, replace=False)
    numbers = sorted(chosen.tolist())
    listed, found = differences("million.yaml", numbers)
    assert not listed
    assert len({case for case, _ in found}) == CASES
    # Not a set of benign scenes.
    failed = {case for (case, _), (verdict, _) in found.items() if verdict == "FAIL"}
    assert len(failed) > CASES // 20


@pytest.mark.slow
@pytest.mark.skipif("PARITY_CASES" not in os.environ, reason="make parity")
def test_crossing_pedestrian_is_judged_alike_in_full() -> None:
    listed, found = differences("urban_pedestrian_rain.yaml", slice(None))
    assert not listed
    assert len({case for case, _ in found}) == 7_524
