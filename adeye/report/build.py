"""Build the report of a campaign from the database and from the runs that it re-executes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from adeye.errors import IntegrityError
from adeye.judge.verdict import ExitCode, Outcome, Verdict, exit_code
from adeye.report import concept as sections
from adeye.report import verification
from adeye.report.assessment import assessment_of
from adeye.report.claims import REPORTED_GRID, REPORTED_SAMPLE, designs_of, spoken_of
from adeye.report.comparison.compare import overview
from adeye.report.credibility import determinism, read_result
from adeye.report.evidence import evidence_of, step_statements
from adeye.report.faults import fault_evidence
from adeye.report.metrics import dead_axes, summarise
from adeye.report.model.assessment import FaultEvidence
from adeye.report.model.part import Label
from adeye.report.model.report import Cell, MapNote, Report, WorstCase
from adeye.report.page.replay import Replay, Undrawn
from adeye.report.where.maps import map_failures
from adeye.report.where.records import FailureMaps
from adeye.spec.concept import Concept, Requirement
from adeye.spec.load import MAPS, odd_of
from adeye.spec.quantity import SI
from adeye.store.location import option
from adeye.store.read.bulk import Figures
from adeye.store.read.checking import PLAN_RULES, check_campaign
from adeye.store.read.totals import (
    Total,
    channel_failures,
    explained,
    gate_code,
    in_gate,
    preventable_by,
    standing_for,
    totals,
)
from adeye.store.records import CampaignInfo, FsrStatus, RunRef, VerdictRecord
from adeye.store.repository import Repository
from adeye.store.rules import RULES
from adeye.sweep.values import named_values

SHORT = 12
"""Characters of a result digest that commands and tables show."""
WORST_PER_FSR = 3
MAX_WORST = 40
MAX_REPLAYS = 16
MAX_READ = 10_000
"""Test cases up to which a report asks every integrity rule."""
_LOOKED_AT = 500
"""Runs whose verdicts are read at once."""


@dataclass(frozen=True, slots=True)
class ReplayRequest:
    """A run to draw, and what the page says about it."""

    run: RunRef
    why: str


Draw = Callable[[Sequence[ReplayRequest]], Sequence[Replay | Undrawn]]


def drawn_in(drawn: Sequence[Replay | Undrawn], answer: tuple[ExitCode, str]) -> dict[str, Any]:
    """Give what a report has of runs that were drawn, by the names of its fields.

    Args:
        drawn: What came of drawing them.
        answer: Exit code and message without them.
    """
    code, message = answer
    undrawn = tuple(item for item in drawn if isinstance(item, Undrawn))
    if undrawn:
        code = exit_code([code, ExitCode.INTEGRITY])
        message = "; ".join([*map(str, undrawn), message])
    return {
        "replays": tuple(item for item in drawn if isinstance(item, Replay)),
        "undrawn": undrawn,
        "exit_code": code,
        "message": message,
    }


@dataclass(frozen=True)
class ReportBuilder:
    """Reads one campaign.

    Attributes:
        repository: The database.
        campaign: The campaign.
        database: How commands name the database; empty for the default.
        created: UTC time for the page, None to reproduce its bytes.
        is_verified: Whether every row was compared already, and whoever did so tells.
    """

    repository: Repository
    campaign: CampaignInfo
    database: str = ""
    created: str | None = None
    is_verified: bool = False

    @cached_property
    def concept(self) -> Concept:
        """The concept that judged the campaign."""
        content = self.repository.content("concept", self.campaign.concept_digest)
        return Concept.model_validate(content, context=SI)

    @cached_property
    def odd(self) -> Mapping[str, Any]:
        """Stored content of the ODD and everything that it names."""
        content: Mapping[str, Any] = self.repository.content("odd", self.campaign.odd_digest)
        return content

    @cached_property
    def status(self) -> tuple[FsrStatus, ...]:
        """Verdicts by FSR, architecture and scenario."""
        return self.repository.fsr_status(self.campaign.id)

    @cached_property
    def requirements(self) -> dict[str, Requirement]:
        """FSRs by id."""
        return {item.id: item for item in self.concept.requirements}

    @cached_property
    def figures(self) -> Figures:
        """What was executed, as columns."""
        return self.repository.figures(self.campaign.id)

    def _run_of(self, ordinal: int) -> str:
        """Result digest of the run of an ordinal."""
        return self.repository.find_run(str(ordinal), campaign=self.campaign.id).result_digest

    def build(self, draw: Draw, *, replays: int = MAX_REPLAYS) -> Report:
        """Put the report together.

        Args:
            draw: Re-executes runs and draws them.
            replays: Most runs to embed.
        """
        provenance = self.campaign.provenance
        # What the files say now has lines; what was stored has none.
        near = self.repository.location.beside.parent
        later = [item.provenance for item in self.repository.evidence.sessions(self.campaign.id)]
        odd_path = str(odd_of(provenance, near, later)) if provenance.get("odd_path") else ""
        places = sections.places_of(odd_path, self.odd, self.concept, near)
        rules = RULES if self.is_read_whole else PLAN_RULES
        checked = check_campaign(self.repository.location, self.campaign.id, rules=rules)
        assert checked is not None
        content = sections.CampaignContent(
            self.campaign, self.concept, self.odd, places, checked.fsr_digests
        )
        cells = tuple(self._cells())
        factors = tuple(sections.factors_of(content))
        answer = self._answer()
        known = self.repository.evidence.root(self.campaign.id)
        worst = self._worst_cases()
        progress = self.repository.progress(self.campaign.id)
        report = Report(
            title=self.campaign.title or self.campaign.odd,
            odd=self.campaign.odd,
            odd_digest=self.campaign.odd_digest,
            tool_version=str(provenance.get("adeye", "")),
            numerics_version=str(provenance.get("numerics_version", "")),
            created=self.created,
            campaign=self.campaign.id,
            database=self.repository.location.beside.name,
            concept=self.concept.concept,
            concept_title=self.concept.title,
            concept_digest=self.campaign.concept_digest,
            evidence_digest="" if known is None else known.root,
            determinism=determinism(
                str(provenance.get("backend", "")), str(provenance.get("variant", ""))
            ),
            maps=tuple(
                MapNote(name=name, **counts) for name, counts in provenance.get(MAPS, {}).items()
            ),
            statements=self._statements(),
            planned=progress.planned,
            accounted=progress.accounted,
            outcomes=self._outcomes(),
            machine_dependent=int(self.figures.machine_dependent.sum()),
            contacts=self.repository.contacts(self.campaign.id),
            channel_failures=channel_failures(self.repository, self.campaign),
            command=self._command(f"adeye run {provenance.get('odd_path', self.campaign.odd)}"),
            where=places.odd,
            architectures=tuple(sections.architectures_of(content)),
            scenarios=tuple(sections.scenarios_of(content)),
            factors=factors,
            fsrs=tuple(sections.fsr_of(content, item) for item in self.concept.requirements),
            cells=cells,
            comparison=overview(self.repository, self.campaign, self.odd),
            worst_cases=worst,
            dead_axes=tuple(dead_axes(self.figures, self.odd, self._command)),
            metrics=tuple(summarise(self.figures, self._run_of, self.replay_command)),
            faults=self._faults(),
            assessment=assessment_of(
                self.repository,
                self.campaign,
                self.concept,
                self.figures,
                (self._command, self.replay_command),
            ),
            **sections.concept_of(content, cells),
            integrity_rules=len(rules),
            findings=tuple(sections.findings_of(checked.violations)),
            odd_attributes=tuple(sections.attributes_of(content)),
            realisations=tuple(
                verification.realisations_of(factors, designs_of(self.odd), self.figures)
            ),
            dependencies=tuple(sections.dependencies_of(content)),
            suites=tuple(sections.suites_of(content)),
            self_test=read_result(self.repository.location.beside.parent, provenance),
            **drawn_in(draw(self._requests(worst)[:replays]) if replays else (), answer),
            **evidence_of(self.repository, self.campaign, self.odd, self._command),
        )
        rows = verification.verification_of(report, self.requirements, designs_of(self.odd))
        told = {
            "verification": tuple(rows),
            "open_points": verification.open_points_of(report),
            "failing": self._failing(report),
        }
        return report.model_copy(update=told)

    def _failing(self, report: Report) -> FailureMaps | None:
        """Say where FSRs fail, of the gate's architectures first."""
        failing = [
            (fsr.id, architecture.id)
            for architecture in report.gate_first
            for fsr in report.urgent_first([architecture])
            for cell in [report.cell(fsr.id, architecture.id)]
            if cell is not None and cell.verdict is Verdict.FAIL
        ]
        if not failing:
            return None
        names = list(dict.fromkeys(name for _, name in failing))
        compared = self.repository.compared(self.campaign.id, names, is_named=True)
        return map_failures(failing, compared, self.odd, self._command)

    @property
    def is_read_whole(self) -> bool:
        """Whether the campaign is small enough to ask every integrity rule."""
        return self.campaign.planned <= MAX_READ

    def _answer(self) -> tuple[ExitCode, str]:
        """Decide the exit code and say why; rows that are not as they were written come first."""
        has_old, evidence = not self.is_verified, self.repository.evidence
        code, message = gate_code(self.repository, self.campaign, has_old=has_old)
        if has_old and code is not ExitCode.INTEGRITY:
            # Who has made hashes and ledger agree with what was altered has not made the root so.
            try:
                evidence.require_root(evidence.computed_root(self.campaign.id))
            except IntegrityError as error:
                return ExitCode.INTEGRITY, str(error)
        return code, message

    def _statements(self) -> tuple[str, ...]:
        designs = designs_of(self.odd)
        found = self.repository.hindsight.half_steps.uncertainty(self.campaign.id)
        spoken = spoken_of(designs, designs, drawn=REPORTED_SAMPLE, fixed=REPORTED_GRID)
        return (*spoken, *step_statements([item.difference for item in found]))

    def _outcomes(self) -> Counter[Outcome]:
        """Count the runs by outcome."""
        column = self.figures.outcome
        counts = np.bincount(column.codes, minlength=len(column.words)).tolist()
        return Counter(
            {Outcome(word): count for word, count in zip(column.words, counts, strict=True)}
        )

    def _faults(self) -> FaultEvidence:
        known, campaign = self.repository.hindsight, self.campaign.id
        return fault_evidence(
            self.figures,
            self.odd,
            (known.injections(campaign), known.takeovers(campaign)),
            (
                lambda verb: self._command(f"adeye {verb} {campaign[:10]} --sample 0"),
                self.replay_command,
            ),
        )

    # Commands

    def _command(self, text: str) -> str:
        return f"{text}{option(self.database)}"

    def replay_command(self, run: str) -> str:
        """Command line that executes a run again."""
        return self._command(f"adeye replay {run[:SHORT]}")

    # Verdicts

    def _cells(self) -> Iterable[Cell]:
        aside: dict[tuple[str, str], str] = {}
        models = preventable_by(self.repository, self.campaign)
        for total in totals(self.repository, self.campaign):
            cell = self._total(total, models)
            if cell.is_set_aside:
                aside[cell.fsr, cell.architecture] = cell.note
            yield cell
        for item in self.status:
            key = item.fsr, item.architecture
            if item.scenario and item.is_applicable:
                worst = standing_for(
                    self.repository, self.campaign, item, item.verdict, item.scenario
                )
                run, record = worst[0] if worst else (None, None)
                is_aside = key in aside and item.verdict is Verdict.FAIL
                yield Cell.of(
                    item,
                    counts={key: count for key, count in item.counts.items() if count},
                    runs=sum(item.counts.values()),
                    min_exercised=1,
                    note=aside[key] if is_aside else explained(record) if record else "",
                    is_set_aside=is_aside,
                    **self._worst(run, record),
                )

    def _total(self, total: Total, models: Sequence[str]) -> Cell:
        is_asked = total.verdict is not None
        standing = standing_for(self.repository, self.campaign, total, total.verdict)
        run, record = standing[0] if is_asked and standing else (None, None)
        none = {} if is_asked else {"counts": {}, "exercised": 0, "runs": 0}
        decides = total.is_in_gate and total.is_mandatory
        verdict, why = in_gate(self.repository, self.campaign, total, models if decides else ())
        return Cell.of(
            total,
            scenario=None,
            note=why or total.note or (explained(record) if record else ""),
            is_set_aside=total.verdict is Verdict.FAIL and verdict is Verdict.PASS,
            **none,
            **self._worst(run, record),
        )

    def _worst(self, run: RunRef | None, record: VerdictRecord | None) -> dict[str, Any]:
        if run is None or record is None:
            command = self._command("adeye query failing-fsrs")
            return {"margin": None, "binding": None, "worst_run": None, "command": command}
        return {
            "margin": verification.margin_of(record),
            "binding": verification.binding_of(record),
            "worst_run": run.result_digest,
            "command": self.replay_command(run.result_digest),
        }

    def _worst_cases(self) -> tuple[WorstCase, ...]:
        found: list[tuple[float, WorstCase]] = []
        figures = self.figures
        for fsr in self.requirements:
            for architecture in self.odd["architectures"]:
                badness = -math.inf
                for run, record in self.repository.worst_runs(
                    self.campaign.id, fsr, architecture=architecture, limit=WORST_PER_FSR
                ):
                    place = int(np.searchsorted(figures.ordinal, run.ordinal))
                    values = named_values(figures.point(place), self.odd, run.scenario)
                    case = WorstCase(
                        fsr=fsr,
                        architecture=architecture,
                        scenario=run.scenario,
                        run=run.result_digest,
                        verdict=record.verdict,
                        outcome=Outcome(figures.outcome[place]),
                        fault=figures.fault_entry[place],
                        parameters=tuple(map(Label.of, values)),
                        margin=verification.margin_of(record),
                        binding=verification.binding_of(record),
                        command=self.replay_command(run.result_digest),
                    )
                    rank = 0.0 if record.verdict is Verdict.FAIL else 1e6
                    # Between FSRs by robustness, which has no unit; of one FSR in its own order.
                    badness = max(badness, rank + (record.robustness_low or 0.0))
                    found.append((badness, case))
        found.sort(key=lambda pair: (pair[0], pair[1].fsr))
        return tuple(case for _, case in found[:MAX_WORST])

    def _requests(self, worst: Sequence[WorstCase]) -> list[ReplayRequest]:
        """Choose the runs to draw: the worst of each failing FSR, one passing run per scenario."""
        chosen: dict[str, ReplayRequest] = {}
        per_fsr: Counter[tuple[str, str]] = Counter()
        for case in worst:
            if case.verdict is not Verdict.FAIL or case.run in chosen:
                continue
            if per_fsr[case.fsr, case.architecture] < 2:
                per_fsr[case.fsr, case.architecture] += 1
                run = self.repository.find_run(case.run, campaign=self.campaign.id)
                chosen[case.run] = ReplayRequest(
                    run, f"worst of {case.fsr} for {case.architecture}"
                )
        for scenario in self.odd["scenarios"]:
            passing = self._closest_passing(scenario)
            if passing is not None and passing.result_digest not in chosen:
                chosen[passing.result_digest] = ReplayRequest(
                    passing, f"closest passing run of {scenario}"
                )
        return list(chosen.values())

    def _closest_passing(self, scenario: str) -> RunRef | None:
        """Find the run without a FAIL that came nearest, best of the gate's and without a fault."""
        own = self.figures.of_scenario(scenario)
        order = [*self.campaign.gate, *self.odd["architectures"]]
        ranks = np.array([order.index(word) for word in own.architecture.words], dtype=np.int64)
        has_fault = np.array([word != "none" for word in own.fault_entry.words], dtype=np.bool_)
        # NaN, no distance at all, is sorted last.
        keys = (
            own.metrics["min_distance_m"],
            has_fault[own.fault_entry.codes],
            ranks[own.architecture.codes],
        )
        ordinals = own.ordinal[np.lexsort(keys)].tolist()
        for first in range(0, len(ordinals), _LOOKED_AT):
            looked_at = ordinals[first : first + _LOOKED_AT]
            failed = self.repository.hindsight.failed_among(self.campaign.id, looked_at)
            for ordinal in looked_at:
                if ordinal not in failed:
                    return self.repository.find_run(str(ordinal), campaign=self.campaign.id)
        return None
