"""Plan a campaign: load, check everything that can be checked, count; nothing is executed.

Nothing is taken from the environment but the name of the user: it may hold secrets.
"""

from __future__ import annotations

import getpass
import json
import os
import platform
import subprocess
from collections import defaultdict
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from itertools import chain, groupby, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign import check
from adeye.campaign.parts import Parts, load_parts, sources, use_plugin_metrics
from adeye.campaign.selection import PartTags
from adeye.campaign.work import WorkContext, compiled_parts
from adeye.errors import InputError, IntegrityError, SpecError, Together, placed
from adeye.judge.requirements import (
    CheckedRequirement,
    CheckedRequirements,
    JudgedPlan,
    check_demands,
    check_requirements,
)
from adeye.judge.uncertainty import LEAST_PAIRS, judged_digest
from adeye.signals import NO_FAULT
from adeye.simulate.engine import DEFAULT_BACKEND, DRIVER, EngineIdentity, identity
from adeye.spec.architecture import Architecture
from adeye.spec.channels import RemoteChannel
from adeye.spec.fault import FAULT, Injected, idle_faults
from adeye.spec.load import INPUTS, MAPS, OddFiles, load_odd, odd_of
from adeye.spec.odd import Attributes, Distribution, Odd
from adeye.spec.quantity import SI, Record
from adeye.spec.scenario import LogicalScenario
from adeye.store.block import PlannedCases
from adeye.store.records import (
    LEFT_OUT,
    CampaignFsr,
    CampaignRecord,
    ContentRecord,
    EngineKey,
    of_fields,
)
from adeye.store.write.content import FOLDER
from adeye.store.write.queue import NamedCase
from adeye.sweep.case import SCENARIOS, AuthorityOverride, TestCase, structure_key
from adeye.sweep.design import Points, axis_words
from adeye.sweep.distributions import data_digests
from adeye.sweep.expand import Expansion, LazyCases, expand
from adeye.sweep.groups import check_clock
from adeye.sweep.values import named_values, quantity_or_text, written_quantity
from adeye.version import __version__, release_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from adeye.plugins import Part
    from adeye.signals import SignalType
    from adeye.spec.channels import RemoteParameters
    from adeye.store.records import StoredCase

# --- Which runs are executed with half the step, too, and which verdicts they are for -------------


@dataclass(frozen=True)
class Sample:
    """The runs of one scenario and architecture that are executed with half the step too.

    Attributes:
        scenario: Id in the ODD.
        architecture: Id.
        ordinals: Of the test cases, in the order of their situations' digests.
        results: Result digests of the test cases.
    """

    scenario: str
    architecture: str
    ordinals: tuple[int, ...]
    results: tuple[str, ...]


def choose(
    expansion: Expansion, engines: Mapping[str, EngineKey], situations: int
) -> tuple[Sample, ...]:
    """Choose the sample of each scenario and architecture.

    A situation is in it without a fault and with one of its fault entries, as far as it has them.

    Args:
        expansion: The test cases.
        engines: Engine by architecture id.
        situations: How many are chosen, or all if there are fewer.
    """
    found: dict[tuple[str, str], list[tuple[str, bool, str, int]]] = defaultdict(list)
    for section in expansion.sections:
        has_fault = section.group.entry != NO_FAULT
        for columns in expansion.columns(section.first, section.end):
            key = columns.shared.scenario_id, columns.shared.architecture.architecture
            ordinals = range(columns.first, columns.first + len(columns))
            found[key] += [
                (situation, has_fault, case, ordinal)
                for situation, case, ordinal in zip(
                    columns.situation_digest, columns.digest, ordinals, strict=True
                )
            ]
    samples: list[Sample] = []
    for (scenario, architecture), cases in found.items():
        # Of one situation there are as many test cases as fault entries, times what the sweep
        # varies in an architecture.
        alike = groupby(sorted(cases), key=lambda item: item[0])
        several = (list(items) for _, items in islice(alike, situations))
        chosen = [next(kind) for items in several for _, kind in groupby(items, lambda at: at[1])]
        results = engines[architecture].result_digests([case for *_, case, _ in chosen])
        of_plan = tuple(ordinal for *_, ordinal in chosen)
        samples.append(Sample(scenario, architecture, of_plan, tuple(results)))
    return tuple(samples)


def check_samples(plan: CampaignPlan) -> None:
    """Refuse a sample that is too small to tell an uncertainty, which no margin would be held to.

    Raises:
        SpecError: A scenario has too few situations.
    """
    for sample in plan.samples:
        count = len({plan.cases[ordinal].situation_digest for ordinal in sample.ordinals})
        if count < LEAST_PAIRS:
            raise SpecError(
                f"scenario {sample.scenario} has too few situations ({count}) to tell the "
                f"uncertainty: at least {LEAST_PAIRS} are needed",
                where=plan.files.odd.locate(("uncertainty",)),
                remedy="Sweep or replicate it, or leave uncertainty out.",
            )


def judged_with(
    requirement: CheckedRequirement, samples: Sequence[Sample]
) -> dict[tuple[str, str], str]:
    """Give the digest that verdicts with the uncertainty have, by architecture and scenario."""
    return {
        (sample.architecture, sample.scenario): judged_digest(requirement.digest, sample.results)
        for sample in samples
        if concerns(requirement, sample)
    }


def concerns(requirement: CheckedRequirement, sample: Sample) -> bool:
    """Whether an FSR is judged on the scenario and architecture of a sample."""
    named = requirement.requirement.scenarios
    is_applicable = sample.architecture not in requirement.not_applicable
    return is_applicable and (not named or sample.scenario in named)


# --- How the test cases of a scenario were counted, as it is stored with a campaign ---------------


def axes_text(odd: Odd, scenario: str) -> dict[str, str]:
    """Write the axes of a scenario with their levels or distributions.

    Args:
        odd: The ODD.
        scenario: Id of the scenario in it.
    """
    use = next(item for item in odd.scenarios if item.name == scenario)
    axes: dict[str, str] = {}
    for name, axis in use.sweep.parameters.items():
        if isinstance(axis, tuple):
            axes[name] = ", ".join(map(str, axis))
        elif isinstance(axis, Distribution):
            axes[name] = axis_words(axis.model_dump(mode="json"))
        elif isinstance(axis, str):
            axes[name] = axis
        else:
            axes[name] = f"{axis.start} to {axis.to}, step {axis.step}"
    for point in use.sweep.points:
        for name, value in point.items():
            axes[name] = f"{axes[name]}, {value}" if name in axes else str(value)
    return axes


def design_counts(points: Points) -> dict[str, int]:
    """Count what a design looked at for its points, for what may be said about them."""
    if points.drawn is not None:
        return {"drawn": points.drawn, "kept": points.count}
    found = points.tuples
    if found is None:
        return {}
    return {"strength": found.strength, "tuples": found.total, "feasible_tuples": found.feasible}


# --- Where a campaign comes from: tool, packages, machine and processor, git state, who -----------

_PROCESSORS: Final = Path("/proc/cpuinfo")

PACKAGES: Final = (
    "alembic", "gymnasium", "highway-env", "jinja2", "llvmlite", "numba", "numpy", "pandas",
    "pydantic", "pyyaml", "rich", "scipy", "sqlalchemy", "typer",
)  # fmt: skip
"""What adeye depends on, and what compiles its kernels."""
# A repository may name a program that watches its files; looking at it starts none.
_QUIET = ("-c", "core.fsmonitor=false", "--no-optional-locks")


def provenance(odd_path: Path) -> dict[str, Any]:
    """Collect what a reader needs to trust or repeat a campaign.

    Args:
        odd_path: The ODD's file, whose git state is noted.
    """
    return {
        "adeye": __version__,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "host": platform.node(),
        "libm": " ".join(platform.libc_ver()).strip(),
        "cpu": processor(),
        "packages": {name: release_of(name) for name in PACKAGES},
        "git": git_state(odd_path.resolve().parent),
        "odd_path": odd_path.as_posix(),
        "odd_place": odd_path.resolve().as_posix(),
        "who": _user(),
    }


@cache
def processor() -> dict[str, Any]:
    """Name, kind and features of the processor, as the compiler of the kernels sees them."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    return {
        "name": _model() or platform.processor() or platform.machine(),
        "kind": llvm.get_host_cpu_name(),
        "features": sorted(name for name, is_there in features.items() if is_there),
    }


def _model() -> str:
    try:
        lines = _PROCESSORS.read_text("utf-8", "replace").splitlines()
    except OSError:
        return ""
    found = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(found, "")


def git_state(folder: Path) -> dict[str, Any]:
    """Commit of the repository that a folder is in and whether it has changes; empty if none."""
    commit = _git(folder, "rev-parse", "HEAD")
    if not commit:
        return {}
    return {"commit": commit, "is_dirty": bool(_git(folder, "status", "--porcelain"))}


def _git(folder: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(  # noqa: S603 - no shell, our own words
            ["git", *_QUIET, "-C", str(folder), *arguments],  # noqa: S607 - the user's own git
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return ""


# --- Test cases as stored content and back: what makes a run reproducible from the database alone -

FOLDERS: Final = "plugin_folders"
"""Key of a campaign's provenance: folder of each architecture's file, which names its plug-ins.

Not in what is stored of the architecture: its digest would hang on where the files are.
"""


class Contents:
    """Makes one content record for each scenario or architecture record of a plan."""

    def __init__(self) -> None:
        self._made: dict[int, tuple[Record, ContentRecord]] = {}

    def scenario(self, scenario: LogicalScenario) -> ContentRecord:
        """Describe a scenario, overrides applied."""
        return self._of(scenario, scenario.scenario, scenario.provenance.version)

    def architecture(self, architecture: Architecture) -> ContentRecord:
        """Describe an architecture, overrides applied."""
        return self._of(architecture, architecture.architecture, "")

    def _of(self, record: Record, name: str, version: str) -> ContentRecord:
        known = self._made.get(id(record))
        if known is None or known[0] is not record:
            known = (record, ContentRecord(name, version, record.model_dump(mode="json")))
            self._made[id(record)] = known
        return known[1]


def recreate(
    stored: StoredCase, scenario_id: str, odd: Mapping[str, Any], *, inside_odd: bool
) -> TestCase:
    """Make a test case from what the database holds.

    Args:
        stored: The test case.
        scenario_id: Id of the scenario in the ODD.
        odd: Stored content of the ODD.
        inside_odd: Whether its planned attributes lie inside the ODD.

    Raises:
        IntegrityError: What comes out has another digest than what went in.
    """
    architecture = {name: value for name, value in stored.architecture.items() if name != FOLDER}
    fork = stored.fork
    case = TestCase(
        scenario_id=scenario_id,
        scenario=LogicalScenario.model_validate(stored.scenario, context=SI),
        parameters=dict(stored.parameters),
        architecture=Architecture.model_validate(architecture, context=SI),
        faults=tuple(FAULT.validate_python(fault, context=SI) for fault in stored.faults),
        fault_entry=stored.fault_entry,
        replicate=stored.replicate,
        seed=stored.seed,
        step=stored.step_s,
        point={},
        inside_odd=inside_odd,
        attributes=Attributes.model_validate(odd["attributes"], context=SI),
        override=None if fork is None else AuthorityOverride(fork.from_tick, fork.authority),
    )
    if case.digest != stored.test_case:
        raise IntegrityError(
            f"test case {stored.test_case[:12]} does not come out of the database as it went in"
        )
    return case


def folder_of_plugins(
    stored: StoredCase,
    provenances: Iterable[Mapping[str, Any]],
    architecture: str,
    near: Path | None = None,
) -> Path:
    """Find the folder of the file that names the plug-ins of a test case.

    Args:
        stored: The test case; it tells where the folder was if an older release stored it.
        provenances: Where the campaign was planned and executed; the first folder counts that is
            there, else the first.
        architecture: Id of the architecture.
        near: Folder of the database, see ``find_odd``: whoever asks may stand elsewhere, and find
            another project's plug-ins there.
    """
    told = (_folder_told(item, architecture, near) for item in provenances)
    former = stored.architecture.get(FOLDER)
    first: Path | None = None
    for path in chain((None if former is None else Path(former),), told):
        if path is not None:
            first = first or path
            if path.is_dir():
                return path
    return first or Path()


def _folder_told(
    provenance: Mapping[str, Any], architecture: str, near: Path | None
) -> Path | None:
    """Return a folder of plug-ins, which lies to the ODD's file as it did."""
    name = provenance.get(FOLDERS, {}).get(architecture)
    named = str(provenance.get("odd_path", ""))
    if name is None or not named or Path(name).is_absolute():
        return None if name is None else Path(name)
    beside = os.path.relpath(name, Path(named).parent)
    return Path(os.path.normpath(odd_of(provenance, near).parent / beside))


# --- Plan a campaign: load, check everything that can be checked, count; nothing is executed ------


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


@dataclass(frozen=True, slots=True)
class ListedCase(NamedCase):
    """A test case of a plan, for people.

    Attributes:
        ordinal: Its place in the plan, from 0.
        test_case: Digest of its content.
        inside_odd: Whether its planned attributes lie inside the ODD.
        values: Its swept values in the units that were written.
    """

    ordinal: int
    test_case: str
    inside_odd: bool
    values: Mapping[str, str]


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
        left_out: Places of maps that no test case has, see ``check.left_out``.
    """

    path: Path
    files: OddFiles
    expansion: Expansion
    engine: EngineIdentity
    requirements: tuple[CheckedRequirement, ...]
    parts: Mapping[str, Parts]
    notices: tuple[str, ...]
    left_out: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Name the ODD, and count its test cases."""
        return f"<CampaignPlan {self.files.odd.spec.odd}: {self.expansion.count:,} test cases>"

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
        engine = self.engine
        return {
            name: EngineKey(engine.backend, engine.variant, engine.numerics_version, parts.digest)
            for name, parts in self.parts.items()
        }

    @cached_property
    def folders(self) -> dict[str, Path]:
        """Folder of each file that names plug-ins or FMUs: an architecture's, a scenario's."""
        found = {name: item.path.parent for name, item in self.files.architectures.items()}
        for name, item in self.files.scenarios.items():
            if item.spec.drivers:
                found[f"{SCENARIOS}{name}"] = item.path.parent
        return found

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
            odd=ContentRecord(odd.odd, "", self.odd_content()),
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
                    **asdict(factor),
                    "fault_entries": list(factor.fault_entries),
                    "axes": axes_text(odd, factor.scenario),
                    **design_counts(self.expansion.points[factor.scenario]),
                }
                for factor in self.expansion.factors
            ],
            title=odd.title or odd.odd,
            units=self._units(),
            provenance={
                **provenance(self.path),
                INPUTS: self.files.inputs(
                    path for source in sources(self) for path in source.paths()
                ),
                MAPS: self.files.map_notes(),
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

    def listed(self) -> Iterator[ListedCase]:
        """Name every test case for people, in the order of their ordinals."""
        odd = self.odd_content()
        for block in self.planned():
            for at, ordinal in enumerate(block.point_index):
                point = json.loads(block.points[at])
                values = named_values(point, odd, block.scenario)
                yield ListedCase(
                    ordinal=ordinal,
                    test_case=block.test_cases[at],
                    scenario=block.scenario,
                    architecture=block.architecture,
                    fault_entry=block.fault_entry,
                    replicate=block.replicates[at],
                    inside_odd=bool(block.inside_odd[at]),
                    point=block.points[at],
                    values={item.label: item.value for item in values},
                )

    @property
    def tags(self) -> PartTags:
        """What scenarios and architectures are found by."""
        return PartTags(
            {name: item.spec.tags.by_name for name, item in self.files.scenarios.items()},
            {name: item.spec.tags for name, item in self.files.architectures.items()},
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

    def odd_content(self) -> dict[str, Any]:
        """Return the ODD with everything that it names, as it is stored."""
        files = self.files
        data = data_digests(files)
        odd = files.odd.spec.model_dump(mode="json", by_alias=True)
        if odd["uncertainty"] is None:
            # An ODD that does not ask for it is the same content as before there was the key.
            del odd["uncertainty"]
        return {
            **({"data": data} if data else {}),
            # As a map decides which places there are, what an ODD asks for is not all in its text.
            **({LEFT_OUT: _plain(self.left_out)} if self.left_out else {}),
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
        """Return the suffix of the SI unit of each parameter and of each path that is swept."""
        written: dict[str, dict[str, float | str | bool | None]] = {
            name: {key: spec.default for key, spec in item.spec.parameters.items()}
            for name, item in self.files.scenarios.items()
        }
        for use in self.files.odd.spec.scenarios:
            sweep = use.sweep.model_dump(mode="json")
            paths = {*sweep["parameters"], *(key for point in sweep["points"] for key in point)}
            for path in sorted(paths - written[use.name].keys()):
                written[use.name][path] = written_quantity(sweep, path)
        return {
            name: {
                key: dimension.suffix
                for key, text in found.items()
                if text is not None
                and (dimension := quantity_or_text(text)[1]) is not None
                and dimension.suffix
            }
            for name, found in written.items()
        }


def make_plan(
    path: str | Path,
    *,
    backend: str = DEFAULT_BACKEND,
    variant: str | None = None,
    meanwhile: Callable[[CampaignPlan], None] | None = None,
) -> CampaignPlan:
    """Load an ODD and check everything that can be checked before anything runs.

    Args:
        path: The ODD's file.
        backend: Traffic implementation that would execute it.
        variant: Arithmetic of it; None for its first.
        meanwhile: Called with the plan before its formulas are searched, which comes last.

    Raises:
        InputError: Anything is wrong; the message has file, line and column.
    """
    files = load_odd(path, check.check_formulas)
    engine = identity(backend, variant)
    parts, expansion, requirements = _checked(files)
    concept, judged = files.concept, judged_plan(files, parts)
    seen: set[object] = set()
    refused = check.refused_places(expansion, seen)
    expansion = expand(files, refused) if refused else expansion
    left_out = check.left_out(expansion, refused)
    plan = CampaignPlan(
        path=Path(path),
        files=files,
        expansion=expansion,
        engine=engine,
        requirements=requirements,
        parts=parts,
        notices=(*_notices(files), *check.tell_left_out(left_out)),
        left_out=left_out,
    )
    if not plan.cases:
        raise SpecError("the plan has no test cases", where=files.odd.locate(("scenarios",)))
    axes = check.check_cases(expansion, seen)
    alike = *check.same_architectures(files, parts), *check.same_scenarios(expansion)
    idle = tuple(f"fault {name} {why}" for name, why in idle_faults(plan.faults, plan.injected))
    plan = replace(plan, notices=(*plan.notices, *axes, *alike, *idle))
    check_samples(plan)
    if meanwhile is not None:
        meanwhile(plan)
    check_demands(concept.spec, judged, expansion.played(), concept.locate)
    return plan


def _checked(
    files: OddFiles,
) -> tuple[dict[str, Parts], Expansion, CheckedRequirements]:
    """Check files that can be read against each other: plug-ins, sweeps, faults and FSRs.

    What is wrong in one of them is told together with what is wrong in the others. What needs the
    values of test cases comes later: there are none before.
    """
    together = Together()
    metrics: tuple[Part, ...] | None = None
    parts: dict[str, Parts] = {}
    expansion: Expansion | None = None
    requirements: CheckedRequirements | None = None
    with together:
        metrics = _load_metrics(files)
    for name, item in files.architectures.items():
        with together:
            parts[name] = load_parts(item, metrics or ())
    with together:
        expansion = expand(files)
    with together:
        check.check_onsets(files)
    is_loaded = metrics is not None and len(parts) == len(files.architectures)
    if is_loaded:
        with together:
            check.check_hooks(files)
    with together:
        check.check_fits(files)
    if files.odd.spec.uncertainty is not None:
        half = files.odd.spec.step / 2.0
        said = f"uncertainty asks for runs with half the step, {half:g} s; "
        with together, placed(files.odd.locate(("uncertainty",)), said):
            check_clock(files, half)
    if is_loaded:
        # Signals of monitors and metrics are those of plug-ins.
        concept = files.concept
        with together:
            judged = judged_plan(files, parts)
            requirements = check_requirements(concept.spec, judged, concept.locate)
    together.finish()
    # Without either there is an error.
    assert expansion is not None
    assert requirements is not None
    return parts, expansion, requirements


def _load_metrics(files: OddFiles) -> tuple[Part, ...]:
    """Load the ODD's metrics; a message points at the first that is not one."""
    names = files.odd.spec.plugins
    for count in range(1, len(names) + 1):
        where = files.odd.locate(("plugins", count - 1))
        with placed(where, caught=InputError, keeps_place=True):
            use_plugin_metrics(names[:count], files.odd.path.parent)
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
    found: dict[str, tuple[SignalType, dict[str, None], dict[str, None]]] = {}
    for scenario in plan.files.scenarios:
        for architecture in plan.files.architectures:
            for name, kind in plan.judged.dictionary(scenario, architecture).items():
                _, scenarios, architectures = found.setdefault(name, (kind, {}, {}))
                scenarios[scenario] = None
                architectures[architecture] = None
    return [
        of_fields(
            SignalRow,
            kind,
            name=name,
            scenarios=tuple(scenarios),
            architectures=tuple(architectures),
        )
        for name, (kind, scenarios, architectures) in found.items()
    ]


def _plain(left_out: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Leave out why places are refused, which is told in words of this version."""
    return {
        name: {key: sorted(value) if key == "refused" else value for key, value in item.items()}
        for name, item in left_out.items()
    }


def _notices(files: OddFiles) -> Iterator[str]:
    yield from check.over_budget(files.concept.spec)
    for fsr in files.concept.spec.requirements:
        if fsr.unusual_formula:
            yield f"{fsr.id} is meant, although no run was found that decides all of its formula"
    for name, item in files.architectures.items():
        plant = item.spec.vehicle.plant
        if plant is not None and "friction" not in plant.inputs.values():
            yield f"{name}: the FMU of the vehicle is not told the friction: it drives alike on ice"
        for channel, spec in item.spec.channels.items():
            if isinstance(spec, RemoteChannel):
                yield from _at_an_address(f"{name}: channel {channel}", spec.parameters)
            if not spec.links:
                yield f"{name}: channel {channel} has no links, so it cannot act"
            if channel not in item.spec.switch.priority:
                yield f"{name}: channel {channel} is not in switch.priority, so it never acts"


def _at_an_address(who: str, given: RemoteParameters) -> Iterator[str]:
    yield (
        f"{who} is asked at {given.address}; what runs there counts by its word, version "
        f"{given.version}, and its results are marked machine-dependent"
    )
    if not given.place.is_here:
        yield (
            f"{who} is reached unprotected: nothing is encrypted, nobody is authenticated, and "
            "whoever is on the way can read, alter and give answers"
        )
