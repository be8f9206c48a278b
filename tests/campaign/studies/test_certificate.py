"""Certificates: shipped parts are deterministic, and whoever is not is found and named."""

from __future__ import annotations

import shutil
import sqlite3
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.replay import CHANGED, replay_run
from adeye.campaign.replay import UNSTEADY as NEVER_THE_SAME
from adeye.campaign.studies import certify as certificates
from adeye.campaign.studies.certify import CONDITIONS, Condition, Mask, certify, draw
from adeye.errors import InputError, PlatformError, UsageError
from adeye.store.evidence.roots import Executed
from adeye.store.records import RunRef
from adeye.store.repository import Repository
from tests.project import CANDIDATE, MINI, Project

if TYPE_CHECKING:
    from pathlib import Path

    from tests.conftest import MakeProject
    from tests.project import Executed as Campaign

FEW = (CONDITIONS[1], CONDITIONS[2])
"""Enough to see that something is compared."""

UNSTEADY = '''
import itertools
import os
import time

CALLS = itertools.count()


class Unsteady:
    """Steers a little by something that no test case says."""

    def __init__(self, parameters, context):
        self.own = {source}
        self.ticks = 0

    def act(self, observation):
        self.ticks += 1
        return (1e-6 * self.own if self.ticks > {from_tick} else 0.0), 0.0
'''


@pytest.fixture
def campaign(mini: Campaign, tmp_path: Path) -> tuple[Project, Path]:
    """The mini campaign in a database of its own, to which a certificate may be added."""
    db = tmp_path / "mini.db"
    shutil.copyfile(mini.db, db)
    return mini.project, db


def unsteady(make_project: MakeProject, source: str, *, from_tick: int = 0) -> Project:
    """Run a campaign with a channel that is not deterministic."""
    project = make_project(
        {
            **MINI,
            "scenarios": [{"use": "lead_braking", "faults": ["none"]}],
            "faults": [],
            "architectures": ["architectures/camera_radar.yaml"],
        }
    )
    folder = project.folder / "odd" / "architectures"
    text = UNSTEADY.format(source=source, from_tick=from_tick)
    (folder / "unsteady.py").write_text(text, "utf-8")
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"] = {
            "kind": "./unsteady.py:Unsteady",
            "links": ["localisation"],
        }
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
        (stored,) = repository.hindsight.certificates.of(found.campaign)
    assert [item["run"] for item in stored.findings] == [finding.run]


@pytest.mark.slow
def test_first_ticks_that_differ_are_named(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    # The channel acts at every second tick, so its 76th answer is that of tick 150.
    project = unsteady(make_project, "time.time_ns() % 1000 + 1", from_tick=130)
    (finding,) = certify(project.db, str(project.odd)).findings
    assert finding.first_tick is not None
    assert finding.first_tick >= 100
    assert finding.traces >= 2


@pytest.mark.slow
def test_metric_that_is_not_as_stored_is_named(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    project, db = campaign
    edit(db, "metric", "UPDATE metric SET min_distance_m = 1.25 WHERE run_number = 1")
    (finding,) = certify(db, str(project.odd)).findings
    assert finding.differs == ("min_distance_m",)
    assert finding.first_tick is None
    assert len(finding.conditions) == len(FEW)


def edit(db: Path, table: str, statement: str) -> None:
    connection = sqlite3.connect(db)
    connection.execute(f"DROP TRIGGER {table}_no_update")
    connection.execute(statement)
    connection.commit()
    connection.close()


@pytest.mark.slow
def test_run_that_a_deadline_ended_is_left_out(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(certificates, "CONDITIONS", FEW[:1])
    project, db = campaign
    edit(db, "run", "UPDATE run SET machine_dependent = 1, trace_digest = 'x' WHERE number = 1")
    found = certify(db, str(project.odd))
    assert found.is_certified
    assert found.machine_dependent == 1
    assert found.sampled == found.executed - 1


@pytest.mark.slow
def test_masks_are_conditions_of_what_promises_as_much(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
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
def test_reference_traffic_is_certified_on_its_platform(
    make_project: MakeProject, monkeypatch: pytest.MonkeyPatch
) -> None:
    import adeye

    monkeypatch.setattr(certificates, "CONDITIONS", FEW)
    monkeypatch.setattr(certificates, "masks", lambda: (Mask("weaker", {}),))
    odd = {
        **MINI,
        "scenarios": [{"use": "lead_braking", "faults": ["none"]}],
        "faults": [],
        "architectures": ["architectures/camera_radar.yaml"],
    }
    project = make_project(odd)
    adeye.run(adeye.plan(project.odd, backend="highway"), db=project.db)
    found = certify(project.db, str(project.odd), masked=True)
    assert (found.class_, found.is_certified) == ("same platform", True)
    # A weaker processor is not promised anything there.
    assert [name for name, _ in found.conditions] == [item.name for item in FEW]


@pytest.mark.slow
def test_changed_plugin_is_no_nondeterminism(make_project: MakeProject) -> None:
    project = unsteady(make_project, "0")
    path = project.folder / "odd" / "architectures" / "unsteady.py"
    path.write_text(path.read_text("utf-8") + "# edited\n", "utf-8")
    with pytest.raises(UsageError, match=r"a plug-in of camera_radar.*was changed since"):
        certify(project.db, str(project.odd))


@pytest.mark.slow
def test_other_arithmetic_is_no_nondeterminism(
    campaign: tuple[Project, Path],
) -> None:
    project, db = campaign
    edit(db, "run", "UPDATE run SET numerics_version = 1")
    with pytest.raises(UsageError, match=r"numerics version 1, executed it; this is"):
        certify(db, str(project.odd))


@pytest.mark.slow
def test_batch_that_cannot_be_executed_certifies_nothing(
    campaign: tuple[Project, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    from adeye.campaign.work import BatchResult

    monkeypatch.setattr(certificates, "CONDITIONS", FEW[:1])
    monkeypatch.setattr(certificates, "execute", lambda _: BatchResult(failure="MemoryError: all"))
    project, db = campaign
    with pytest.raises(PlatformError, match=r"MemoryError: all\. Nothing is certified"):
        certify(db, str(project.odd))
    with Repository.open(db) as repository:
        campaign_id = repository.find_campaign().id
        assert repository.hindsight.certificates.of(campaign_id) == ()


@pytest.mark.slow
def test_campaign_without_results_cannot_be_certified(
    make_project: MakeProject,
) -> None:
    project = make_project()
    with Repository.open(project.db) as repository:
        plan = project.plan()
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
    file = project.folder / "odd" / "architectures" / "unsteady.py"
    file.write_text(UNSTEADY.format(source=later, from_tick=0), "utf-8")
    replayed = replay_run(project.db, project.rows()[0]["run"])
    assert (replayed.identical, replayed.cause) == (False, cause)
