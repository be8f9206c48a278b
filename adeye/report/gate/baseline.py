"""What a gate found, and which of it decides the exit code.

It holds digests of what was judged, one line for each FSR, architecture and scenario, and one line
for each test case with the verdicts and margins of all FSRs. A line that changed is a result that
changed. The file ends with a digest of its content: what was edited by hand is found out.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import Field, ValidationError

from adeye.errors import IntegrityError, SourceLocation, SpecError
from adeye.identity import digest, unique_keys
from adeye.judge.verdict import ExitCode, Verdict, exit_code
from adeye.outputs import require_plain, write_atomically
from adeye.report.model.part import Count, Id, Margin, Part, agrees
from adeye.spec.asil import RequirementAsil

# --- What a gate found, and which of it decides the exit code -------------------------------------


class Kind(StrEnum):
    """What a finding is about."""

    FAILING = "failing"
    NEWLY_FAILING = "newly failing"
    MARGIN = "margin"
    UNDECIDED = "undecided"
    MISSING = "missing"
    CHANGED = "changed"
    RELAXED = "relaxed"
    INTEGRITY = "integrity"
    NEWLY_PASSING = "newly passing"
    NOTE = "note"

    @property
    def code(self) -> ExitCode:
        """Exit code that a finding calls for, if it decides."""
        return _CODES[self]


_CODES: Final = {
    Kind.FAILING: ExitCode.FAILED,
    Kind.NEWLY_FAILING: ExitCode.FAILED,
    Kind.MARGIN: ExitCode.FAILED,
    Kind.UNDECIDED: ExitCode.INCOMPLETE,
    Kind.MISSING: ExitCode.INCOMPLETE,
    Kind.CHANGED: ExitCode.INCOMPLETE,
    Kind.RELAXED: ExitCode.INCOMPLETE,
    Kind.INTEGRITY: ExitCode.INTEGRITY,
    Kind.NEWLY_PASSING: ExitCode.OK,
    Kind.NOTE: ExitCode.OK,
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One difference, or one reason why the gate is not green.

    Attributes:
        kind: What it is about.
        text: For people.
        decides: Whether it counts for the exit code: about a mandatory FSR and an architecture of
            the gate, now or in the baseline.
        fsr: Id, if it is about one.
        architecture: Id, if it is about one.
        scenario: Id, if it is about one.
        runs: Digests of runs to look at, the worst first.
    """

    kind: Kind
    text: str
    decides: bool = True
    fsr: str = ""
    architecture: str = ""
    scenario: str = ""
    runs: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        """What it is about."""
        return ", ".join(filter(None, (self.fsr, self.architecture, self.scenario)))

    def __str__(self) -> str:
        """Write it as ``kind: where: text``."""
        return ": ".join(filter(None, (str(self.kind), self.where, self.text)))


def deciding(findings: Iterable[Finding]) -> list[Finding]:
    """Keep the findings that decide the exit code: the one place for what a gate leaves out."""
    return [item for item in findings if item.decides and item.kind.code is not ExitCode.OK]


def gate_code_of(findings: Iterable[Finding], campaign: ExitCode) -> ExitCode:
    """Combine what was found with the exit code of the campaign itself.

    Args:
        findings: All of them.
        campaign: Exit code that the verdicts of the campaign call for.
    """
    return exit_code([campaign, *(item.kind.code for item in deciding(findings))])


# --- A baseline: what a campaign came to, as a small file to commit and to gate later campaigns
# with.

SCHEMA: Final = "adeye/baseline@1"
MAX_BYTES: Final = 64 * 2**20
"""More than any baseline has; a larger file is none."""
UPDATE: Final = "Write it again with adeye gate --update and review the difference."

LETTERS: Final = {
    "P": Verdict.PASS,
    "F": Verdict.FAIL,
    "?": Verdict.INCONCLUSIVE,
    "V": Verdict.VACUOUS,
    "I": Verdict.INVALID,
    "E": Verdict.ERROR,
    "N": Verdict.NOT_RUN,
    "-": None,
}
"""Verdict behind each letter of a test case; None where an FSR is not judged."""

Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Key = Annotated[str, Field(pattern="^[0-9a-f]{16}$")]


class BaselineFsr(Part):
    """How an FSR was judged."""

    digest: Digest
    """Identity of all that its verdict depends on beside the trace."""
    asil: RequirementAsil
    mandatory: bool
    min_exercised: Annotated[int, Field(ge=1)]
    waived_until: str | None = None


class BaselineCell(Part):
    """One FSR for one architecture in one scenario; without a scenario, over all of them."""

    fsr: Id
    architecture: Id
    scenario: str | None = None
    verdict: Verdict | None
    """None where the FSR is not applicable."""
    counts: dict[Verdict, Count]
    """Runs per verdict."""
    exercised: Count
    margin: Margin | None = None
    """Of the worst run; none where nothing has a margin in a unit."""
    run: str | None = None
    """Digest of the worst run, by which ``adeye show`` finds it."""


class BaselineCase(Part):
    """One test case: what makes its pair in a later campaign, and how it was judged."""

    key: Key
    """Over situation, content of the faults and swept values of the architecture."""
    fault: str
    """Entry of the fault list."""
    verdicts: Annotated[str, Field(pattern="^[PF?VIEN-]*$")]
    """A letter for each FSR."""
    margins: tuple[float | None, ...]
    """In the unit of ``measures``, by FSR."""
    robustness: tuple[float | None, ...]
    """Divided by the scale of the signal."""


class BaselineCases(Part):
    """The test cases of one architecture in one scenario."""

    architecture: Id
    scenario: Id
    fsrs: tuple[str, ...]
    measures: tuple[str | None, ...]
    """Unit and signal of the margins of each FSR, where all test cases have the same."""
    rows: tuple[BaselineCase, ...]

    @agrees
    def _are_complete(self) -> Iterator[str]:
        where = f"{self.architecture}, {self.scenario}"
        width = len(self.fsrs)
        for row in self.rows:
            parts = (row.verdicts, row.margins, row.robustness)
            if len(self.measures) != width or any(len(part) != width for part in parts):
                yield f"{where}: test case {row.key} does not have {width} FSRs"
        keys = [row.key for row in self.rows]
        if len(set(keys)) != len(keys):
            yield f"{where}: a test case is there twice"


class Baseline(Part):
    """What a campaign came to."""

    odd: Id
    campaign: Id
    odd_digest: Digest
    concept_digest: Digest
    numerics: str
    """Backend, variant and numerics version."""
    gate: tuple[str, ...]
    channel_failures: Literal["refuse", "allow"] = "refuse"
    """What the gate says to channels that fail; not written where that is the default."""
    preventable_by: tuple[str, ...] = ()
    """Reference drivers whose contacts do not block; not written where the gate names none."""
    uncertainty: Count = 0
    """Situations by which margins are judged with what the step is worth; not written if none."""
    attributes: str = ""
    """Hash of those of the ODD: what the evidence stands for; empty if unknown."""
    tolerance: dict[str, float] = Field(default_factory=dict)
    """Loss of margin that the gate tolerates, by unit; not written where it names none."""
    exit_code: ExitCode
    """Of the campaign; a baseline may hold failures that are known."""
    planned: Count
    accounted: Count
    architectures: dict[str, Digest]
    """Content by id, as the ODD has it."""
    scenarios: dict[str, Digest]
    faults: dict[str, Digest]
    designs: dict[str, str]
    """Design of the sweep by scenario; only a random one allows a paired test."""
    fsrs: dict[str, BaselineFsr]
    cells: tuple[BaselineCell, ...]
    cases: tuple[BaselineCases, ...] | None
    """None for more test cases than are kept; then only the cells are compared."""

    @agrees
    def _refers_to_itself(self) -> Iterator[str]:
        for cell in self.cells:
            if cell.fsr not in self.fsrs or cell.architecture not in self.architectures:
                yield f"a cell is about {cell.fsr} for {cell.architecture}, which are not listed"
        if self.cases is not None:
            kept = sum(len(part.rows) for part in self.cases)
            if kept != self.planned:
                yield f"{kept} of {self.planned} test cases are listed"


_UNWRITTEN: Final = ("channel_failures", "preventable_by", "uncertainty", "attributes", "tolerance")
"""Fields that are only written where they are not the default."""


def baseline_text(baseline: Baseline) -> str:
    """Write a baseline: sorted, one line for each cell and each test case.

    Args:
        baseline: What is written.
    """
    document = baseline.model_dump(mode="json", exclude_defaults=False)
    document["exit_code"] = int(baseline.exit_code)
    for name in _UNWRITTEN:
        field = Baseline.model_fields[name]
        if getattr(baseline, name) == field.get_default(call_default_factory=True):
            del document[name]
    head = {"schema": SCHEMA, **document, "digest": digest(document)}
    return "{\n" + ",\n".join(f' "{name}": {text}' for name, text in _members(head)) + "\n}\n"


def _members(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for name, value in document.items():
        if name == "cells":
            yield name, _lines(map(_line, value), "  ")
        elif name == "cases" and value is not None:
            yield name, _lines(map(_cases_text, value), "  ")
        elif isinstance(value, dict):
            items = (f"{_line(key)}: {_line(value[key])}" for key in sorted(value))
            yield name, "{\n" + ",\n".join(f"  {item}" for item in items) + "\n }"
        else:
            yield name, _line(value)


def _cases_text(part: Mapping[str, Any]) -> str:
    members = [f'"{name}": {_line(value)}' for name, value in part.items() if name != "rows"]
    members.append(f'"rows": {_lines(map(_line, part["rows"]), "    ")}')
    return "{" + ", ".join(members) + "}"


def _lines(items: Iterator[str], indent: str) -> str:
    found = list(items)
    return "[\n" + ",\n".join(indent + item for item in found) + f"\n{indent[:-1]}]"


def _line(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def write_baseline(baseline: Baseline, path: Path) -> None:
    """Write a baseline to its file.

    Raises:
        PlatformError: The file cannot be written.
    """
    write_atomically(baseline_text(baseline).encode(), path)


def read_baseline(path: Path) -> Baseline:
    """Read a baseline and check that nobody edited it.

    Args:
        path: The file.

    Raises:
        SpecError: There is no such file, or it is no baseline.
        IntegrityError: Its content is not what was written.
    """
    document = _document(path)
    written = document.pop("digest", None)
    try:
        found = digest(document)
    except ValueError as error:
        raise _no_baseline(path, str(error)) from error
    if found != written:
        raise IntegrityError(
            f"{path}: the baseline was edited after it was written: its content has digest "
            f"{found[:12]}, the file says {str(written)[:12]}. {UPDATE}"
        )
    try:
        return Baseline.model_validate(document)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise _no_baseline(path, f"{place}: {first['msg']}") from error


def _document(path: Path) -> dict[str, Any]:
    try:
        require_plain(path, MAX_BYTES)
        document = json.loads(
            path.read_bytes(), parse_constant=_refuse, object_pairs_hook=unique_keys
        )
    except FileNotFoundError as error:
        raise SpecError(
            "there is no such baseline",
            where=SourceLocation(str(path), 1, 1),
            remedy="Check the path, or write it with adeye gate --update.",
        ) from error
    except json.JSONDecodeError as error:
        raise _no_baseline(path, error.msg, error.lineno, error.colno) from error
    except (ValueError, RecursionError) as error:
        raise _no_baseline(path, str(error)) from error
    except OSError as error:
        raise _no_baseline(path, error.strerror or str(error)) from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        found = document.get("schema") if isinstance(document, dict) else type(document).__name__
        raise _no_baseline(path, f"its schema is {found!r}, {SCHEMA!r} can be read")
    del document["schema"]
    return document


def _refuse(word: str) -> None:
    msg = f"{word} is no number"
    raise ValueError(msg)


def _no_baseline(path: Path, why: str, line: int = 1, column: int = 1) -> SpecError:
    return SpecError(
        f"this is no baseline: {why}",
        where=SourceLocation(str(path), line, column),
        remedy=UPDATE,
    )


def json_schema() -> dict[str, Any]:
    """Describe the JSON of a baseline as JSON Schema (draft 2020-12)."""
    schema = Baseline.model_json_schema(mode="serialization")
    digest_schema = {"type": "string", "description": "Over everything but itself and the schema."}
    schema["properties"] = {
        "schema": {"const": SCHEMA},
        **schema["properties"],
        "digest": digest_schema,
    }
    always = [name for name in schema["required"] if name not in _UNWRITTEN]
    schema["required"] = ["schema", *always, "digest"]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA, **schema}
