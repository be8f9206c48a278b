"""What a report says about the concept: hazards to requirements' elements, and what is wrong."""

from typing import Literal

from adeye.report.parts import Asil, Count, Id, Part


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
