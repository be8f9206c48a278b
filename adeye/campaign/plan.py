"""Plan a campaign: load, check everything that can be checked, count; nothing is executed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adeye.campaign.check import (
    check_cases,
    check_fits,
    check_hooks,
    check_onsets,
    check_scenarios,
    over_budget,
    same_architectures,
    same_scenarios,
)
from adeye.campaign.content import FOLDERS, Contents
from adeye.campaign.factors import axes_text, design_counts
from adeye.campaign.metrics import use_plugin_metrics
from adeye.campaign.parts import Parts, load_parts
from adeye.campaign.provenance import provenance
from adeye.campaign.sample import Sample, check_half_step, choose, judged_with
from adeye.campaign.work import WorkContext, compiled_parts
from adeye.engine import DEFAULT_BACKEND, DRIVER, EngineIdentity, identity
from adeye.errors import InputError, SpecError
from adeye.evaluation.requirements import CheckedRequirement, JudgedPlan, check_requirements
from adeye.spec.faults.idle import idle_faults
from adeye.spec.load import OddFiles, load_odd
from adeye.store.planned import PlannedCases
from adeye.store.rows import CampaignFsr, CampaignRecord, ContentRecord, EngineKey
from adeye.sweep.axes import quantity_or_text
from adeye.sweep.declared import data_digests
from adeye.sweep.expand import Expansion, expand
from adeye.sweep.sequence import LazyCases
from adeye.sweep.structure import structure_key
from adeye.units import Dimension

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from adeye.registry import Part
    from adeye.signals import SignalType
    from adeye.spec.faults.idle import Injected
    from adeye.sweep.case import TestCase

SUFFIXES = {
    Dimension.LENGTH: "m",
    Dimension.TIME: "s",
    Dimension.SPEED: "mps",
    Dimension.RAIN_RATE: "mps",
    Dimension.ACCELERATION: "mps2",
    Dimension.JERK: "mps3",
    Dimension.ANGLE: "rad",
    Dimension.ANGULAR_RATE: "radps",
    Dimension.FREQUENCY: "hz",
    Dimension.CURVATURE: "pm",
}
"""SI suffix of a parameter's column, by dimension."""


@dataclass(frozen=True)
class SignalRow:
    """A signal that an FSR of the ODD may name.

    Attributes:
        name: In formulas.
        unit: SI unit.
        kind: ``number``, ``boolean`` or ``enumeration``.
        scale: Size of one unit of robustness.
        text: What it means.
        labels: Words of an enumeration.
        scenarios: Where it exists.
        architectures: Which have it.
    """

    name: str
    unit: str
    kind: str
    scale: float
    text: str
    labels: tuple[str, ...]
    scenarios: tuple[str, ...]
    architectures: tuple[str, ...]


@dataclass(frozen=True)
class CampaignPlan:
    """A checked plan.

    Attributes:
        path: The ODD's file.
        files: The ODD and everything that it names.
        expansion: Its test cases, counted.
        engine: What would execute them.
        requirements: FSRs, checked against scenarios and architectures.
        parts: Plug-ins and monitors by architecture.
        notices: What the user should know; not errors.
    """

    path: Path
    files: OddFiles
    expansion: Expansion
    engine: EngineIdentity
    requirements: tuple[CheckedRequirement, ...]
    parts: Mapping[str, Parts]
    notices: tuple[str, ...]

    @property
    def driver(self) -> str:
        """Name of the driver that would execute it."""
        return DRIVER

    @cached_property
    def cases(self) -> Sequence[TestCase]:
        """Every test case, by ordinal, made when it is asked for."""
        return LazyCases(self.expansion)

    @property
    def is_compiled(self) -> bool:
        """Whether nothing in a tick is Python code of somebody else, so that threads pay."""
        has_plugins = any(parts.plugins or parts.files for parts in self.parts.values())
        return self.engine.backend == "batch" and not has_plugins

    @property
    def faults(self) -> tuple[str, ...]:
        """Fault ids of the ODD."""
        return tuple(fault.id for fault in self.files.odd.spec.faults)

    @property
    def injected(self) -> Iterator[Injected]:
        """The faults of each section with its architecture, values of the sweep applied."""
        shared = (self.expansion.shared(section) for section in self.expansion.sections)
        return ((item.faults, item.architecture) for item in shared)

    @cached_property
    def judged(self) -> JudgedPlan:
        """What its FSRs are judged on."""
        return judged_plan(self.files, self.parts)

    @cached_property
    def engines(self) -> dict[str, EngineKey]:
        """Engine by architecture id."""
        return {
            name: EngineKey(
                self.engine.backend,
                self.engine.variant,
                self.engine.numerics_version,
                parts.digest,
            )
            for name, parts in self.parts.items()
        }

    @cached_property
    def folders(self) -> dict[str, Path]:
        """Folder of each architecture's file, where its plug-ins are looked for."""
        return {name: item.path.parent for name, item in self.files.architectures.items()}

    @cached_property
    def samples(self) -> tuple[Sample, ...]:
        """What is executed with half the step too; nothing unless the ODD asks for it."""
        asked = self.files.odd.spec.uncertainty
        return () if asked is None else choose(self.expansion, self.engines, asked.situations)

    @property
    def work(self) -> WorkContext:
        """What every block of the campaign shares."""
        return WorkContext(
            backend=self.engine.backend,
            variant=self.engine.variant,
            engines=self.engines,
            folders=self.folders,
            requirements=self.files.concept.spec.requirements,
            faults=self.faults,
            metrics=self.files.odd.spec.plugins,
            odd_folder=self.path.parent,
        )

    def record(self) -> CampaignRecord:
        """Describe the campaign for the database."""
        odd = self.files.odd.spec
        return CampaignRecord(
            odd=ContentRecord(odd.odd, "", self._odd_content()),
            concept=self.files.concept.spec,
            fsrs=[
                CampaignFsr(
                    item.requirement.id,
                    item.digest,
                    dict(item.not_applicable),
                    judged_with(item, self.samples),
                )
                for item in self.requirements
            ],
            gate=self.files.gate,
            factors=[
                {
                    "scenario": factor.scenario,
                    "architecture": factor.architecture,
                    "raw": factor.raw,
                    "points": factor.points,
                    "fault_entries": list(factor.fault_entries),
                    "replicates": factor.replicates,
                    "test_cases": factor.test_cases,
                    "axes": axes_text(self.files.odd.spec, factor.scenario),
                    **design_counts(self.expansion.points[factor.scenario]),
                }
                for factor in self.expansion.factors
            ],
            title=odd.title or odd.odd,
            units=self._units(),
            provenance={
                **provenance(self.path),
                FOLDERS: {name: folder.as_posix() for name, folder in self.folders.items()},
                "numerics_version": self.engine.numerics_version,
                "driver": self.driver,
                "backend": self.engine.backend,
                "variant": self.engine.variant,
            },
        )

    def planned(self) -> Iterator[PlannedCases]:
        """Describe the test cases for the database, in the order of their ordinals."""
        contents = Contents()
        for columns in self.expansion.columns():
            shared = columns.shared
            name = shared.architecture.architecture
            yield PlannedCases(
                scenario=shared.scenario_id,
                scenario_content=contents.scenario(shared.scenario),
                architecture=name,
                architecture_content=contents.architecture(shared.architecture),
                fault_entry=shared.fault_entry,
                faults=[fault.model_dump(mode="json") for fault in shared.faults],
                seed=shared.seed,
                step_s=shared.step,
                engine=self.engines[name],
                structure=structure_key(shared),
                test_cases=columns.digest,
                situations=columns.situation_digest,
                parameters=columns.parameters_json,
                points=columns.point_json,
                replicates=columns.replicate,
                inside_odd=columns.inside_odd,
                point_index=range(columns.first, columns.first + len(columns)),
            )

    @property
    def compiled_parts(self) -> frozenset[str]:
        """Names of what is compiled for these architectures and not for every one."""
        work = self.work
        parts = (compiled_parts(item.spec, work) for item in self.files.architectures.values())
        return frozenset().union(*parts)

    def examples(self) -> list[TestCase]:
        """Make the first test case of each structure."""
        found: dict[str, TestCase] = {}
        for section in self.expansion.sections:
            key = structure_key(self.expansion.shared(section))
            if key not in found:
                found[key] = self.cases[section.first]
        return list(found.values())

    def _odd_content(self) -> dict[str, Any]:
        files = self.files
        data = data_digests(files)
        odd = files.odd.spec.model_dump(mode="json", by_alias=True)
        if odd["uncertainty"] is None:
            # An ODD that does not ask for it is the same content as before there was the key.
            del odd["uncertainty"]
        return {
            **({"data": data} if data else {}),
            "odd": odd,
            "scenarios": {
                name: item.spec.model_dump(mode="json") for name, item in files.scenarios.items()
            },
            "architectures": {
                name: item.spec.model_dump(mode="json")
                for name, item in files.architectures.items()
            },
        }

    def _units(self) -> dict[str, dict[str, str]]:
        units: dict[str, dict[str, str]] = {}
        for name, item in self.files.scenarios.items():
            units[name] = {}
            for parameter, spec in item.spec.parameters.items():
                _, dimension = quantity_or_text(spec.default)
                if dimension in SUFFIXES:
                    units[name][parameter] = SUFFIXES[dimension]
        return units


def make_plan(
    path: str | Path, *, backend: str = DEFAULT_BACKEND, variant: str | None = None
) -> CampaignPlan:
    """Load an ODD and check everything that can be checked before anything runs.

    Args:
        path: The ODD's file.
        backend: Traffic implementation that would execute it.
        variant: Arithmetic of it; None for its first.

    Raises:
        InputError: Anything is wrong; the message has file, line and column.
    """
    files = load_odd(path)
    check_scenarios(files)
    engine = identity(backend, variant)
    metrics = _load_metrics(files)
    parts = {name: load_parts(item, metrics) for name, item in files.architectures.items()}
    expansion = expand(files)
    check_onsets(files)
    check_hooks(files)
    check_fits(files)
    if files.odd.spec.uncertainty is not None:
        check_half_step(files)
    requirements = check_requirements(
        files.concept.spec, judged_plan(files, parts), files.concept.locate
    )
    plan = CampaignPlan(
        path=Path(path),
        files=files,
        expansion=expansion,
        engine=engine,
        requirements=requirements,
        parts=parts,
        notices=tuple(_notices(files)),
    )
    if not plan.cases:
        raise SpecError("the plan has no test cases", where=files.odd.locate(("scenarios",)))
    axes = check_cases(expansion)
    alike = *same_architectures(files, parts), *same_scenarios(expansion)
    idle = tuple(f"fault {name} {why}" for name, why in idle_faults(plan.faults, plan.injected))
    return replace(plan, notices=(*plan.notices, *axes, *alike, *idle))


def _load_metrics(files: OddFiles) -> tuple[Part, ...]:
    """Load the ODD's metrics; a message points at the first that is not one."""
    names = files.odd.spec.plugins
    for count in range(1, len(names) + 1):
        where = files.odd.locate(("plugins", count - 1))
        try:
            use_plugin_metrics(names[:count], files.odd.path.parent)
        except InputError as error:
            if error.where is not None:
                raise
            raise SpecError(error.message, where=where, remedy=error.remedy) from error
    return use_plugin_metrics(names, files.odd.path.parent)


def judged_plan(files: OddFiles, parts: Mapping[str, Parts]) -> JudgedPlan:
    """Say what FSRs are checked against."""
    return JudgedPlan(
        scenarios={name: item.spec for name, item in files.scenarios.items()},
        architectures={name: item.spec for name, item in files.architectures.items()},
        gate=files.gate,
        step=files.odd.spec.step,
        faults=tuple(fault.id for fault in files.odd.spec.faults),
        monitors={name: item.monitors for name, item in parts.items()},
        attributes=files.odd.spec.attributes,
    )


def signal_table(plan: CampaignPlan) -> list[SignalRow]:
    """List every signal that an FSR of the ODD may name, and who has it."""
    judged = judged_plan(plan.files, plan.parts)
    found: dict[str, tuple[SignalType, dict[str, None], dict[str, None]]] = {}
    for scenario in plan.files.scenarios:
        for architecture in plan.files.architectures:
            for name, kind in judged.dictionary(scenario, architecture).items():
                _, scenarios, architectures = found.setdefault(name, (kind, {}, {}))
                scenarios[scenario] = None
                architectures[architecture] = None
    return [
        SignalRow(
            name=name,
            unit=kind.unit,
            kind=kind.kind,
            scale=kind.scale,
            text=kind.text,
            labels=kind.labels,
            scenarios=tuple(scenarios),
            architectures=tuple(architectures),
        )
        for name, (kind, scenarios, architectures) in found.items()
    ]


def _notices(files: OddFiles) -> Iterator[str]:
    yield from over_budget(files.concept.spec)
    for name, item in files.architectures.items():
        for channel, spec in item.spec.channels.items():
            if not spec.links:
                yield f"{name}: channel {channel} has no links, so it cannot act"
            if channel not in item.spec.switch.priority:
                yield f"{name}: channel {channel} is not in switch.priority, so it never acts"
