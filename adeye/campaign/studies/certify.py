"""Certify that a campaign is deterministic: execute a sample again under other conditions."""

from __future__ import annotations

import hashlib
import os
import platform
from collections import defaultdict
from contextlib import closing, contextmanager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

import numpy as np

from adeye.campaign.executors import InProcess, Processes, Threads
from adeye.campaign.naming import find_called, is_file_name, planned_as
from adeye.campaign.replay import Counter, recalled_parts, same_ticks
from adeye.campaign.run import Progress, fitting
from adeye.campaign.work import BatchTask, WorkContext, execute, grouped
from adeye.errors import PlatformError, UsageError
from adeye.identity import split_links
from adeye.judge.evaluate import MARGIN
from adeye.judge.outcome import OUTCOMES
from adeye.judge.verdict import STATUSES, VERDICTS
from adeye.kernel.jit import cache_directory
from adeye.simulate.channels.factory import HOSTED
from adeye.spec.concept import Concept
from adeye.spec.load import odd_of
from adeye.spec.quantity import SI
from adeye.store.evidence.roots import CertificateRecord, Executed
from adeye.store.records import EngineKey, MetricValue, of_fields, of_row
from adeye.store.repository import Repository
from adeye.sweep.case import TestCase, structure_key
from adeye.trace import LINK_TICKS
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan
    from adeye.ports import Executor
    from adeye.store.block import MetricBlock, RunBlock
    from adeye.store.records import CampaignInfo, RunRef, StoredRun

# --- Conditions that no result may depend on: batches, orders, lanes, what the processor can do ---

Task = TypeVar("Task")
Result = TypeVar("Result")

Order = Literal["planned", "reversed", "shuffled"]

_ONE: Final = {"here": "here", "threads": "thread", "processes": "process"}
_GLIBC: Final = "-AVX2,-FMA,-AVX2_Usable,-FMA_Usable,-FMA4"
"""What the mathematical library chooses its code by; names of older and newer releases of it."""


@dataclass(frozen=True)
class Mask:
    """A processor that can do less, imitated in child processes.

    Attributes:
        name: For people.
        environment: Variables that hide what this processor can do.
    """

    name: str
    environment: Mapping[str, str]

    @contextmanager
    def applied(self) -> Iterator[None]:
        """Let processes that are started meanwhile have it; this one has read its variables."""
        before = {name: os.environ.get(name) for name in self.environment}
        os.environ.update(self.environment)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value


@dataclass(frozen=True)
class Condition:
    """How a sample is executed.

    Attributes:
        batch: Most runs in a batch.
        order: Of the sample.
        kind: ``here``, ``threads`` or ``processes``.
        lanes: How many of these.
        mask: What the processor may not do; None for nothing.
    """

    batch: int
    order: Order
    kind: Literal["here", "threads", "processes"] = "here"
    lanes: int = 1
    mask: Mask | None = None

    @property
    def name(self) -> str:
        """For people, and the same every time."""
        kind = self.kind if self.lanes > 1 else _ONE[self.kind]
        where = "in this process" if self.kind == "here" else f"in {self.lanes} {kind}"
        masked = f", {self.mask.name}" if self.mask else ""
        return f"batches of {self.batch:,}, {self.order}, {where}{masked}"

    def batches(self, cases: Iterable[TestCase], most: int) -> list[tuple[TestCase, ...]]:
        """Order test cases and cut them into batches of one structure.

        Args:
            cases: In the order of the plan.
            most: Runs that fit into memory together.
        """
        size = max(1, min(self.batch, most))
        return list(map(tuple, grouped(self._ordered(list(cases)), structure_key, size)))

    def _ordered(self, cases: list[TestCase]) -> list[TestCase]:
        if self.order == "planned":
            return cases
        if self.order == "reversed":
            return cases[::-1]
        return sorted(cases, key=lambda case: _drawn(f"{self.batch} {self.lanes} {case.digest}"))

    def executor(self, work: Callable[[Task], Result]) -> Executor[Task, Result]:
        """Make what executes batches under it."""
        if self.kind == "processes":
            return Processes(work, self.lanes)
        return Threads(work, self.lanes) if self.kind == "threads" else InProcess(work)


CONDITIONS: Final = (
    Condition(1, "shuffled", "processes", 2),
    Condition(7, "reversed"),
    Condition(64, "shuffled", "threads", 2),
    Condition(64, "planned", "processes"),
    Condition(1024, "planned", "threads", 4),
)
"""A result has been seen under one condition; these differ from it and from each other."""


def masks() -> tuple[Mask, ...]:
    """List the lesser processors that this machine can imitate.

    Each hides from one of three what they choose their code by: the mathematical library of the
    system, NumPy, and the compiler of the kernels, whose code then has a folder of its own.
    """
    found = []
    if platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc":
        hidden = f"glibc.cpu.hwcaps={_GLIBC}"
        found.append(Mask("libm without AVX2 and FMA", {"GLIBC_TUNABLES": hidden}))
    features = _numpy_features()
    if features:
        disabled = {"NPY_DISABLE_CPU_FEATURES": " ".join(features)}
        found.append(Mask(f"NumPy without {', '.join(features)}", disabled))
    folder = cache_directory()
    cached = str(folder.with_name(f"{folder.name}-generic"))
    generic = {"NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": cached}
    found.append(Mask("kernels for any processor", generic))
    return tuple(found)


def _numpy_features() -> Sequence[str]:
    """List what NumPy has code for, this processor can do, and can be hidden."""
    core: Any = getattr(np, "_core", None) or np.core
    inside = core._multiarray_umath
    dispatched = getattr(inside, "__cpu_dispatch__", ())
    return [name for name in dispatched if inside.__cpu_features__.get(name)]


def _drawn(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


# --- Hold executions against what is stored: which runs differ, in what, and from when on ---------

TRACE: Final = "trace"


@dataclass(frozen=True, slots=True)
class Finding:
    """A run that does not come out as it is stored.

    Attributes:
        run: Result digest.
        scenario: Id in the ODD.
        architecture: Id.
        fault_entry: ``none``, a fault's id, or ids joined by ``+``.
        conditions: Under which it differs.
        differs: What differs: ``trace``, ``outcome``, ids of metrics, and of FSRs by their verdict.
        first_tick: Ticks that are as stored before the first that is known to differ, in steps of
            ``LINK_TICKS``; None where the trace does not differ or no chain is stored.
        traces: Different traces that it had, the stored one among them.
    """

    run: str
    scenario: str
    architecture: str
    fault_entry: str
    conditions: tuple[str, ...]
    differs: tuple[str, ...]
    first_tick: int | None
    traces: int


@dataclass(frozen=True)
class Sampled:
    """A run of the sample, with what of it is compared."""

    run: RunRef
    fault_entry: str
    case: TestCase
    stored: StoredRun
    is_portable: bool


@dataclass
class _Difference:
    """What was seen of a run that differs."""

    conditions: list[str] = field(default_factory=list)
    differs: dict[str, None] = field(default_factory=dict)
    ticks: list[int] = field(default_factory=list)
    traces: set[str] = field(default_factory=set)


class Compared:
    """Holds executions against what is stored."""

    def __init__(self, runs: Sequence[Sampled]) -> None:
        self._runs = {run.case.digest: run for run in runs}
        self._found: dict[str, _Difference] = defaultdict(_Difference)
        self._verdicts: set[tuple[str, str]] = set()

    def add(self, condition: str, block: RunBlock) -> int:
        """Compare a batch; return how many of its runs count."""
        counted = 0
        dependent = block.machine_dependent.tolist()
        for place, digest in enumerate(block.test_cases):
            if dependent[place]:
                continue
            counted += 1
            self._compare(condition, self._runs[digest], block, place)
        return counted

    @property
    def verdicts(self) -> int:
        """How many verdicts were compared, each counted once."""
        return len(self._verdicts)

    def findings(self) -> tuple[Finding, ...]:
        """List the runs that differ, in the order of the sample."""
        return tuple(
            Finding(
                run=run.run.result_digest,
                scenario=run.run.scenario,
                architecture=run.run.architecture,
                fault_entry=run.fault_entry,
                conditions=tuple(seen.conditions),
                differs=tuple(seen.differs),
                first_tick=min(seen.ticks, default=None),
                traces=len({*seen.traces, run.stored.trace_digest}),
            )
            for digest, run in self._runs.items()
            if (seen := self._found.get(digest)) is not None
        )

    def _compare(self, condition: str, run: Sampled, block: RunBlock, place: int) -> None:
        trace = block.trace_digests[place]
        differs = [TRACE] if trace != run.stored.trace_digest else []
        if OUTCOMES[int(block.outcome[place])].value != run.stored.row["outcome"]:
            differs.append("outcome")
        differs += _other_metrics(run.stored, block, place)
        same = _same_verdicts(run.stored, block, place)
        self._verdicts.update((run.case.digest, fsr) for fsr in same)
        differs += [fsr for fsr, is_same in same.items() if not is_same]
        if not differs:
            return
        seen = self._found[run.case.digest]
        seen.conditions.append(condition)
        seen.differs |= dict.fromkeys(differs)
        seen.traces.add(trace)
        links = split_links(block.chains[place]) if block.chains else ()
        ticks = same_ticks(run.stored, links) if TRACE in differs else None
        if ticks is not None:
            seen.ticks.append(ticks)


def _other_metrics(stored: StoredRun, block: RunBlock, place: int) -> list[str]:
    """Name the metrics that are not as stored; a result of an older release lacks later ones."""
    known: dict[str, list[MetricValue]] = defaultdict(list)
    for values in (stored.metrics, *stored.plugin_metrics.values()):
        for name, value in values.items():
            known[name].append(value)
    found = _values(block.metrics, place)
    for plugin in block.plugin_metrics:
        for row in np.flatnonzero(plugin.run == place).tolist():
            found |= _values(plugin.metrics, row)
    return [name for name, value in found.items() if known[name] and value not in known[name]]


def _same_verdicts(stored: StoredRun, block: RunBlock, place: int) -> dict[str, bool]:
    """Tell by FSR whether verdict and margin are as stored, of those that are stored."""
    known = {item.fsr_digest: (item.verdict, item.margin) for item in stored.verdicts}
    found = block.verdicts.take(np.flatnonzero(block.verdicts.run == place))
    margins = [_number(value) for value in found.numbers[:, MARGIN]]
    now = zip((VERDICTS[code] for code in found.verdict), margins, strict=True)
    return {
        str(fsr): known[str(digest)] == item
        for fsr, digest, item in zip(
            found.fsr_id.values(), found.fsr_digest.values(), now, strict=True
        )
        if str(digest) in known
    }


def _values(metrics: MetricBlock, row: int) -> dict[str, MetricValue]:
    return {
        name: MetricValue(
            _number(metrics.value[row, place]),
            STATUSES[int(metrics.status[row, place])],
            _number(metrics.time_s[row, place]),
            metrics.actors.words[int(metrics.actor[row, place])],
        )
        for place, name in enumerate(metrics.ids)
    }


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


# --- Certify that a campaign is deterministic: execute a sample again under other conditions ------

PORTABLE: Final = "portable"
SAME_PLATFORM: Final = "same platform"
DEFAULT_SAMPLE: Final = 1000


@dataclass(frozen=True)
class Certificate:
    """What executing a sample again came to.

    Attributes:
        campaign: Id.
        odd: Id of the ODD.
        tool: Release of adeye.
        class_: What is promised: ``portable``, or ``same platform`` if a run of it is.
        executed: Runs of the campaign that have a result.
        asked: Size of the sample that was asked for.
        sampled: Runs that were executed again.
        verdicts: Verdicts of these that were compared.
        strata: Combinations of scenario, architecture and fault entry among them.
        machine_dependent: Runs left out, because they depend on the machine, such as by a deadline.
        conditions: Under which the sample was executed, with the runs compared under each.
        findings: Runs that differ.
        lost: Executions, of all under all conditions, that depended on the machine this time: their
            program ended or was late, say. They are compared with nothing.
    """

    campaign: str
    odd: str
    tool: str
    class_: str
    executed: int
    asked: int
    sampled: int
    verdicts: int
    strata: int
    machine_dependent: int
    conditions: tuple[tuple[str, int], ...]
    findings: tuple[Finding, ...]
    lost: int

    @property
    def is_certified(self) -> bool:
        """Whether the whole sample and verdicts of it were compared, and nothing differs."""
        return not self.findings and self.verdicts > 0 and self.lost == 0


def certify(
    db: str | Path | None,
    name: str | None,
    *,
    sample: int = DEFAULT_SAMPLE,
    masked: bool = False,
    report: Callable[[Progress], None] | None = None,
) -> Certificate:
    """Execute a sample of a campaign again under other conditions, compare, keep the certificate.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        name: An ODD's file or id, number or digest of a campaign; None for the latest.
        sample: Most runs that are executed again.
        masked: Whether lesser processors are imitated, too.
        report: Who is told how far it is.

    Raises:
        InputError: There is no such campaign, nothing of it is executed, or the code at hand is
            not what executed it.
        IntegrityError: Verdicts are not as they were written.
        PlatformError: A batch cannot be executed.
    """
    with Repository.open(db, create=False) as repository:
        campaign = find_called(repository, name, may_be_edited=True)
        # Executing again tells nothing of a stored verdict whose FSR has another limit by now.
        repository.require_sound(campaign.id)
        plan = _planned(repository, campaign, name)
        certificates = repository.hindsight.certificates
        executed = certificates.executed(campaign.id)
        chosen = draw([item for item in executed if not item.machine_dependent], sample)
        if not chosen:
            raise UsageError(
                f"campaign {campaign.id[:10]} has no run that can be certified",
                remedy="Run it first; what depends on the machine, by a deadline or by what is at "
                "an address, cannot be certified.",
            )
        runs = _recall(repository, plan, chosen)
        wanted = CONDITIONS + tuple(
            Condition(64, "planned", "processes", 1, mask) for mask in (masks() if masked else ())
        )
        counter = Counter("certify", len(runs) * len(wanted), report)
        compared, context = Compared(runs), _context(repository, campaign, plan)
        tried: list[tuple[str, int, int]] = []
        kept = 0

        def told() -> Certificate:
            return Certificate(
                campaign=campaign.id,
                odd=campaign.odd,
                tool=__version__,
                class_=PORTABLE if all(run.is_portable for run in runs) else SAME_PLATFORM,
                executed=len(executed),
                asked=sample,
                sampled=len(runs),
                verdicts=compared.verdicts,
                strata=len({item.stratum for item in chosen}),
                machine_dependent=sum(item.machine_dependent for item in executed),
                # Where no run promises as much, a condition says nothing and is not named.
                conditions=tuple((label, count) for label, count, lost in tried if count or lost),
                findings=compared.findings(),
                lost=sum(lost for _, _, lost in tried),
            )

        try:
            for item in wanted:
                found = _execute(item, plan, context, runs, compared, counter)
                tried.append((item.name, *found))
                # No end of the process can take it back then.
                if len(compared.findings()) > kept and item is not wanted[-1]:
                    certificates.save(_record(told()))
                    kept = len(compared.findings())
        except BaseException as error:
            # What differed until then did, whatever ended it.
            differing = len(compared.findings())
            if differing > kept:
                certificates.save(_record(told()))
            if differing and isinstance(error, PlatformError):
                text = f"{error} That {differing:,} of the runs differ is kept."
                raise PlatformError(text) from error
            raise
        certificate = told()
        if certificate.verdicts or certificate.findings:
            certificates.save(_record(certificate))
    return certificate


def draw(executed: Iterable[Executed], size: int) -> list[Executed]:
    """Draw a sample of runs: from each stratum in turn the one with the smallest digest.

    A digest is as good as a draw, and the same every time; in turn, so that a rare combination of
    scenario, architecture and fault entry is in it as well as a frequent one.

    Args:
        executed: Runs that have a result.
        size: Of the sample.
    """
    strata: dict[tuple[str, str, str], list[Executed]] = defaultdict(list)
    for item in sorted(executed, key=lambda item: item.run.result_digest):
        strata[item.stratum].append(item)
    turns = [
        (turn, stratum, item)
        for stratum, items in strata.items()
        for turn, item in enumerate(items)
    ]
    turns.sort(key=lambda item: item[:2])
    return [item for _, _, item in turns[:size]]


def _planned(repository: Repository, campaign: CampaignInfo, name: str | None) -> CampaignPlan:
    """Plan the ODD's file as it is now: it names plug-ins and where they are."""
    is_file = name is not None and is_file_name(name)
    path = name if is_file else campaign.provenance.get("odd_path")
    if not path:
        raise UsageError(
            f"campaign {campaign.id[:10]} does not say where its ODD is",
            remedy="Name the ODD's file in place of the campaign.",
        )
    if is_file:
        return planned_as(campaign, str(path))
    return planned_as(campaign, odd_of(campaign.provenance, repository.location.beside.parent))


def _context(repository: Repository, campaign: CampaignInfo, plan: CampaignPlan) -> WorkContext:
    """Execute as planned, but judge by the FSRs that are stored: the files may have others now."""
    concept = Concept.model_validate(
        repository.content("concept", campaign.concept_digest), context=SI
    )
    odd = repository.content("odd", campaign.odd_digest)["odd"]
    faults = tuple(fault["id"] for fault in odd["faults"])
    return replace(plan.work, keep=None, requirements=concept.requirements, faults=faults)


def _recall(
    repository: Repository, plan: CampaignPlan, chosen: Sequence[Executed]
) -> list[Sampled]:
    """Make the sample ready, in the order of the plan, if what executed it is here.

    Raises:
        UsageError: It was executed by other code.
    """
    entries = {item.run.result_digest: item.fault_entry for item in chosen}
    found = []
    for part in recalled_parts(repository, [item.run for item in chosen]):
        for run in part:
            _require_same_code(plan, run.case.architecture.architecture, run.stored)
            architecture = run.case.architecture
            has_processes = run.case.fmus > 0 or any(
                item.kind in HOSTED for item in architecture.channels.values()
            )
            is_portable = run.work.backend == "batch" and not has_processes
            entry = entries[run.run.result_digest]
            found.append(Sampled(run.run, entry, run.case, run.stored, is_portable))
    return found


def _require_same_code(plan: CampaignPlan, architecture: str, stored: StoredRun) -> None:
    then = of_row(EngineKey, stored.row)
    now = plan.engines.get(architecture)
    if now == then:
        return
    if now is None:
        why = f"the ODD has no architecture {architecture} any more"
    elif replace(now, plugins_digest=then.plugins_digest) == then:
        why = f"a plug-in of {architecture}, or a file that one reads, was changed since"
    else:
        why = (
            f"{then.variant}, numerics version {then.numerics_version}, executed it; this is "
            f"{now.variant}, numerics version {now.numerics_version}"
        )
    raise UsageError(
        f"the campaign cannot be certified: {why}",
        remedy="Run it again with what is here, or certify it with what executed it.",
    )


def _execute(
    condition: Condition,
    plan: CampaignPlan,
    context: WorkContext,
    runs: Sequence[Sampled],
    compared: Compared,
    counter: Counter,
) -> tuple[int, int]:
    """Execute the sample under a condition; return the runs compared, and those that could not be.

    Raises:
        PlatformError: A batch cannot be executed.
    """
    cases = [run.case for run in runs if run.is_portable or condition.mask is None]
    counter.add(len(runs) - len(cases))
    if not cases:
        return 0, 0
    tasks = [
        BatchTask(number, batch, (), context)
        for number, batch in enumerate(condition.batches(cases, fitting(plan.examples())))
    ]
    counted = 0
    mask = nullcontext() if condition.mask is None else condition.mask.applied()
    with mask, closing(condition.executor(execute)) as executor:
        for done in executor.run(iter(tasks)):
            if done.result is None or done.result.failure or done.result.runs is None:
                why = done.lost if done.result is None else done.result.failure
                raise PlatformError(
                    f"a batch could not be executed again ({condition.name}): {why}. Nothing is "
                    "certified. Mend that, or free memory, and certify again."
                )
            counted += compared.add(condition.name, done.result.runs)
            counter.add(len(done.task.execute))
    return counted, len(cases) - counted


def _record(found: Certificate) -> CertificateRecord:
    conditions = [{"condition": name, "runs": runs} for name, runs in found.conditions]
    findings = [_plain(item) for item in found.findings]
    return of_fields(CertificateRecord, found, conditions=conditions, findings=findings, at="")


def _plain(item: Finding) -> dict[str, Any]:
    last = None if item.first_tick is None else item.first_tick + LINK_TICKS
    return {**asdict(item), "last_tick": last}
