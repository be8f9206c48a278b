"""Thresholds and files: each mistake is named with its place, each twin is accepted."""

import re

import pytest

from adeye.selftest.bench import Bench, Master, is_good
from adeye.selftest.inputs import FILES, THRESHOLDS


@pytest.mark.parametrize("master", FILES, ids=lambda item: item.name)
def test_mistake_is_named_with_file_and_line(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    assert re.search(r"\.yaml:\d+:\d+: ", seen.text)


@pytest.mark.slow
@pytest.mark.parametrize("master", FILES, ids=lambda item: item.name)
def test_twin_is_accepted(bench: Bench, master: Master) -> None:
    assert is_good(master.twin(bench))


@pytest.mark.slow
@pytest.mark.parametrize("master", THRESHOLDS, ids=lambda item: item.name)
def test_wrong_threshold_is_detected(bench: Bench, master: Master) -> None:
    seen = master.examine(bench)
    assert master.is_detected(seen), seen.text
    assert is_good(master.twin(bench))
