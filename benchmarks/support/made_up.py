"""A campaign of any size with made-up results, for measuring what keeps them.

Two architectures, two scenarios, five fault entries, swept axes; a result has two events, two kept
extremes, every built-in metric, 25 of them with a value, and six verdicts. Identities are true
digests, numbers come from generators seeded by the block, so that two databases hold the same.
"""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from adeye.judge.metrics.registry import STATUSES
from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import FAIL, PASS, VACUOUS, Outcome
from adeye.spec.concept import Concept, Element, HazardousEvent, Requirement, SafetyGoal
from adeye.store.block import (
    BasisBlock,
    EventBlock,
    ExtremeBlock,
    MetricBlock,
    PlannedCases,
    RunBlock,
    VerdictBlock,
)
from adeye.store.encoding import Dictionary, Texts
from adeye.store.records import CampaignFsr, CampaignRecord, ContentRecord, EngineKey
from adeye.store.tables import METRIC_IDS
from adeye.store.texts import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.store.records import Block

ENGINE: Final = EngineKey("batch", "reference", 1)
SCENARIOS: Final = ("cut_in", "braking")
ARCHITECTURES: Final = ("legacy", "new")
FAULTS: Final = ("none", "camera_blind", "radar_silent", "nominal_silent", "brake_slow")
STRUCTURES: Final = len(SCENARIOS) * len(ARCHITECTURES) * len(FAULTS)
FSRS: Final = tuple(f"FSR{number}" for number in range(1, 7))
MEASURED: Final = METRIC_IDS[:: len(METRIC_IDS) // 25][:25]
"""Metrics that have a value in nearly every run."""
PART: Final = 1_024
ACTORS: Final = ("cutter", "lead", "follower", None)


def sha(text: str) -> str:
    """Digest a text (sha256 in hex)."""
    return hashlib.sha256(text.encode()).hexdigest()


def record() -> CampaignRecord:
    """Give a campaign with six FSRs."""
    goal = SafetyGoal(
        id="SG1",
        text="No contact",
        hazardous_events=("HE1",),
        safe_state="standstill",
        ftti="1.5 s",
        ftti_rationale="gap",
    )
    event = HazardousEvent(
        id="HE1",
        function="follow",
        malfunction="no braking",
        situation="motorway",
        severity="S3",
        exposure="E4",
        controllability="C3",
        severity_rationale="speed",
        exposure_rationale="daily",
        controllability_rationale="none",
    )
    requirements = tuple(
        Requirement(
            id=name,
            goals=("SG1",),
            text=f"{name} holds",
            formula="always(gap >= 2)",
            threshold_source="made up",
            asil="B",
            allocation=("camera",),
        )
        for name in FSRS
    )
    concept = Concept(
        concept="made_up",
        title="Made up",
        hazardous_events=(event,),
        safety_goals=(goal,),
        elements=(Element(id="camera", kind="sensor", text="camera", asil_capability="B"),),
        requirements=requirements,
    )
    return CampaignRecord(
        odd=ContentRecord("made_up", "1", {"odd": "made_up", "seed": 7}),
        concept=concept,
        fsrs=[CampaignFsr(name, sha(name)) for name in FSRS],
        gate=("new",),
        title="Made up",
        units={name: {"ego_speed": "mps", "gap": "m"} for name in SCENARIOS},
    )


def planned(runs: int, of: str = "") -> Iterator[PlannedCases]:
    """Plan a campaign; structure after structure, the same situations for every architecture.

    Args:
        runs: How many, a multiple of ``STRUCTURES``.
        of: Name of what the situations are of: another one, others.
    """
    for scenario in SCENARIOS:
        content = ContentRecord(scenario, "1", {"scenario": scenario})
        for architecture in ARCHITECTURES:
            built = ContentRecord(architecture, "", {"sensors": architecture})
            for fault in FAULTS:
                for first in range(0, runs // STRUCTURES, PART):
                    points = range(first, min(first + PART, runs // STRUCTURES))
                    names = [sha(f"{of} {scenario} {point}") for point in points]
                    yield _part(scenario, content, architecture, built, fault, points, names)


def _part(  # noqa: PLR0913, PLR0917 - what a part of a plan is
    scenario: str,
    content: ContentRecord,
    architecture: str,
    built: ContentRecord,
    fault: str,
    points: range,
    situations: list[str],
) -> PlannedCases:
    values = [
        {"ego_speed": 20.0 + point % 100 / 10, "gap": 5.0 + point // 100 / 10} for point in points
    ]
    return PlannedCases(
        scenario=scenario,
        scenario_content=content,
        architecture=architecture,
        architecture_content=built,
        fault_entry=fault,
        faults=[] if fault == "none" else [{"id": fault, "start_s": 2.0}],
        seed=7,
        step_s=0.05,
        engine=ENGINE,
        structure=f"{scenario} {architecture} {fault}",
        test_cases=[sha(f"{item} {architecture} {fault}") for item in situations],
        situations=situations,
        parameters=[json_text({**item, "friction": 0.9, "lanes": 3.0}) for item in values],
        points=[json_text(item) for item in values],
        replicates=[0] * len(points),
        inside_odd=[True] * len(points),
        point_index=list(points),
    )


def results(block: Block) -> RunBlock:
    """Make up the results of a block."""
    cases = block.to_execute
    runs, draw = len(cases), np.random.default_rng(cases[0].ordinal)
    digests = tuple(sha(case.test_case) for case in cases)
    pairs = np.repeat(np.arange(runs), 2)
    times = np.tile([0.5, 1.5], runs)
    return RunBlock(
        test_cases=tuple(case.test_case for case in cases),
        engines=(ENGINE,),
        engine=np.zeros(runs, dtype=np.int64),
        outcome=np.full(runs, OUTCOMES.index(Outcome.COMPLETED)),
        outcome_channel=Texts.same(None, runs),
        outcome_detail=Texts.same(None, runs),
        trace_rows=np.full(runs, 301),
        duration_s=np.full(runs, 15.0),
        trace_digests=tuple(digest[:32] for digest in digests),
        realised=np.ones(runs, dtype=np.bool_),
        end_reason=Texts.same("horizon", runs),
        machine_dependent=np.zeros(runs, dtype=np.bool_),
        metrics=_metrics(runs, draw),
        verdicts=_verdicts(runs, draw),
        events=EventBlock(
            pairs,
            times,
            Texts(np.tile([0, 1], runs), Dictionary(("storyboard", "handover"))),
            Texts(np.tile([0, 1], runs), Dictionary(("cutter", "safety"))),
            Texts(np.tile([0, 1], runs), Dictionary(("lane change begins", "confirmed"))),
        ),
        executed_by=Texts.same("host 1", runs),
        executed_at=(None,) * runs,
        chains=tuple(digest[32:] for digest in digests),
        basis=BasisBlock(
            version=1,
            uids={name: f"adeye:{name}@1" for name in METRIC_IDS},
            by_contact=np.zeros(runs, dtype=np.bool_),
            invalid=Texts.same(None, runs),
            extremes=ExtremeBlock(
                run=pairs,
                measure=Texts(np.tile([0, 1], runs), Dictionary(("least gap", "most brake"))),
                value=draw.uniform(0.0, 50.0, 2 * runs),
                time_s=times,
                actor=Texts.same("cutter", 2 * runs),
                samples=Texts.same("[]", 2 * runs),
            ),
        ),
    )


def _metrics(runs: int, draw: Any) -> MetricBlock:
    shape = runs, len(METRIC_IDS)
    value, time_s = np.full(shape, np.nan), np.full(shape, np.nan)
    status = np.full(shape, STATUSES.index("not_applicable"), dtype=np.int8)
    actor = np.full(shape, -1)
    for name in MEASURED:
        place = METRIC_IDS.index(name)
        value[:, place] = draw.uniform(0.0, 100.0, runs)
        time_s[:, place] = draw.integers(0, 300, runs) * 0.05
        status[:, place] = STATUSES.index("value")
        actor[:, place] = draw.integers(0, 2, runs)
    contact = METRIC_IDS.index("contact")
    value[:, contact] = draw.random(runs) < 0.001
    return MetricBlock(METRIC_IDS, value, status, time_s, actor, Dictionary(ACTORS))


def _verdicts(runs: int, draw: Any) -> VerdictBlock:
    rows = runs * len(FSRS)
    verdict = draw.choice([PASS, VACUOUS, FAIL], rows, p=[0.79, 0.2, 0.01])
    margin = np.where(verdict == FAIL, -1.0, 1.0) * draw.uniform(0.0, 30.0, rows)
    numbers = np.full((rows, 6), np.nan)
    columns = margin / 30.0, margin / 30.0, margin, draw.integers(0, 300, rows) * 0.05
    for place, column in enumerate((*columns, margin + 2.0, np.full(rows, 2.0))):
        numbers[:, place] = column
    return VerdictBlock(
        run=np.repeat(np.arange(runs), len(FSRS)),
        fsr_id=Texts(np.tile(np.arange(len(FSRS)), runs), Dictionary(FSRS)),
        fsr_digest=Texts(
            np.tile(np.arange(len(FSRS)), runs), Dictionary(tuple(sha(name) for name in FSRS))
        ),
        verdict=verdict.astype(np.int8),
        exercised=verdict != VACUOUS,
        numbers=numbers,
        unit=Texts.same("m", rows),
        signal=Texts.same("gap", rows),
        predicate=Texts.same("gap >= 2", rows),
        actor=Texts(draw.integers(0, 2, rows), Dictionary(ACTORS)),
        detail=Texts.same(None, rows),
    )
