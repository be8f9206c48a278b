"""The report of a database, and the text of one section of its page."""

from pathlib import Path

from lxml import html as lxml_html

from adeye.report.build import ReportBuilder
from adeye.report.model.report import Report
from adeye.report.page.html import render
from adeye.store.repository import Repository


def built(db: Path) -> Report:
    """Build the report of the latest campaign, without a replay."""
    with Repository.open(db, create=False) as repository:
        return ReportBuilder(repository, repository.find_campaign(), "my.db").build(lambda _: ())


def section(report: Report, name: str) -> str:
    """Give what a person reads in a section of the page."""
    [found] = lxml_html.document_fromstring(render(report)).xpath(f"//section[@id='{name}']")
    return " ".join(found.text_content().split())
