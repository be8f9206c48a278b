"""The forms that a report is written in for other tools, besides the page.

No verdict is made here. Begin with ``json``, the whole record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from adeye.errors import UsageError
from adeye.report.formats import gsn
from adeye.report.formats.reqif import render_reqif
from adeye.report.formats.sarif import render_sarif
from adeye.report.model.report import Report

GSN_FORMS: Final[Mapping[str, Callable[[gsn.Argument], str]]] = {
    ".json": gsn.render_gsn_json,
    ".mmd": gsn.render_mermaid,
    ".svg": gsn.render_svg,
}
"""Forms of a goal structure by the end of the file's name."""
_WRITERS: Final[Mapping[str, Callable[[Report], bytes]]] = {
    "sarif": render_sarif,
    "reqif": render_reqif,
}


def check_exports(exports: Mapping[str, Path]) -> None:
    """Refuse a file whose form cannot be told, before anything is computed.

    Args:
        exports: File by form: ``sarif``, ``reqif`` or ``gsn``.

    Raises:
        UsageError: A goal structure cannot be written into such a file.
    """
    path = exports.get("gsn")
    if path is not None and path.suffix not in GSN_FORMS:
        raise UsageError(
            f"--gsn {path}: {path.suffix or 'a name without an end'!r} is no form of a goal "
            "structure",
            remedy=f"End the name in {', '.join(GSN_FORMS)}.",
        )


def render_export(report: Report, form: str, path: Path) -> bytes:
    """Write a report in a form: ``sarif``, ``reqif`` or ``gsn``, the last by the file's name."""
    if form == "gsn":
        return GSN_FORMS[path.suffix](gsn.argument_of(report)).encode()
    return _WRITERS[form](report)
