"""What a gate found, and which of it decides the exit code."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from adeye.evaluation.verdict import ExitCode, exit_code

if TYPE_CHECKING:
    from collections.abc import Iterable


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
