"""A small campaign to store: two scenarios, two architectures, three FSRs, made-up results."""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, date, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adeye.judge.evaluate import never_held
from adeye.judge.stl.batch import NEEDED, SPARE
from adeye.judge.timeline import Injection, Timeline
from adeye.judge.uncertainty import Difference
from adeye.judge.verdict import Outcome, Verdict
from adeye.spec import concept as spec
from adeye.store import records
from adeye.store.block import BasisBlock, ExtremeBlock, JudgedBlock
from adeye.store.encoding import Texts
from adeye.store.evidence.roots import CertificateRecord
from adeye.store.location import locate
from adeye.store.repository import Repository
from adeye.store.tables import METRIC_IDS
from adeye.store.write.half_steps import HalfStepRecord, UncertaintyRecord
from adeye.store.write.studies import DriveRecord, TakeoverLine
from tests.postgres import Server
from tests.store.raw import raw_connection
from tests.store.rows import (
    PlannedCase,
    RunRecord,
    Verdicts,
    complete_block,
    planned_case,
    result_table_hash,
    run_block,
)
from tests.stored import known, stored

CONCEPT = stored("example_concept")


def sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def requirement(name: str, **changes: Any) -> spec.Requirement:
    fields: dict[str, Any] = {
        "id": name,
        "goals": ("SG1",),
        "text": f"{name} holds",
        "formula": "always(gap >= 2)",
        "threshold_source": "made up",
        "asil": "B",
        "allocation": ("camera",),
    }
    return spec.Requirement(**{**fields, **changes})


class Example:
    """Makes records of one consistent campaign; every part can be replaced."""

    def __init__(self) -> None:
        self.engine = records.EngineKey("highway", "float64", 1)
        self.requirements: tuple[spec.Requirement, ...] = (
            requirement("FSR1"),
            requirement(
                "FSR2",
                formula=None,
                bound=spec.MetricBound(metric="min_ttc_s", at_least=1.0),
                mandatory=False,
            ),
            requirement("FSR3", applies="outside", scenarios=("cut_in",), asil="D"),
        )
        self.waivers: tuple[spec.Waiver, ...] = ()
        self.not_applicable: dict[str, dict[str, str]] = {}
        self.parts: dict[str, Any] = {}
        self.thresholds: dict[str, str] = {}
        self.gate: tuple[str, ...] = ("new",)
        self.odd = records.ContentRecord("motorway", "1", {"odd": "motorway", "seed": 7})
        self.verdict_of: Callable[[Any, str], Verdict] = lambda _case, _fsr: Verdict.PASS
        self.margin_of: Callable[[Any], float] = lambda case: 1.0 + case.ordinal
        self.trace_of: Callable[[Any], str] = lambda case: sha(case.result_digest)[:32]
        self.detail_of: Callable[[records.BlockCase], str | None] = lambda _case: None

    def concept(self) -> spec.Concept:
        content = {**CONCEPT, "requirements": self.requirements, "waivers": self.waivers}
        return spec.Concept.model_validate(content).model_copy(update=self.parts)

    def fsr_digest(self, name: str) -> str:
        return sha(f"{name} {self.thresholds.get(name, '')}")

    def record(self) -> records.CampaignRecord:
        return records.CampaignRecord(
            odd=self.odd,
            concept=self.concept(),
            fsrs=[
                records.CampaignFsr(name, self.fsr_digest(name), self.not_applicable.get(name, {}))
                for name in (item.id for item in self.requirements)
            ],
            gate=self.gate,
            factors=[{"scenario": "cut_in", "points": 2}],
            title="Example",
            units={"cut_in": {"ego_speed": "mps"}},
            provenance={"tool": "0.1.0"},
        )

    def case(self, ordinal: int, **changes: Any) -> PlannedCase:
        """Ordinals run over points; scenarios and architectures alternate."""
        point, rest = divmod(ordinal, 4)
        scenario = ("cut_in", "braking")[rest // 2]
        architecture = ("legacy", "new")[rest % 2]
        speed = 20.0 + point
        situation = sha(f"{scenario} {speed}")
        fields: dict[str, Any] = {
            "test_case": sha(f"{situation} {architecture}"),
            "situation": situation,
            "scenario": scenario,
            "scenario_content": records.ContentRecord(scenario, "1", {"scenario": scenario}),
            "architecture": architecture,
            "architecture_content": records.ContentRecord(architecture, "", {"id": architecture}),
            "fault_entry": "none",
            "faults": [],
            "parameters": {"ego_speed": speed},
            "point": {"ego_speed": speed},
            "replicate": 0,
            "seed": 7,
            "step_s": 0.05,
            "inside_odd": True,
            "engine": self.engine,
            "point_index": point,
        }
        return planned_case(**{**fields, **changes})

    def cases(self, count: int) -> list[PlannedCase]:
        return [self.case(ordinal) for ordinal in range(count)]

    def metrics(self, case: records.BlockCase) -> dict[str, records.MetricValue]:
        metrics = {name: records.MetricValue(None, "not_applicable") for name in METRIC_IDS}
        metrics["min_distance_m"] = records.MetricValue(3.0 + case.ordinal, "value", 1.5, "cutter")
        metrics["min_ttc_s"] = records.MetricValue(None, "no_conflict")
        metrics["contact"] = records.MetricValue(0.0)
        return metrics

    def verdict(self, case: records.BlockCase, fsr: str) -> records.VerdictRecord:
        verdict = self.verdict_of(case, fsr)
        margin = (-1.0 if verdict is Verdict.FAIL else 1.0) * self.margin_of(case)
        return records.VerdictRecord(
            fsr_id=fsr,
            fsr_digest=self.fsr_digest(fsr),
            verdict=verdict,
            is_exercised=verdict is not Verdict.VACUOUS,
            robustness_low=margin / 10.0,
            robustness_high=float("inf"),
            margin=margin,
            unit="m",
            signal="gap",
            predicate="gap >= 2",
            time_s=1.5,
            actor="cutter",
            value=2.0 + margin,
            threshold=2.0,
            detail=self.detail_of(case),
        )

    def run(self, case: records.BlockCase, **changes: Any) -> RunRecord:
        fields: dict[str, Any] = {
            "test_case": case.test_case,
            "engine": self.engine,
            "outcome": Outcome.COMPLETED,
            "trace_rows": 301,
            "duration_s": 15.0,
            "trace_digest": self.trace_of(case),
            "is_realised": True,
            "end_reason": "horizon",
            "metrics": self.metrics(case),
            "verdicts": [self.verdict(case, fsr) for fsr in case.missing_fsrs],
            "events": [
                records.EventRecord(0.5, "storyboard", "cutter", "lane change begins"),
                records.EventRecord(1.5, "handover", "safety", "monitor confirmed"),
            ],
            "chain": sha(f"link {case.test_case}")[:32],
            "executed_by": "host 1",
            "executed_at": datetime(2026, 1, 1, tzinfo=UTC),
        }
        return RunRecord(**{**fields, **changes})

    def runs(self, block: records.Block) -> list[RunRecord]:
        return [self.run(case) for case in block.to_execute]

    def basis(self, runs: int) -> BasisBlock:
        """Keep of each run what judging it again takes, and say where its trace is."""
        return BasisBlock(
            version=1,
            uids={"min_distance_m": "adeye:min_distance@1"},
            by_contact=np.zeros(runs, dtype=np.bool_),
            invalid=Texts.of([None if run else "not realised" for run in range(runs)]),
            extremes=ExtremeBlock(
                run=np.arange(runs),
                measure=Texts.same("least gap", runs),
                value=np.full(runs, 3.0),
                time_s=np.full(runs, 1.5),
                actor=Texts.same("cutter", runs),
                samples=Texts.same("[]", runs),
            ),
            files=tuple((sha("file"), run) for run in range(runs)),
        )

    def judged(self, block: records.Block) -> dict[str, Sequence[records.VerdictRecord]]:
        return {
            case.result_digest: [self.verdict(case, fsr) for fsr in case.missing_fsrs]
            for case in block.to_judge
        }

    def work_off(self, repository: Repository, campaign: str) -> int:
        """Complete every block; return how many runs that took."""
        executed = 0
        while (block := repository.claim_block(campaign=campaign)) is not None:
            runs = replace(run_block(self.runs(block)), basis=self.basis(len(block.to_execute)))
            judged = JudgedBlock.of(self.judged(block))
            assert repository.complete_block(block, runs, judged)
            executed += len(block.to_execute)
        return executed

    def campaign(self, repository: Repository, count: int = 8, *, block_size: int = 3) -> str:
        """Plan and complete a campaign; return its id."""
        plan = repository.plan_campaign(self.record(), self.cases(count), block_size=block_size)
        self.work_off(repository, plan.campaign)
        return plan.campaign

    def same_result(self) -> None:
        """Give all runs one result."""
        self.trace_of = lambda _case: "5" * 32
        self.margin_of = lambda _case: 1.0

    def judge(self, verdict: Verdict, *ordinals: int) -> None:
        """Judge these test cases so by every FSR; all others pass."""
        self.verdict_of = lambda case, _: verdict if case.ordinal in ordinals else Verdict.PASS

    def repeat(self, *kinds: int) -> None:
        """Give all runs one result, and FSR1 nested implications that became of it what is said."""
        nested = " or ".join(f"(gap >= {9 + at} implies gap >= 3)" for at in range(len(kinds)))
        first = requirement("FSR1", formula=f"always(gap >= 2 or {nested})")
        self.requirements = (first, *self.requirements[1:])
        self.engine = replace(self.engine, variant="float32")
        self.same_result()
        self.detail_of = lambda _case: never_held(kinds)

    def require(self, **changes: Any) -> None:
        """Change something of all requirements."""
        self.requirements = tuple(item.model_copy(update=changes) for item in self.requirements)

    def decompose(self) -> None:
        """Give the concept rows in every table of its parts."""
        concept = self.concept()
        camera = concept.elements[0].model_copy(update={"resources": ("power",)})
        parts = ("FSR2", "FSR3")
        step = spec.Decomposition(requirement="FSR1", into=parts, independence="a", dfa=("DFA1",))
        record = spec.DependentFailure(
            id="DFA1", covers=("power",), argument="text", owner="me", valid_until=date(2030, 1, 1)
        )
        self.parts = {
            "elements": (camera,),
            "decompositions": (step,),
            "dependent_failures": (record,),
        }

    def with_odd(self, version: str) -> None:
        self.odd = replace(self.odd, version=version, content={"odd": "motorway", "v": version})


@pytest.fixture
def example() -> Example:
    return Example()


@pytest.fixture(scope="session")
def empty(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """An empty database; copying it is faster than migrating."""
    path = tmp_path_factory.mktemp("empty") / "adeye.db"
    Repository.open(path).close()
    return path.read_bytes()


@pytest.fixture(scope="session")
def template(server: Server) -> str:
    """An empty database of the server, to be copied."""
    url = server.new_database()
    Repository.open(url).close()
    return str(locate(url).url.database)


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str | Path]:
    """Where a database of the newest schema is: every test passes on both kinds."""
    if request.param == "postgresql":
        server: Server = request.getfixturevalue("server")
        url = server.new_database(request.getfixturevalue("template"))
        yield url
        server.drop(url)
        return
    path = tmp_path / "adeye.db"
    path.write_bytes(request.getfixturevalue("empty"))
    yield path


@pytest.fixture
def repository(place: str | Path) -> Iterator[Repository]:
    with Repository.open(place, create=False) as opened:
        yield opened


class Store:
    """A database with made-up records for it, and what stands in it behind the repository."""

    def __init__(self, repository: Repository, example: Any) -> None:
        self.repository = repository
        self.example = example

    @cached_property
    def raw(self) -> Any:
        """The database as someone without the repository would open it."""
        return raw_connection(self.repository)

    def close(self) -> None:
        if "raw" in vars(self):
            self.raw.close()

    def rows(self, statement: str, values: Sequence[Any] = ()) -> list[Any]:
        """Read rows behind the repository."""
        return list(self.raw.execute(statement, values).fetchall())

    def plan(self, cases: int | Iterable[PlannedCase], **options: Any) -> records.Plan:
        """Plan the first cases of the example, or others."""
        chosen = self.example.cases(cases) if isinstance(cases, int) else cases
        return self.repository.plan_campaign(self.example.record(), chosen, **options)

    def claim(self, campaign: str | None = None, **options: Any) -> records.Block:
        """Claim a block where there is one."""
        return known(self.repository.claim_block(campaign=campaign, **options))

    def complete(
        self,
        block: records.Block,
        runs: Sequence[RunRecord] | None = None,
        verdicts: Verdicts | None = None,
    ) -> bool:
        """Complete a block with the results of the example, or others; whether it was held."""
        chosen = self.example.runs(block) if runs is None else runs
        return complete_block(self.repository, block, chosen, verdicts)

    def campaign(self, cases: int | Iterable[PlannedCase] = 8, **options: Any) -> str:
        """Plan and complete a campaign of the example's cases, or others; return its id."""
        campaign = self.plan(cases, **{"block_size": 3, **options}).campaign
        self.work_off(campaign)
        return campaign

    def work_off(self, campaign: str) -> int:
        """Complete every block; return how many runs that took."""
        return int(self.example.work_off(self.repository, campaign))

    def fork(self, campaign: str) -> records.ForkRecord:
        """Save a fork of the first run of a campaign."""
        origin = self.repository.find_run("0", campaign=campaign)
        digest = self.example.engine.result_digest(sha("fork"))
        case = records.BlockCase(0, sha("fork"), digest, has_result=False, missing_fsrs=("FSR1",))
        record = records.ForkRecord(
            case.result_digest, case.test_case, origin.result_digest, 40, "safety"
        )
        self.repository.hindsight.save_forks([record], run_block([self.example.run(case)]))
        return record

    def hindsight(self, campaign: str) -> tuple[Injection, TakeoverLine]:
        """Keep what became of a fault of the first run, and what its fork told."""
        run = self.repository.find_run("0", campaign=campaign)
        fork = self.fork(campaign)
        place = (run.scenario, run.architecture, "none")
        times = Timeline(1.0, 1.0, 1.1, 1.25, 1.3, 1.35, 1.5, 6.0)
        off = Timeline(1.0, 1.0, 1.1, violation_s=4.0)
        found = Injection(
            run.result_digest, *place, times, off, None, "detected_in_time", ("a" * 32,) * 3
        )
        line = TakeoverLine(
            run.result_digest, fork.result_digest, *place, "needed_and_done", 1.3, None, 4.0
        )
        self.repository.hindsight.save_injections([found])
        self.repository.hindsight.save_takeovers([line])
        drive = DriveRecord(run.result_digest, "cc", "r157-01", run.result_digest)
        self.repository.hindsight.benchmarks.save((), (), None, [drive])
        return found, line

    def halved(self, campaign: str) -> None:
        """Save a twin of the first run with half the step, and a line of what it told."""
        origin = self.repository.find_run("0", campaign=campaign)
        digest = self.example.engine.result_digest(sha("twin"))
        case = records.BlockCase(0, sha("twin"), digest, has_result=False, missing_fsrs=("FSR1",))
        twin = HalfStepRecord(digest, case.test_case, origin.result_digest, origin.test_case, 0.025)
        halves = self.repository.hindsight.half_steps
        halves.save_twins([twin], run_block([self.example.run(case)]))
        told = Difference("fsr", "FSR9", "m", 12, 11, 0.5, 0.75, 1, {"PASS → FAIL": 1})
        line = UncertaintyRecord(origin.scenario, origin.architecture, told, "f" * 64, "e" * 64)
        halves.save_uncertainty(campaign, [line])

    def vouched(self, campaign: str) -> None:
        """Save root, session and certificate of a campaign, and withdraw its second run."""
        evidence = self.repository.evidence
        evidence.add_session(campaign, {"adeye": "0.1.0", "who": "me", "packages": {"numpy": "2"}})
        assert evidence.record_root(campaign) is not None
        run = self.repository.find_run("1", campaign=campaign)
        assert evidence.withdraw(run.result_digest, author="me", reason="wrong map")
        conditions = [{"condition": "batches of 7", "runs": 3}]
        self.repository.hindsight.certificates.save(
            CertificateRecord(campaign, "0.1", "portable", 8, 1000, 3, 1, conditions, [])
        )

    def everything(self) -> str:
        """Put rows into every table that is only added to; return the first campaign."""
        self.example.decompose()
        first = self.campaign(8)
        self.hindsight(first)
        self.halved(first)
        self.campaign(2)
        self.campaign(8)
        self.vouched(first)
        self.example.repeat(NEEDED, SPARE)
        self.campaign(4)
        return first

    def run(self, digest: str) -> records.StoredRun:
        """Read a result that is there."""
        return known(self.repository.run_row(digest))

    def result_hash(self, campaign: str) -> str:
        """Hash all that came of a campaign."""
        return result_table_hash(self.repository, campaign)


@pytest.fixture(scope="session")
def filled(empty: bytes, tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, str]:
    """A database with everything in it, to be copied, and its first campaign."""
    path = tmp_path_factory.mktemp("filled") / "adeye.db"
    path.write_bytes(empty)
    with Repository.open(path, create=False) as repository:
        first = Store(repository, Example()).everything()
    return path.read_bytes(), first


@pytest.fixture
def store(repository: Repository, example: Example) -> Iterator[Store]:
    opened = Store(repository, example)
    yield opened
    opened.close()


@pytest.fixture
def raw(store: Store) -> Any:
    """The database as someone without the repository would open it."""
    return store.raw
