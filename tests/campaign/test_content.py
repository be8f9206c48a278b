"""Test cases into the database and back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from adeye.campaign.plan import FOLDERS, Contents, folder_of_plugins, recreate
from adeye.errors import IntegrityError
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from adeye.store.records import StoredCase
    from tests.project import Executed


def stored_case(mini: Executed, ordinal: int) -> tuple[StoredCase, Any]:
    """Read a test case and the ODD's content from the executed mini campaign."""
    with Repository.open(mini.db, create=False) as repository:
        campaign = repository.find_campaign(mini.summary.campaign)
        odd = repository.content("odd", campaign.odd_digest)["odd"]
        return repository.test_case_row(mini.plan.cases[ordinal].digest), odd


@pytest.mark.slow
def test_every_test_case_comes_out_of_the_database_as_it_went_in(mini: Executed) -> None:
    for ordinal, case in enumerate(mini.plan.cases):
        stored, odd = stored_case(mini, ordinal)
        made = recreate(stored, case.scenario_id, odd, inside_odd=case.inside_odd)
        assert made.digest == case.digest
        assert made.stream_seed == case.stream_seed
        assert made.scenario.executable() == case.scenario.executable()
        assert made.architecture == case.architecture
        assert made.faults == case.faults
        assert made.attributes == case.attributes


def test_folder_of_plugins_is_where_the_campaign_was_made_or_executed(
    mini: Executed, tmp_path: Path
) -> None:
    stored, odd = stored_case(mini, 0)
    with Repository.open(mini.db, create=False) as repository:
        made = repository.find_campaign(mini.summary.campaign).provenance
    folder = mini.plan.folders["legacy_camera"]
    gone = {FOLDERS: {"legacy_camera": str(tmp_path / "gone")}}
    assert folder_of_plugins(stored, [made], "legacy_camera") == folder
    assert folder_of_plugins(stored, [gone, {}, made], "legacy_camera") == folder
    assert folder_of_plugins(stored, [gone], "legacy_camera") == tmp_path / "gone"
    assert folder_of_plugins(stored, [{}], "legacy_camera") == Path()
    # As releases stored it that had it in the content.
    former = replace(stored, architecture={**stored.architecture, "plugin_folder": str(tmp_path)})
    assert folder_of_plugins(former, [made], "legacy_camera") == tmp_path
    assert recreate(former, "cut_in", odd, inside_odd=True).digest == stored.test_case


@pytest.mark.parametrize(
    "change",
    [
        {"seed": 8},
        {"parameters": {"ego_speed": 1.0}},
        {"faults": ()},
        {"step_s": 0.1},
        {"replicate": 1},
    ],
)
def test_case_that_comes_out_otherwise_is_not_run(mini: Executed, change: dict[str, Any]) -> None:
    ordinal = next(i for i, case in enumerate(mini.plan.cases) if case.faults)
    stored, odd = stored_case(mini, ordinal)
    with pytest.raises(IntegrityError, match="does not come out of the database as it went in"):
        recreate(replace(stored, **change), "cut_in", odd, inside_odd=True)


def test_one_record_is_shared_by_the_cases_of_one_content(mini: Executed) -> None:
    contents = Contents()
    cases = [case for case in mini.plan.cases if case.scenario_id == "cut_in"]
    records = {id(contents.scenario(case.scenario)) for case in cases}
    assert len(records) == 1
    one = contents.architecture(cases[0].architecture)
    assert contents.architecture(cases[0].architecture) is one
    assert one.id == cases[0].architecture.architecture
