"""Goals and FSRs with their verdicts as ReqIF, the exchange format of requirement tools.

An object's identifier depends on the concept's id and its own only, so that an import of the next
campaign updates what the last one brought.

Source:
    OMG, Requirements Interchange Format (ReqIF) 1.2, formal/2016-07-01.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from adeye.identity import digest
from adeye.judge.verdict import Verdict
from adeye.report.model.report import Fsr, Report
from adeye.report.words import margin_text, printable, verdict_word

NAMESPACE: Final = "http://www.omg.org/spec/ReqIF/20110401/reqif.xsd"
EPOCH: Final = "1970-01-01T00:00:00"
_MAX_LENGTH: Final = "32000"

GOAL: Final = ("ReqIF.ForeignID", "ReqIF.Text", "ASIL", "Hazardous events", "Safe state", "FTTI")
FSR: Final = (
    "ReqIF.ForeignID",
    "ReqIF.Text",
    "ASIL",
    "Safety goals",
    "Mandatory",
    "Allocation",
    "Measure",
    "Threshold from",
    "Place",
)
"""Attributes of an FSR; one for the verdict of each architecture follows."""


@dataclass(frozen=True, slots=True)
class _Object:
    """A requirement of the specification."""

    kind: str
    id: str
    values: tuple[tuple[str, str], ...]
    children: tuple[_Object, ...] = ()


def render_reqif(report: Report) -> bytes:
    """Write safety goals with their FSRs as ReqIF in UTF-8, the same for the same report.

    An FSR that serves several goals is one object, listed below each of them.
    """
    return _Writer(report).write()


def verdict_attribute(architecture: str) -> str:
    """Name the attribute that holds the verdict for an architecture."""
    return f"Verdict {architecture}"


class _Writer:
    """Puts the document together."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._when = f"{report.created or EPOCH}Z"

    def write(self) -> bytes:
        root = ET.Element("REQ-IF", {"xmlns": NAMESPACE})
        self._header(ET.SubElement(ET.SubElement(root, "THE-HEADER"), "REQ-IF-HEADER"))
        content = ET.SubElement(ET.SubElement(root, "CORE-CONTENT"), "REQ-IF-CONTENT")
        kinds = {"goal": GOAL, "fsr": (*FSR, *self._verdict_names())}
        text = ET.SubElement(
            ET.SubElement(content, "DATATYPES"),
            "DATATYPE-DEFINITION-STRING",
            self._named("datatype", "text") | {"MAX-LENGTH": _MAX_LENGTH},
        )
        self._types(ET.SubElement(content, "SPEC-TYPES"), kinds, text.attrib["IDENTIFIER"])
        goals = self._goals()
        objects = {item.id: item for goal in goals for item in (goal, *goal.children)}
        spec_objects = ET.SubElement(content, "SPEC-OBJECTS")
        for item in objects.values():
            self._object(spec_objects, item)
        relations = ET.SubElement(content, "SPEC-RELATIONS")
        for goal in goals:
            for child in goal.children:
                self._relation(relations, "satisfies", child.id, goal.id)
        for step in self._report.decompositions:
            for name in step.into:
                self._relation(relations, "decomposes", name, step.fsr)
        self._specification(ET.SubElement(content, "SPECIFICATIONS"), goals)
        ET.indent(root)
        made: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
        return made + b"\n"

    def _key(self, *parts: str) -> str:
        # An XML id begins with a letter or an underscore.
        return f"_{digest([self._report.concept, *parts])[:32]}"

    def _named(self, *parts: str) -> dict[str, str]:
        name = printable(parts[-1])
        return {"IDENTIFIER": self._key(*parts), "LONG-NAME": name, "LAST-CHANGE": self._when}

    def _header(self, header: ET.Element) -> None:
        report = self._report
        header.set("IDENTIFIER", self._key("header"))
        comment = f"Campaign {report.campaign}, ODD {report.odd}, evidence {report.evidence_digest}"
        for name, text in (
            ("COMMENT", comment),
            ("CREATION-TIME", self._when),
            ("REQ-IF-TOOL-ID", f"adeye {report.tool_version}"),
            ("REQ-IF-VERSION", "1.0"),
            ("SOURCE-TOOL-ID", "adeye"),
            ("TITLE", report.concept_title or report.title),
        ):
            ET.SubElement(header, name).text = printable(text)

    def _types(self, types: ET.Element, kinds: dict[str, tuple[str, ...]], datatype: str) -> None:
        for kind, names in kinds.items():
            made = ET.SubElement(types, "SPEC-OBJECT-TYPE", self._named("type", kind))
            attributes = ET.SubElement(made, "SPEC-ATTRIBUTES")
            for name in names:
                defined = ET.SubElement(
                    attributes, "ATTRIBUTE-DEFINITION-STRING", self._named("attribute", kind, name)
                )
                _refer(defined, "TYPE", "DATATYPE-DEFINITION-STRING-REF", datatype)
        for name in ("satisfies", "decomposes"):
            ET.SubElement(types, "SPEC-RELATION-TYPE", self._named("relation type", name))
        ET.SubElement(types, "SPECIFICATION-TYPE", self._named("type", "specification"))

    def _verdict_names(self) -> tuple[str, ...]:
        return tuple(verdict_attribute(item.id) for item in self._report.architectures)

    def _goals(self) -> tuple[_Object, ...]:
        fsrs = {item.id: self._fsr(item) for item in self._report.fsrs}
        return tuple(
            _Object(
                "goal",
                goal.id,
                (
                    ("ReqIF.ForeignID", goal.id),
                    ("ReqIF.Text", goal.text),
                    ("ASIL", goal.asil),
                    ("Hazardous events", ", ".join(goal.hazards)),
                    ("Safe state", goal.safe_state),
                    ("FTTI", "" if goal.ftti_s is None else f"{goal.ftti_s:g} s"),
                ),
                tuple(fsrs[item.id] for item in self._report.fsrs if goal.id in item.goals),
            )
            for goal in self._report.goals
        )

    def _fsr(self, item: Fsr) -> _Object:
        values = (
            item.id,
            item.text.strip(),
            item.asil,
            ", ".join(item.goals),
            "yes" if item.mandatory else "no",
            ", ".join(item.allocation),
            item.formula,
            item.threshold_source,
            str(item.where or ""),
        )
        verdicts = zip(self._verdict_names(), self._verdicts(item), strict=True)
        return _Object("fsr", item.id, (*zip(FSR, values, strict=True), *verdicts))

    def _verdicts(self, item: Fsr) -> Iterator[str]:
        for architecture in self._report.architectures:
            cell = self._report.cell(item.id, architecture.id)
            if cell is None:
                yield verdict_word(Verdict.NOT_RUN)
                continue
            margin = f", worst margin {margin_text(cell)}" if margin_text(cell) else ""
            yield (f"{verdict_word(cell.verdict)}, exercised in {cell.exercised_text} runs{margin}")

    def _object(self, objects: ET.Element, item: _Object) -> None:
        made = ET.SubElement(objects, "SPEC-OBJECT", self._named(item.kind, item.id))
        values = ET.SubElement(made, "VALUES")
        for name, text in item.values:
            value = ET.SubElement(values, "ATTRIBUTE-VALUE-STRING", {"THE-VALUE": printable(text)})
            key = self._key("attribute", item.kind, name)
            _refer(value, "DEFINITION", "ATTRIBUTE-DEFINITION-STRING-REF", key)
        _refer(made, "TYPE", "SPEC-OBJECT-TYPE-REF", self._key("type", item.kind))

    def _relation(self, relations: ET.Element, kind: str, source: str, target: str) -> None:
        parent = "goal" if kind == "satisfies" else "fsr"
        made = ET.SubElement(
            relations, "SPEC-RELATION", self._named("relation", kind, f"{source} {kind} {target}")
        )
        _refer(made, "TYPE", "SPEC-RELATION-TYPE-REF", self._key("relation type", kind))
        _refer(made, "SOURCE", "SPEC-OBJECT-REF", self._key("fsr", source))
        _refer(made, "TARGET", "SPEC-OBJECT-REF", self._key(parent, target))

    def _specification(self, specifications: ET.Element, goals: Sequence[_Object]) -> None:
        report = self._report
        made = ET.SubElement(
            specifications, "SPECIFICATION", self._named("specification", report.concept or "-")
        )
        _refer(made, "TYPE", "SPECIFICATION-TYPE-REF", self._key("type", "specification"))
        self._hierarchy(ET.SubElement(made, "CHILDREN"), goals, ())

    def _hierarchy(
        self, parent: ET.Element, items: Sequence[_Object], path: tuple[str, ...]
    ) -> None:
        for item in items:
            made = ET.SubElement(
                parent, "SPEC-HIERARCHY", self._named("place", *path, item.kind, item.id)
            )
            _refer(made, "OBJECT", "SPEC-OBJECT-REF", self._key(item.kind, item.id))
            if item.children:
                below = ET.SubElement(made, "CHILDREN")
                self._hierarchy(below, item.children, (*path, item.id))


def _refer(parent: ET.Element, role: str, kind: str, key: str) -> None:
    ET.SubElement(ET.SubElement(parent, role), kind).text = key
