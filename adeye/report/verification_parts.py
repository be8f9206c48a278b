"""The rows of the verification table and of what was realised of a plan."""

from adeye.evaluation.verdict import Outcome, Verdict
from adeye.report.parts import Count, Id, Margin, Part
from adeye.spec.asil import RequirementAsil


class VerificationRow(Part):
    """One FSR for one architecture: from its safety goals to its evidence."""

    goals: tuple[str, ...]
    fsr: Id
    asil: RequirementAsil
    mandatory: bool
    architecture: Id
    is_gate: bool
    allocation: tuple[str, ...]
    metric: str
    """The bounded metric, or the signal of the predicate that decides."""
    threshold: str
    """As the concept states it."""
    threshold_source: str
    value: str
    """Of the worst run, with its unit; empty where there is none."""
    margin: Margin | None = None
    verdict: Verdict | None
    """None where the FSR is not applicable."""
    runs: Count
    exercised: Count
    design: str
    """How the points of the scenarios were chosen."""
    run: str | None = None
    """Result digest of the worst run."""
    command: str


class Realisation(Part):
    """What became of the test cases of one scenario."""

    scenario: Id
    design: str
    planned: Count
    executed: Count
    outcomes: dict[Outcome, Count]

    @property
    def realised(self) -> int:
        """Runs in which the scenario came about as asked."""
        return self.executed - self.outcomes.get(Outcome.NOT_REALISED, 0)
