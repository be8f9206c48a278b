"""The version is one, wherever it is asked for."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

import pytest

import adeye
from adeye.version import __version__


def test_version_of_the_package_is_that_of_the_distribution() -> None:
    assert adeye.__version__ == __version__
    try:
        installed = version("adeye")
    except PackageNotFoundError:
        pytest.skip("adeye is not installed here, only on the path")
    assert installed == __version__
