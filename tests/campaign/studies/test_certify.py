"""Certificates: conditions that differ, what is compared under them, and what is kept of it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import adeye
from adeye.answers import describe_run
from adeye.campaign.executors import InProcess, Processes, Threads
from adeye.campaign.replay import CHANGED, recall, replay_run
from adeye.campaign.replay import UNSTEADY as NEVER_THE_SAME
from adeye.campaign.studies import certify as certificates
from adeye.campaign.studies.certify import (
    CONDITIONS,
    Compared,
    Condition,
    Mask,
    Sampled,
    certify,
    draw,
    masks,
)
from adeye.campaign.work import BatchResult, BatchTask, execute
from adeye.errors import InputError, IntegrityError, PlatformError, UsageError
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.block import RunBlock
from adeye.store.evidence.roots import Executed
from adeye.store.read.totals import gate_code
from adeye.store.records import RunRef
from adeye.store.repository import Repository
from adeye.trace import LINK_TICKS
from tests.campaign.work import perform
from tests.conftest import MakeProject
from tests.project import CANDIDATE, CANDIDATE_ONLY, CONCEPT, Project, count_rows, one_scenario
from tests.project import Executed as Campaign
from tests.sql import alter
from tests.stored import known, stored

# --- certificates: shipped parts are deterministic, and whoever is not is found and named


FEW = (CONDITIONS[1], CONDITIONS[2])
"""Enough to see that something is compared."""

UNSTEADY_FILE = "odd/architectures/unsteady.py"
UNSTEADY: str = stored("plugins")["unsteady"]


@pytest.fixture
def campaign(mini: Campaign, tmp_path: Path) -> tuple[Project, Path]:
    """The mini campaign in a database of its own, to which a certificate may be added."""
    db = tmp_path / "mini.db"
    shutil.copyfile(mini.db, db)
    return mini.project, db


def braking(make_project: MakeProject) -> Project:
    """A campaign of one scenario and the candidate, without faults."""
    return make_project({**one_scenario("lead_braking"), "architectures": CANDIDATE_ONLY})


def unsteady(make_project: MakeProject, source: str, *, from_tick: int = 0) -> Project:
    """Run a campaign with a channel that is not deterministic."""
    project = braking(make_project)
    text = UNSTEADY.format(source=source, from_tick=from_tick)
    (project.folder / UNSTEADY_FILE).write_text(text, "utf-8")
    kind = {"kind": "./unsteady.py:Unsteady", "links": ["localisation"]}
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"] = kind
    project.run()
    return project


@pytest.mark.slow
def test_shipped_parts_are_certified_under_every_condition(campaign: tuple[Project, Path]) -> None:
    project, db = campaign
    found = certify(db, str(project.odd))
    assert found.is_certified
    assert found.class_ == "portable"
    assert found.sampled == found.executed == len(project.plan().cases)
    assert found.strata == 8
    assert found.conditions == tuple((item.name, found.sampled) for item in CONDITIONS)
    with Repository.open(db) as repository:
        (stored,) = repository.hindsight.certificates.of(found.campaign)
        assert repository.verify() == ()
    assert stored.findings == []
    assert [item["runs"] for item in stored.conditions] == [found.sampled] * len(CONDITIONS)
    assert (stored.asked, stored.sampled, stored.class_) == (1000, found.sampled, "portable")


@pytest.mark.slow
@pytest.mark.parametrize(
    "source",
    ["time.time_ns() % 1000", "os.getpid() % 1000", "next(CALLS)"],
    ids=["time", "pid", "order of calls"],
)
def test_channel_that_is_not_deterministic_is_found_and_named(
    make_project: MakeProject, source: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", (*FEW, CONDITIONS[3]))
    project = unsteady(make_project, source)
    found = certify(project.db, str(project.odd))
    assert not found.is_certified
    finding = found.findings[0]
    assert finding.run == project.rows()[0]["run"]
    assert (finding.scenario, finding.architecture) == ("lead_braking", "camera_radar")
    assert finding.differs[0] == "trace"
    assert finding.first_tick == 0
    assert finding.conditions
    assert set(finding.conditions) <= {item.name for item in (*FEW, CONDITIONS[3])}
    with Repository.open(project.db) as repository:
        stored, *_ = repository.hindsight.certificates.of(found.campaign)
        code, message = gate_code(repository, repository.find_campaign(found.campaign))
        assert code is ExitCode.INTEGRITY
        assert message.startswith("1 result came out otherwise when adeye certify executed")
        assert finding.run[:10] in message
    assert [item["run"] for item in stored.findings] == [finding.run]
    assert describe_run(project.db, finding.run)["not_certified"] == stored.at[:10]


def test_nothing_is_certified_where_an_execution_depends_on_the_machine_this_time(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one whose program was ended meanwhile."""

    def ending_one(task: BatchTask) -> BatchResult:
        found = execute(task)
        block = known(found.runs)
        ended = block.machine_dependent.copy()
        ended[0] = task.block == 0
        return replace(found, runs=replace(block, machine_dependent=ended))

    monkeypatch.setattr(certificates, "CONDITIONS", FEW[:1])
    monkeypatch.setattr(certificates, "execute", ending_one)
    project, db = campaign
    found = certify(db, str(project.odd), sample=8)
    assert (found.is_certified, found.lost, found.findings) == (False, 1, ())
    assert found.conditions == ((FEW[0].name, 7),)


def test_what_differed_is_kept_whatever_ends_the_rest(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = count()

    def dying_later(task: BatchTask) -> BatchResult:
        found = execute(task)
        block = known(found.runs)
        if next(calls) >= 4:
            return BatchResult(failure="killed by SIGKILL")
        other = ("0" * 32,) * len(block.trace_digests)
        return replace(found, runs=replace(block, trace_digests=other))

    few = Condition(1, "planned"), Condition(8, "planned")
    monkeypatch.setattr(certificates, "CONDITIONS", few)
    monkeypatch.setattr(certificates, "execute", dying_later)
    project, db = campaign
    with pytest.raises(PlatformError, match="That 4 of the runs differ is kept"):
        certify(db, str(project.odd), sample=4)
    with Repository.open(db) as repository:
        stored, *_ = repository.hindsight.certificates.of(repository.find_campaign("1").id)
        assert len(stored.findings) == 4
        code, _ = gate_code(repository, repository.find_campaign("1"))
        assert code is ExitCode.INTEGRITY


@pytest.mark.slow
def test_first_tick_differing(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    # The channel acts at every second tick, so its 76th answer is that of tick 150.
    project = unsteady(make_project, "time.time_ns() % 1000 + 1", from_tick=130)
    (finding,) = certify(project.db, str(project.odd)).findings
    assert finding.first_tick is not None
    assert finding.first_tick >= 100
    assert finding.traces >= 2


@pytest.mark.slow
def test_altered_metric_is_named_and_other_arithmetic_is_no_nondeterminism(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    # As if it had been written so.
    monkeypatch.setattr(Repository, "require_sound", lambda *_: None)
    project, db = campaign
    alter(db, "UPDATE metric SET min_distance_m = 1.25 WHERE run_number = 1")
    (finding,) = certify(db, str(project.odd)).findings
    assert finding.differs == ("min_distance_m",)
    assert finding.first_tick is None
    assert len(finding.conditions) == len(FEW)
    # A run that a deadline ended is left out.
    alter(db, "UPDATE run SET machine_dependent = 1, trace_digest = 'x' WHERE number = 1")
    found = certify(db, str(project.odd))
    assert (found.is_certified, found.machine_dependent) == (True, 1)
    assert found.sampled == found.executed - 1
    alter(db, "UPDATE run SET numerics_version = 1")
    with pytest.raises(UsageError, match=r"numerics version 1, executed it; this is"):
        certify(db, str(project.odd))


@pytest.mark.slow
def test_verdicts_are_compared_by_the_requirements_that_are_stored(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    project = braking(make_project)
    project.run()
    with project.edited(CONCEPT) as concept:
        first = {**concept["requirements"][0], "formula": "always(ego.speed <= 20 km/h)"}
        concept["requirements"] = [first]
    found = certify(project.db, str(project.odd))
    assert found.is_certified
    assert found.verdicts == count_rows(project.db, "verdict") > 1


def test_nothing_is_certified_whose_verdicts_are_not_as_written(
    campaign: tuple[Project, Path],
) -> None:
    project, db = campaign
    alter(db, "UPDATE verdict SET margin = 9 WHERE run_number = 1")
    with pytest.raises(IntegrityError, match="is not as it was written"):
        certify(db, str(project.odd))


@pytest.mark.slow
def test_masks_count(campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    project, db = campaign
    mask = Mask("weaker", {"ADEYE_TEST_MASK": "1"})
    monkeypatch.setattr(certificates, "CONDITIONS", FEW[:1])
    monkeypatch.setattr(certificates, "masks", lambda: (mask,))
    found = certify(db, str(project.odd), sample=2, masked=True)
    assert found.conditions == (
        (FEW[0].name, 2),
        (Condition(64, "planned", "processes", 1, mask).name, 2),
    )
    assert certify(db, str(project.odd), sample=2).conditions == ((FEW[0].name, 2),)


@pytest.mark.slow
def test_reference_class(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    monkeypatch.setattr(certificates, "masks", lambda: (Mask("weaker", {}),))
    project = braking(make_project)
    adeye.run(adeye.plan(project.odd, backend="highway"), db=project.db)
    found = certify(project.db, str(project.odd), masked=True)
    assert (found.class_, found.is_certified) == ("same platform", True)
    # A weaker processor is not promised anything there.
    assert [name for name, _ in found.conditions] == [item.name for item in FEW]


@pytest.mark.slow
def test_changed_plugin_is_no_nondeterminism(make_project: MakeProject) -> None:
    project = unsteady(make_project, "0")
    path = project.folder / UNSTEADY_FILE
    path.write_text(path.read_text("utf-8") + "# edited\n", "utf-8")
    with pytest.raises(UsageError, match=r"a plug-in of camera_radar.*was changed since"):
        certify(project.db, str(project.odd))


@pytest.mark.slow
def test_failed_batch_certifies_nothing(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW[:1])
    monkeypatch.setattr(certificates, "execute", lambda _: BatchResult(failure="MemoryError: all"))
    project, db = campaign
    with pytest.raises(PlatformError, match=r"MemoryError: all\. Nothing is certified"):
        certify(db, str(project.odd))
    with Repository.open(db) as repository:
        campaign_id = repository.find_campaign().id
        assert repository.hindsight.certificates.of(campaign_id) == ()


@pytest.mark.slow
def test_campaign_without_results_cannot_be_certified(make_project: MakeProject) -> None:
    project = make_project()
    plan = project.plan()
    with Repository.open(project.db) as repository:
        repository.plan_campaign(plan.record(), plan.planned())
    with pytest.raises(InputError, match=r"has no run that can be certified.*Run it first"):
        certify(project.db, str(project.odd))


def run_of(digest: str, stratum: tuple[str, str, str]) -> Executed:
    scenario, architecture, entry = stratum
    fields: dict[str, Any] = dict.fromkeys(RunRef.__dataclass_fields__, "")
    fields |= {"result_digest": digest, "scenario": scenario, "architecture": architecture}
    return Executed(RunRef(**fields), entry, machine_dependent=False)


def test_draw_takes_from_every_stratum_in_turn_by_digest() -> None:
    often = [run_of(f"{number:02x}", ("a", "x", "none")) for number in range(40)]
    seldom = [run_of("ff", ("b", "x", "none")), run_of("fe", ("b", "x", "none"))]
    drawn = [item.run.result_digest for item in draw([*reversed(often), *seldom], 5)]
    assert drawn == ["00", "fe", "01", "ff", "02"]
    assert draw(often, 100) == often


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "later", "cause"),
    [("next(CALLS)", "next(CALLS)", NEVER_THE_SAME), ("3", "4", CHANGED)],
    ids=["not deterministic", "changed"],
)
def test_replay_says_of_a_run_that_differs_what_the_certificate_says(
    make_project: MakeProject, source: str, later: str, cause: str
) -> None:
    project = unsteady(make_project, source)
    text = UNSTEADY.format(source=later, from_tick=0)
    (project.folder / UNSTEADY_FILE).write_text(text, "utf-8")
    replayed = replay_run(project.db, project.rows()[0]["run"])
    assert (replayed.identical, replayed.cause) == (False, cause)


# --- conditions differ in batches, order, lanes and what the processor can do


def test_conditions_cover_batches_lanes_and_orders() -> None:
    assert {item.batch for item in CONDITIONS} == {1, 7, 64, 1024}
    assert {item.order for item in CONDITIONS} == {"planned", "reversed", "shuffled"}
    lanes = {(item.kind, item.lanes) for item in CONDITIONS}
    threads = {("threads", 2), ("threads", 4)}
    assert lanes == {("here", 1), *threads, ("processes", 1), ("processes", 2)}
    assert len({item.name for item in CONDITIONS}) == len(CONDITIONS)


def test_name_says_everything() -> None:
    masked = Condition(64, "shuffled", "processes", 1, Mask("without AVX", {}))
    for condition, name in (
        (Condition(1024, "planned", "threads", 4), "batches of 1,024, planned, in 4 threads"),
        (Condition(7, "reversed"), "batches of 7, reversed, in this process"),
        (masked, "batches of 64, shuffled, in 1 process, without AVX"),
    ):
        assert condition.name == name


def test_every_case_is_in_one_batch_of_one_structure(mini: Campaign) -> None:
    cases = list(mini.plan.cases)
    for condition in CONDITIONS:
        found = condition.batches(cases, 5)
        assert max(map(len, found)) <= min(condition.batch, 5)
        batched = sorted(case.digest for batch in found for case in batch)
        assert batched == sorted(case.digest for case in cases)
        for batch in found:
            assert len({(case.scenario_id, case.fault_entry) for case in batch}) == 1


def test_orders_differ_and_are_the_same_every_time(mini: Campaign) -> None:
    cases = list(mini.plan.cases)
    assert Condition(1, "planned")._ordered(cases) == cases
    assert Condition(1, "reversed")._ordered(cases) == cases[::-1]
    drawn = Condition(1, "shuffled")._ordered(cases)
    assert drawn not in (cases, cases[::-1])
    assert drawn == Condition(1, "shuffled")._ordered(cases[::-1])
    # Two shuffled conditions are not one order.
    assert drawn != Condition(64, "shuffled", "threads", 2)._ordered(cases)


def test_lanes_are_those_of_the_campaign() -> None:
    assert isinstance(Condition(1, "planned").executor(perform), InProcess)
    threads = Condition(1, "planned", "threads", 2).executor(perform)
    assert isinstance(threads, Threads)
    threads.close()
    assert isinstance(Condition(1, "planned", "processes", 2).executor(perform), Processes)


def started(script: str) -> list[str]:
    """Give the words that a new interpreter prints."""
    command = [sys.executable, "-c", script]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_mask_is_only_for_what_is_started_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ADEYE_TEST_KNOWN", "before")
    monkeypatch.delenv("ADEYE_TEST_NEW", raising=False)
    mask = Mask("any", {"ADEYE_TEST_KNOWN": "masked", "ADEYE_TEST_NEW": "1"})
    script = "import os; print(os.environ['ADEYE_TEST_KNOWN'], os.environ['ADEYE_TEST_NEW'])"
    with mask.applied():
        assert started(script) == ["masked", "1"]
    assert os.environ["ADEYE_TEST_KNOWN"] == "before"
    assert "ADEYE_TEST_NEW" not in os.environ


def test_masks_take_something_away() -> None:
    found = {item.name.partition(" ")[0]: item for item in masks()}
    assert "kernels" in found
    assert found["kernels"].environment["NUMBA_CPU_NAME"] == "generic"
    if "NumPy" in found:
        script = (
            "import numpy as n; u = (getattr(n, '_core', None) or n.core)._multiarray_umath; "
            "print(*[k for k, v in u.__cpu_features__.items() if v])"
        )
        hidden = found["NumPy"].environment["NPY_DISABLE_CPU_FEATURES"].split()
        with found["NumPy"].applied():
            shown = started(script)
        assert hidden
        assert not set(hidden) & set(shown)


# --- executions held against what is stored: what differs is named, what is the machine's is not


@pytest.fixture
def seen(mini: Campaign) -> tuple[Sampled, RunBlock]:
    """A stored run, and what executing it again gives."""
    with Repository.open(mini.db) as repository:
        recalled = recall(repository, repository.find_run("0", campaign=mini.summary.campaign))
    case = recalled.case
    block = known(execute(BatchTask(0, (case,), (), mini.plan.work)).runs)
    sampled = Sampled(recalled.run, case.fault_entry, case, recalled.stored, is_portable=True)
    return sampled, block


def compare(sampled: Sampled, block: RunBlock) -> Any:
    compared = Compared([sampled])
    assert compared.add("some", block) == 1
    return compared.findings()


def test_same_again_and_what_was_not_stored_are_no_findings(seen: tuple[Sampled, RunBlock]) -> None:
    """As a metric that an older release did not have, and verdicts of other requirements."""
    sampled, block = seen
    fewer = {name: item for name, item in sampled.stored.metrics.items() if name != "contact"}
    changes: tuple[dict[str, Any], ...] = ({}, {"metrics": fewer}, {"verdicts": ()})
    for change in changes:
        older = replace(sampled, stored=replace(sampled.stored, **change))
        assert compare(older, block) == ()
    # A run that a deadline ended counts as nothing.
    ended = replace(block, machine_dependent=np.array([True]), trace_digests=("0" * 32,))
    compared = Compared([sampled])
    assert compared.add("some", ended) == 0
    assert compared.findings() == ()


def test_trace_metric_and_outcome_that_differ_are_named(seen: tuple[Sampled, RunBlock]) -> None:
    sampled, block = seen
    value = block.metrics.value.copy()
    value[0, block.metrics.ids.index("min_distance_m")] += 1e-12
    metrics = replace(block.metrics, value=value)
    other = replace(block, trace_digests=("0" * 32,), metrics=metrics, outcome=block.outcome + 1)
    (finding,) = compare(sampled, other)
    assert finding.differs == ("trace", "outcome", "min_distance_m")
    assert (finding.conditions, finding.traces) == (("some",), 2)
    # Every link of the chain is as stored, so the end of the trace differs.
    assert finding.first_tick == sampled.stored.row["trace_rows"] // LINK_TICKS * LINK_TICKS
    links = block.chains[0]
    assert len(links) >= 64, "the run has two links, else nothing is told here"
    broken = replace(other, chains=(links[:32] + "f" * 32 + links[64:],))
    assert compare(sampled, broken)[0].first_tick == 100


def test_verdict_that_differs_is_named_by_its_requirement(seen: tuple[Sampled, RunBlock]) -> None:
    sampled, block = seen
    first, *others = sampled.stored.verdicts
    other = Verdict.FAIL if first.verdict is Verdict.PASS else Verdict.PASS
    for forged in (replace(first, verdict=other), replace(first, margin=1234.5)):
        stored = replace(sampled.stored, verdicts=(forged, *others))
        (finding,) = compare(replace(sampled, stored=stored), block)
        assert finding.differs == (first.fsr_id,)
        assert finding.traces == 1
