"""What the tests of the report share: a report, a page on disk, a browser."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from adeye.report.model.report import Report
from adeye.report.page.html import write_html
from tests.project import Executed
from tests.report.browser import CHROMIUM, Browser
from tests.report.fake import build_report
from tests.report.pages import built


@pytest.fixture(scope="session")
def report() -> Report:
    return build_report()


@pytest.fixture(scope="session")
def plain(mini: Executed, tmp_path_factory: pytest.TempPathFactory) -> Report:
    """The report of a campaign of which nothing was measured beyond its runs."""
    return built(shutil.copyfile(mini.db, tmp_path_factory.mktemp("plain") / "adeye.db"))


@pytest.fixture(scope="session")
def page(report: Report, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_html(report, path)
    return path


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    if not CHROMIUM.exists():
        pytest.skip(f"there is no {CHROMIUM}")
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened
