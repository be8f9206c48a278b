"""A project on disk for tests: the shipped content, copied, edited and run as a user would."""

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import adeye
from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.campaign.summary import CampaignSummary
from adeye.simulate import engine
from adeye.store.records import CampaignInfo
from adeye.store.repository import Repository
from adeye.sweep.case import TestCase
from adeye.trace import Album, Trace
from tests.store.rows import result_table_hash
from tests.stored import known, read_yaml, stored, write_yaml

ROOT = Path(__file__).resolve().parents[1]

MINI: dict[str, Any] = stored("mini")
"""Twenty-eight test cases: cut-ins with and without faults, a braking lead, two architectures."""

CANDIDATE_ONLY = ["architectures/camera_radar.yaml"]


def one_scenario(use: str = "cut_in", *faults: str, **axes: list[str]) -> dict[str, Any]:
    """The mini ODD with one scenario, which has these faults (by default none) and is swept so."""
    entries = list(faults or ("none",))
    scenario = {"use": use, "faults": entries, "sweep": {"parameters": axes}}
    used = [fault for fault in MINI["faults"] if fault["id"] in entries]
    return {**MINI, "scenarios": [scenario], "faults": used}


LEGACY = "odd/architectures/legacy_camera.yaml"
CANDIDATE = "odd/architectures/camera_radar.yaml"
CONCEPT = "odd/concepts/motorway_chauffeur.yaml"


def use(
    name: str, sweep: Mapping[str, list[Any]] | None = None, *, faults: Sequence[Any] = ("none",)
) -> dict[str, Any]:
    """Return a scenario of an ODD, without a fault and a sweep unless said."""
    swept = {} if sweep is None else {"sweep": {"parameters": dict(sweep)}}
    return {"use": name, "faults": list(faults), **swept}


def odd_of(
    *uses: str | dict[str, Any],
    faults: Sequence[Any] = (),
    architectures: Sequence[str] = ("camera_radar",),
    **more: Any,
) -> dict[str, Any]:
    """Return the mini ODD with other scenarios, of the candidate alone unless said."""
    return {
        **MINI,
        "scenarios": [use(item) if isinstance(item, str) else item for item in uses],
        "faults": list(faults),
        "architectures": [f"architectures/{name}.yaml" for name in architectures],
        "gate": {"architectures": [architectures[0]]},
        **more,
    }


class Project:
    """A folder with the shipped catalogue and an ODD of its own."""

    def __init__(self, folder: Path, odd: dict[str, Any] | None = None) -> None:
        """Copy the shipped content and write an ODD, the mini one unless given."""
        self.folder = folder
        shutil.copytree(ROOT / "odd", folder / "odd")
        shutil.copytree(ROOT / "scenarios_db", folder / "scenarios_db")
        self.odd = folder / "odd" / "tested.yaml"
        self.db = folder / "adeye.db"
        self.write("odd/tested.yaml", MINI if odd is None else odd)
        # The shipped safety channel leaves few contacts to the legacy suite; a stuck switch does.
        with self.edited(LEGACY) as legacy:
            legacy["switch"]["policy"] = "stuck"
        # The shipped concept asks for as many exercised runs as the shipped ODD has, and names a
        # scenario of it.
        used = {use.get("as", use["use"]) for use in self.read("odd/tested.yaml")["scenarios"]}
        with self.edited(CONCEPT) as concept:
            concept["requirements"] = [
                {**item, "min_exercised": 1}
                for item in concept["requirements"]
                if used.intersection(item.get("scenarios", used))
            ]

    def read(self, name: str) -> Any:
        """Read a YAML file of the project."""
        return read_yaml(self.folder / name)

    def write(self, name: str, content: Any) -> Path:
        """Write a YAML file of the project."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_yaml(path, content)
        return path

    @contextmanager
    def edited(self, name: str) -> Iterator[Any]:
        """Edit the content of a YAML file of the project."""
        content = self.read(name)
        yield content
        self.write(name, content)

    def edited_odd(self) -> Any:
        """Edit the ODD."""
        return self.edited("odd/tested.yaml")

    def require(self, *names: str) -> None:
        """Leave only some of the requirements in the concept."""
        with self.edited(CONCEPT) as concept:
            concept["requirements"] = [
                item for item in concept["requirements"] if item["id"] in names
            ]

    def plan(self) -> CampaignPlan:
        """Plan the ODD."""
        return make_plan(self.odd)

    def run(self, *, db: str = "", workers: int = 1, threads: int = 1) -> CampaignSummary:
        """Run the ODD into a database of the project."""
        return adeye.run(
            self.odd,
            db=self.folder / db if db else self.db,
            workers=workers,
            threads=threads,
        )

    def rows(self, campaign: str | None = None, *, db: str = "") -> list[dict[str, Any]]:
        """Return the runs of a campaign, the newest unless said, as ``v_runs`` shows them."""
        with Repository.open(self.folder / db if db else self.db, create=False) as repository:
            return rows_of(repository, campaign)


@dataclass(frozen=True)
class Executed:
    """A project whose campaign has been run."""

    project: Project
    plan: CampaignPlan
    summary: CampaignSummary
    db: Path

    @contextmanager
    def opened(self) -> Iterator[tuple[Repository, CampaignInfo]]:
        """Open the database, and find the campaign in it."""
        with Repository.open(self.db, create=False) as repository:
            yield repository, repository.find_campaign(self.summary.campaign)

    def case(self, architecture: str, fault_entry: str) -> TestCase:
        """Return the first test case of an architecture with a fault, or ``none``."""
        wanted = (architecture, fault_entry)
        cases = self.plan.cases
        return next(c for c in cases if (c.architecture.architecture, c.fault_entry) == wanted)


def rows_of(repository: Repository, campaign: str | None = None) -> list[dict[str, Any]]:
    """Read ``v_runs`` of a campaign, the newest unless said, with parsed JSON columns."""
    if campaign is None:
        newest = repository.latest_campaign()
        campaign = known(newest).id
    table = repository.results(campaign)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    for row in rows:
        for name in ("parameters", "point", "verdicts"):
            row[name] = json.loads(row[name])
    return rows


def table_hash(db: Path | str) -> str:
    """Hash the newest campaign of a database."""
    with Repository.open(db, create=False) as repository:
        newest = repository.latest_campaign()
        return result_table_hash(repository, known(newest).id)


def count_rows(db: Path, table: str) -> int:
    """Count the rows of a table."""
    with Repository.open(db, create=False) as repository:
        return repository.info().rows[table]


def run_cases(plan: CampaignPlan, cases: Sequence[TestCase], album: Album | None = None) -> Trace:
    """Execute test cases of one structure in one batch."""
    return engine.run(cases, base_dirs=plan.folders, drawn=True, album=album)
