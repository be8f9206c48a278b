"""A small campaign to compare: a copy, a suite with a spare part, one without a radar."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from adeye.campaign.work import BatchTask, execute
from adeye.store.repository import Repository
from tests.project import CANDIDATE, Executed, Project
from tests.stored import stored

SUITES: dict[str, Any] = stored("suites")


def build_suites(folder: Path) -> Executed:
    """Write the architectures beside the shipped ones and run them all."""
    project = Project(folder, SUITES)
    candidate = project.read(CANDIDATE)
    twin = {**deepcopy(candidate), "architecture": "twin", "title": "A copy", "cost": 300}
    spare = {**deepcopy(candidate), "architecture": "spare", "title": "One that nobody uses"}
    spare["sensors"]["spare_camera"] = {**spare["sensors"]["front_camera"], "cost": 40}
    bare = {**deepcopy(candidate), "architecture": "no_radar", "title": "Less", "cost": 180}
    del bare["sensors"]["front_radar"]
    bare["channels"]["nominal"]["links"].remove("front_radar")
    for content in (twin, spare, bare):
        project.write(f"odd/architectures/{content['architecture']}.yaml", content)
    plan = project.plan()
    return Executed(project, plan, project.run(), project.db)


def build_half(suites: Executed, db: Path) -> Executed:
    """Execute every other block of the same campaign into a database of its own."""
    plan = suites.project.plan()
    with Repository.open(db) as repository:
        planned = repository.plan_campaign(plan.record(), plan.planned(), block_size=3)
        is_wanted = True
        while (block := repository.claim_block(campaign=planned.campaign)) is not None:
            if is_wanted:
                cases = tuple(plan.cases[item.ordinal] for item in block.to_execute)
                task = BatchTask(block=block.id, execute=cases, judge=(), context=plan.work)
                assert repository.complete_block(block, execute(task).runs)
            is_wanted = not is_wanted
    return Executed(suites.project, plan, replace(suites.summary, campaign=planned.campaign), db)
