"""The self-test as a whole: all is detected, and a mechanism that is weakened is noticed."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import numpy as np
import pytest

from adeye.errors import UsageError
from adeye.judge.evaluate import Frame
from adeye.judge.metrics import METRICS
from adeye.judge.verdict import VERDICTS, Verdict
from adeye.report.credibility import SelfTestResult
from adeye.selftest.bench import GROUPS, Bench, Master, Seen, running
from adeye.selftest.running import MASTERS, Examined, choose, conclude, examine
from adeye.store.evidence import verification

if TYPE_CHECKING:
    from pathlib import Path


def result(*names: str) -> SelfTestResult:
    return conclude(examine(choose(names)))


def always(verdict: Verdict, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the judge say one and the same of everything."""
    honest = Frame.judge

    def judge(self: Frame, *arguments: Any) -> Any:
        judged = honest(self, *arguments)
        return replace(judged, verdict=np.full_like(judged.verdict, VERDICTS.index(verdict)))

    monkeypatch.setattr(Frame, "judge", judge)


@pytest.mark.slow
def test_every_master_is_detected_and_no_twin_rejected() -> None:
    told: list[int] = []
    examined = examine(MASTERS, told.append)
    found = conclude(examined)
    assert found.undetected == ()
    assert found.rejected_twins == ()
    assert found.detected == found.masters == len(MASTERS) >= 30
    assert told == [*range(len(MASTERS)), len(MASTERS)]


@pytest.mark.slow
def test_judge_that_says_pass_to_everything_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert result("never_brakes", "switch_stuck", "key_unknown").is_good
    always(Verdict.PASS, monkeypatch)
    found = result("never_brakes", "switch_stuck", "key_unknown")
    assert found.undetected == ("never_brakes", "switch_stuck")
    assert found.rejected_twins == ()
    assert not found.is_good


@pytest.mark.slow
def test_judge_that_fails_everything_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    always(Verdict.FAIL, monkeypatch)
    found = result("never_brakes", "sensor_late")
    assert found.undetected == ()
    assert found.rejected_twins == ("never_brakes", "sensor_late")
    assert not found.is_good


@pytest.mark.slow
def test_database_check_that_finds_nothing_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def verify(_: object) -> Iterator[object]:
        return iter(())

    monkeypatch.setattr(verification, "verify", verify)
    assert result("verdict_edited", "trigger_dropped").undetected == (
        "verdict_edited",
        "trigger_dropped",
    )


@pytest.mark.slow
def test_wrong_built_in_metric_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = METRICS["max_deceleration_mps2"]

    def measure(series: Any) -> Any:
        column = honest.measure(series)
        return replace(column, value=column.value + 0.01)

    monkeypatch.setitem(METRICS, "max_deceleration_mps2", replace(honest, measure=measure))
    assert result("metric_sign").rejected_twins == ("metric_sign",)


def test_plan_that_crashes_is_no_detection(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Bench, "run", Mock(side_effect=RuntimeError("out of order")))
    (found,) = examine(choose(["key_unknown"]))
    assert not found.is_detected
    assert not found.is_twin_good
    assert "out of order" in found.seen.text


def test_quick_takes_one_of_each_group() -> None:
    assert [item.group for item in choose(quick=True)] == list(GROUPS)
    assert choose() == MASTERS


def test_names_choose_in_their_order_and_once() -> None:
    names = ["unit_missing", "never_brakes", "unit_missing"]
    assert [item.name for item in choose(names)] == ["unit_missing", "never_brakes"]


def test_unknown_name_is_an_input_error() -> None:
    with pytest.raises(UsageError, match=r"never_breaks.*Did you mean 'never_brakes'"):
        choose(["never_breaks"])


def made(codes: Sequence[tuple[int, int]]) -> list[Examined]:
    masters = [
        Master(f"m{place}", "file", "w", "f", 2, "it is wrong", running(), running())
        for place, _ in enumerate(codes)
    ]
    return [
        Examined(master, Seen(bad, "it is wrong"), Seen(good, ""))
        for master, (bad, good) in zip(masters, codes, strict=True)
    ]


def test_conclusion_counts_and_names() -> None:
    clock = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
    found = conclude(made([(2, 0), (0, 0), (2, 1), (1, 0)]), lambda: clock)
    assert (found.masters, found.detected) == (4, 2)
    assert found.undetected == ("m1", "m3")
    assert found.rejected_twins == ("m2",)
    assert found.created == "2026-01-02T03:04:05"


def test_bound_is_that_of_clopper_and_pearson() -> None:
    assert conclude(made([(2, 0)] * 64)).low == pytest.approx(0.025 ** (1 / 64))


@pytest.mark.slow
def test_folder_is_gone_and_metrics_of_the_bench_are_forgotten() -> None:
    folders: list[Path] = []

    def look(bench: Bench) -> Seen:
        folders.append(bench.folder)
        return Seen(0, "")

    chosen = [*choose(["metric_sign"]), Master("m", "file", "w", "f", 2, "x", look, look)]
    examine(chosen)
    assert folders
    assert not folders[0].exists()
    assert not [name for name in METRICS if name.startswith("selftest_")]
