"""Certify that a campaign is deterministic: execute a sample again under other conditions."""

from __future__ import annotations

from collections import defaultdict
from contextlib import closing, nullcontext
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.blocks import fitting
from adeye.campaign.conditions import CONDITIONS, Condition, masks
from adeye.campaign.differences import Compared, Finding, Sampled
from adeye.campaign.lookup import find_called, is_file_name, planned_as
from adeye.campaign.recalling import Counter, recalled_parts
from adeye.campaign.work import BatchTask, execute
from adeye.channels.factory import PROCESS
from adeye.errors import PlatformError, UsageError
from adeye.store.certificates import CertificateRecord, Executed
from adeye.store.repository import Repository
from adeye.store.rows import EngineKey
from adeye.trace import LINK_TICKS
from adeye.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from adeye.campaign.plan import CampaignPlan
    from adeye.campaign.runner import Progress
    from adeye.store.stored import CampaignInfo, StoredRun

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
        strata: Combinations of scenario, architecture and fault entry among them.
        machine_dependent: Runs left out, because a deadline of the machine ended a channel in them.
        conditions: Under which the sample was executed, with the runs compared under each.
        findings: Runs that differ.
    """

    campaign: str
    odd: str
    tool: str
    class_: str
    executed: int
    asked: int
    sampled: int
    strata: int
    machine_dependent: int
    conditions: tuple[tuple[str, int], ...]
    findings: tuple[Finding, ...]

    @property
    def is_certified(self) -> bool:
        """Whether something was compared under every condition, and nothing differs."""
        return not self.findings and self.sampled > 0 and all(runs for _, runs in self.conditions)


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
        PlatformError: A batch cannot be executed.
    """
    with Repository.open(db, create=False) as repository:
        campaign = find_called(repository, name)
        plan = _planned(campaign, name)
        certificates = repository.hindsight.certificates
        executed = certificates.executed(campaign.id)
        chosen = draw([item for item in executed if not item.machine_dependent], sample)
        if not chosen:
            raise UsageError(
                f"campaign {campaign.id[:10]} has no run that can be certified",
                remedy="Run it first; what a deadline of the machine ended cannot be certified.",
            )
        runs = _recall(repository, plan, chosen)
        wanted = CONDITIONS + tuple(
            Condition(64, "planned", "processes", 1, mask) for mask in (masks() if masked else ())
        )
        counter = Counter("certify", len(runs) * len(wanted), report)
        compared = Compared(runs)
        conditions = tuple(
            (item.name, _execute(item, plan, runs, compared, counter)) for item in wanted
        )
        certificate = Certificate(
            campaign=campaign.id,
            odd=campaign.odd,
            tool=__version__,
            class_=PORTABLE if all(run.is_portable for run in runs) else SAME_PLATFORM,
            executed=len(executed),
            asked=sample,
            sampled=len(runs),
            strata=len({item.stratum for item in chosen}),
            machine_dependent=sum(item.machine_dependent for item in executed),
            # Where no run promises as much, a condition says nothing and is not named.
            conditions=tuple((label, count) for label, count in conditions if count is not None),
            findings=compared.findings(),
        )
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


def _planned(campaign: CampaignInfo, name: str | None) -> CampaignPlan:
    """Plan the ODD's file as it is now: it names plug-ins and where they are."""
    path = name if name is not None and is_file_name(name) else campaign.provenance.get("odd_path")
    if not path:
        raise UsageError(
            f"campaign {campaign.id[:10]} does not say where its ODD is",
            remedy="Name the ODD's file in place of the campaign.",
        )
    return planned_as(campaign, str(path))


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
            channels = run.case.architecture.channels.values()
            is_portable = run.backend == "batch" and all(item.kind != PROCESS for item in channels)
            entry = entries[run.run.result_digest]
            found.append(Sampled(run.run, entry, run.case, run.stored, is_portable))
    return found


def _require_same_code(plan: CampaignPlan, architecture: str, stored: StoredRun) -> None:
    columns = ("backend", "variant", "numerics_version", "plugins_digest")
    then = EngineKey(*(stored.row[name] for name in columns))
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
    runs: Sequence[Sampled],
    compared: Compared,
    counter: Counter,
) -> int | None:
    """Execute the sample under a condition; return the runs compared, None if it promises nothing.

    Raises:
        PlatformError: A batch cannot be executed.
    """
    cases = [run.case for run in runs if run.is_portable or condition.mask is None]
    counter.add(len(runs) - len(cases))
    if not cases:
        return None
    context = replace(plan.work, keep=None)
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
                    "certified; free memory and certify again."
                )
            counted += compared.add(condition.name, done.result.runs)
            counter.add(len(done.task.execute))
    return counted


def _record(found: Certificate) -> CertificateRecord:
    return CertificateRecord(
        campaign=found.campaign,
        tool=found.tool,
        class_=found.class_,
        executed=found.executed,
        asked=found.asked,
        sampled=found.sampled,
        machine_dependent=found.machine_dependent,
        conditions=[{"condition": name, "runs": runs} for name, runs in found.conditions],
        findings=[_plain(item) for item in found.findings],
    )


def _plain(item: Finding) -> dict[str, Any]:
    last = None if item.first_tick is None else item.first_tick + LINK_TICKS
    return {**asdict(item), "last_tick": last}
