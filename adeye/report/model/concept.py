"""What a report says about the concept: hazards to requirements' elements, and what is wrong."""

from typing import Annotated, Literal

from pydantic import Field

from adeye.judge.verdict import Outcome, Verdict, exercised_of
from adeye.report.model.part import Asil, Count, Id, Margin, Part
from adeye.spec.asil import RequirementAsil

# --- What a report says about the concept: hazards to requirements' elements, and what is wrong ---


class Hazard(Part):
    """A hazardous event with its classification."""

    id: Id
    text: str
    severity: str
    exposure: str
    controllability: str
    asil: Asil | None = None
    """Derived from the three classes (ISO 26262-3:2018, table 4)."""
    function: str = ""
    severity_rationale: str = ""
    exposure_rationale: str = ""
    controllability_rationale: str = ""
    exposure_method: str = ""
    """``duration``, ``frequency`` or empty where the concept does not say."""


class SafetyGoal(Part):
    """A safety goal and the hazardous events behind it."""

    id: Id
    text: str
    asil: Asil
    hazards: tuple[str, ...]
    safe_state: str
    ftti_s: float | None = None
    ftti_rationale: str = ""


class Element(Part):
    """An architectural element that FSRs are allocated to."""

    id: Id
    kind: str
    text: str
    asil_capability: Asil
    legacy: bool = False
    realised_by: tuple[str, ...] = ()
    """Parts as ``architecture.part``."""
    resources: tuple[str, ...] = ()


class Decomposition(Part):
    """Two FSRs that together stand for one."""

    fsr: Id
    into: tuple[str, ...]
    scheme: str
    """Such as ``D = B(D) + B(D)``."""
    independence: str
    dfa: tuple[str, ...] = ()
    """Dependent-failure records that it rests on."""


class DependentFailure(Part):
    """A record of the dependent-failure analysis."""

    id: Id
    covers: tuple[str, ...]
    argument: str
    owner: str
    valid_until: str
    is_expired: bool = False


class Assumption(Part):
    """Something that the concept relies on."""

    id: Id
    text: str
    owner: str
    valid_until: str
    is_expired: bool = False


class Waiver(Part):
    """Missing verdicts of an FSR that were accepted until a date."""

    fsr: Id
    reason: str
    author: str
    expires: str
    runs: Count
    is_expired: bool = False


class IntegrityFinding(Part):
    """Something of concept, plan or evidence that breaks an integrity rule (``adeye check``)."""

    rule: Id
    text: str
    """What is wrong where the rule finds something."""
    part: str
    id: str
    detail: str
    remedy: str


PointKind = Literal[
    "failing",
    "error",
    "invalid",
    "inconclusive",
    "not_run",
    "vacuous",
    "not_applicable",
    "waiver",
    "assumption",
    "finding",
    "channel_failure",
]


class OpenPoint(Part):
    """Something that a reader has to know before relying on the verdicts."""

    kind: PointKind
    subject: Id
    """The FSR, the assumption or the part of the concept."""
    architecture: str = ""
    scenario: str = ""
    """Empty for all scenarios together."""
    text: str
    decides: bool = False
    """Whether the gate hangs on it."""
    command: str = ""


# --- The rows of the verification table and of what was realised of a plan ------------------------


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
