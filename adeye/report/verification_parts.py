"""The rows of the verification table and of what was realised of a plan."""

from typing import Annotated

from pydantic import Field

from adeye.evaluation.verdict import Outcome, Verdict, exercised_of
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
    min_exercised: Annotated[int, Field(ge=1)] = 1
    design: str
    """How the points of the scenarios were chosen."""
    run: str | None = None
    """Result digest of the worst run."""
    command: str

    @property
    def exercised_text(self) -> str:
        """Of how many runs, or of how many that are needed, it was exercised."""
        return exercised_of(self.verdict, self.exercised, self.runs, self.min_exercised)


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
