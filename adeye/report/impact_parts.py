"""The records of a report about what changed since a baseline, and what became stale."""

from typing import Self

from pydantic import model_validator

from adeye.evaluation.verdict import ExitCode
from adeye.report.findings import Kind
from adeye.report.parts import Count, Id, Part


class Change(Part):
    """One difference from the baseline."""

    kind: Kind
    decides: bool
    """Whether a gate with this baseline hangs on it."""
    fsr: str = ""
    architecture: str = ""
    scenario: str = ""
    text: str
    runs: tuple[str, ...] = ()
    """Result digests of runs to look at, the worst first."""
    command: str = ""


class StaleEvidence(Part):
    """Evidence that no longer counts under the files as they are, for one reason."""

    cause: Id
    subject: str
    text: str
    evidence: Count
    """Runs with a verdict of an FSR."""
    runs: Count
    fsrs: tuple[str, ...]
    architectures: tuple[str, ...]


class StaleFiles(Part):
    """The evidence of a campaign under the files as they were when the report was written."""

    odd: Id
    """Path of the ODD."""
    evidence: Count
    counts: Count
    """Of these, the ones that still count."""
    causes: tuple[StaleEvidence, ...] = ()
    to_judge: Count
    """Results that judging again completes."""
    to_replay: Count
    to_execute: Count

    @model_validator(mode="after")
    def _adds_up(self) -> Self:
        stale = sum(item.evidence for item in self.causes)
        if self.counts + stale != self.evidence:
            msg = f"{self.counts} of {self.evidence} count, and {stale} are stale"
            raise ValueError(msg)
        return self


class Impact(Part):
    """What changed since a baseline."""

    baseline: Id
    """Path of its file."""
    campaign: Id
    """That the baseline was written from."""
    exit_code: ExitCode
    """Of a gate with this baseline."""
    message: str
    changes: tuple[Change, ...] = ()
    """What decides first."""
    stale: StaleFiles | None = None
    not_asked: str = ""
    """Why nothing is said of stale evidence; empty if it is."""
    command: str

    @model_validator(mode="after")
    def _says_what_it_can(self) -> Self:
        if (self.stale is None) != bool(self.not_asked):
            msg = "either stale evidence is told, or why it is not"
            raise ValueError(msg)
        return self

    @property
    def deciding(self) -> int:
        """Differences that a gate hangs on."""
        return sum(item.decides for item in self.changes)
