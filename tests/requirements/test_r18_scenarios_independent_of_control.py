"""R18: whatever the architecture, a situation and its scenario keep their digests."""

from __future__ import annotations

import pytest

from adeye.sweep.case import content_digest
from tests.conftest import MakeProject
from tests.project import CANDIDATE, Project

pytestmark = pytest.mark.requirements


def test_changing_the_architecture_leaves_every_situation(make_project: MakeProject) -> None:
    project = make_project()
    before = _identities(project)
    with project.edited(CANDIDATE) as candidate:
        del candidate["sensors"]["front_radar"]
        candidate["channels"]["nominal"]["links"].remove("front_radar")
        candidate["sensors"]["rear_camera"] = dict(candidate["sensors"]["front_camera"])
        del candidate["channels"]["safety"]
        candidate["switch"]["priority"] = ["nominal"]
    with project.edited_odd() as odd:
        odd["gate"] = {"architectures": ["legacy_camera"]}
    assert _identities(project) == before


def _identities(project: Project) -> list[tuple[str, str, int]]:
    return [
        (case.situation_digest, content_digest(case.scenario), case.stream_seed)
        for case in project.plan().cases
    ]
