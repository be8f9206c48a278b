"""Files that are written from templates: their texts are made harmless where they come in.

The templates of pages stand in ``web/``, those of files for other tools in ``formats/``.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

from adeye.report.words import binding_sentence, margin_text, printable, verdict_word

if TYPE_CHECKING:
    from jinja2 import Environment


@cache
def environment(folder: str, escaped: Callable[[Any], Any] | None = None) -> Environment:
    """Make the environment of the templates in a folder; it knows no missing name.

    Args:
        folder: Below this package.
        escaped: Makes a text harmless; without it, it is escaped as in HTML.
    """
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader("adeye.report", folder),
        autoescape=jinja2.select_autoescape(disabled_extensions=("mmd.j2",), default=True),
        finalize=escaped,
        undefined=jinja2.StrictUndefined,
        extensions=["jinja2.ext.do"],
        trim_blocks=True,
        lstrip_blocks=True,
    )


def xml_of(template: str, **content: Any) -> ET.Element:
    """Return the XML that a template makes of its content, with the white space of this program."""
    from markupsafe import Markup

    def escaped(value: Any) -> Any:
        if isinstance(value, Markup):
            return value
        # As references, these outlast a reader, which would make spaces of them in an attribute.
        kept = {"\t": "&#9;", "\n": "&#10;", "\r": "&#13;", '"': "&quot;"}
        return Markup(escape(printable(str(value)), kept))  # noqa: S704 - it is escaped

    words = {"binding": binding_sentence, "margin_text": margin_text, "verdict_word": verdict_word}
    made = environment("formats", escaped).get_template(template)
    root = ET.fromstring(made.render(**words, **content))  # noqa: S314 - our own
    ET.indent(root)
    return root


def xml_file(root: ET.Element) -> bytes:
    """Return what a file with this XML consists of."""
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"
