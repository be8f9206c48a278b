"""A bench in a folder of the test."""

from pathlib import Path

import pytest

from adeye.selftest.bench import Bench


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)
