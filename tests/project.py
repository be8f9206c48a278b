"""A project on disk for tests: the shipped content, copied, edited and run as a user would."""

from __future__ import annotations

import json
import shutil
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

import adeye
from adeye.campaign.plan import CampaignPlan, make_plan
from adeye.simulate import engine
from adeye.store.repository import Repository
from tests.store.rows import result_table_hash
from tests.stored import stored

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from adeye.campaign.summary import CampaignSummary
    from adeye.sweep.case import TestCase
    from adeye.trace import Trace

ROOT = Path(__file__).resolve().parents[1]

MINI: dict[str, Any] = stored("mini")
"""Twenty-eight test cases: cut-ins with and without faults, a braking lead, two architectures."""

CANDIDATE_ONLY = ["architectures/camera_radar.yaml"]


def odd_of(use: str = "cut_in", *faults: str, **axes: list[str]) -> dict[str, Any]:
    """The mini ODD with one scenario, which has these faults (by default none) and is swept so."""
    entries = list(faults or ("none",))
    scenario = {"use": use, "faults": entries, "sweep": {"parameters": axes}}
    used = [fault for fault in MINI["faults"] if fault["id"] in entries]
    return {**MINI, "scenarios": [scenario], "faults": used}


LEGACY = "odd/architectures/legacy_camera.yaml"
CANDIDATE = "odd/architectures/camera_radar.yaml"
CONCEPT = "odd/concepts/motorway_chauffeur.yaml"


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
        return yaml.safe_load((self.folder / name).read_text("utf-8"))

    def write(self, name: str, content: Any) -> Path:
        """Write a YAML file of the project."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
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


def rows_of(repository: Repository, campaign: str | None = None) -> list[dict[str, Any]]:
    """Read ``v_runs`` of a campaign, the newest unless said, with parsed JSON columns."""
    if campaign is None:
        newest = repository.latest_campaign()
        assert newest is not None
        campaign = newest.id
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
        assert newest is not None
        return result_table_hash(repository, newest.id)


def count_rows(db: Path, table: str) -> int:
    """Count the rows of a table."""
    with Repository.open(db, create=False) as repository:
        return repository.info().rows[table]


def run_cases(plan: CampaignPlan, cases: Sequence[TestCase]) -> Trace:
    """Execute test cases of one structure in one batch."""
    return engine.run(cases, base_dirs=plan.folders, drawn=True)
