"""What of a campaign is executed: shards, words, and what failed last."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from adeye.campaign import run as runner
from adeye.campaign.run import Limits, Progress, Session, run_campaign
from adeye.campaign.selection import (
    MAX_DEPTH,
    MAX_LENGTH,
    Choice,
    Keyword,
    PartTags,
    Shard,
    failed_last,
)
from adeye.campaign.summary import CampaignSummary
from adeye.errors import UsageError
from adeye.judge.verdict import ExitCode, Verdict
from adeye.store.owner import Owner
from adeye.store.records import Block, Plan
from adeye.store.repository import Repository
from adeye.store.write.queue import NamedCase
from tests.conftest import MakeProject
from tests.frozen import assert_frozen
from tests.project import CONCEPT, Project, count_rows, one_scenario, table_hash
from tests.stored import known

# --- a part of a campaign is executed: what counts, what stays NOT_RUN, and the exit code


SMALL = one_scenario(
    "cut_in", "none", "nominal_silent", ego_speed=["120 km/h"], gap=["30 m", "50 m"]
)
"""Eight test cases: the candidate passes, legacy_camera does not."""
FAR = Owner("another machine", 1, "1")


@pytest.fixture
def small(make_project: MakeProject) -> Project:
    return make_project(SMALL)


def run(project: Project, *, db: str = "", **session: Any) -> CampaignSummary:
    asked = Session(**session)
    return run_campaign(project.plan(), db=project.folder / db if db else project.db, session=asked)


def word(text: str) -> dict[str, Any]:
    return {"choice": Choice(keyword=Keyword.parse(text))}


def fails_for_the_candidate(project: Project) -> None:
    """Ask for what no run holds."""
    with project.edited(CONCEPT) as concept:
        requirement = next(item for item in concept["requirements"] if item["id"] == "FSR-06")
        requirement["formula"] = "always(abs(ego.lane_offset) <= 0.0001 m)"


@pytest.mark.slow
def test_shards_are_parts_of_one_campaign_and_none_of_them_is_green(small: Project) -> None:
    parts = [run(small, choice=Choice(shard=Shard(place, 2))) for place in (1, 2)]
    assert parts[0].campaign == parts[1].campaign
    assert [item.executed for item in parts] == [4, 4]
    assert parts[0].exit_code is ExitCode.INCOMPLETE
    assert "--shard 1/2 chose 4 of 8 test cases" in parts[0].message
    # With what the first one left here, the second one has everything.
    assert parts[1].exit_code is ExitCode.OK
    small.run(db="whole.db")
    assert table_hash(small.db) == table_hash(small.folder / "whole.db")


@pytest.mark.slow
def test_what_is_not_chosen_is_not_run_and_what_is_chosen_counts(small: Project) -> None:
    fails_for_the_candidate(small)
    summary = run(small, **word("gap=30"))
    assert (summary.executed, summary.selected, summary.to_execute) == (4, 4, 4)
    # A failure in the part is a failure, though the rest was not run.
    assert summary.exit_code is ExitCode.FAILED
    verdicts = {(line.architecture, line.fsr): line.verdict for line in summary.verdicts}
    assert verdicts["camera_radar", "FSR-06"] is Verdict.FAIL
    assert verdicts["camera_radar", "FSR-01"] is Verdict.NOT_RUN
    assert "4 of 8 test cases accounted for" in summary.message
    rest = small.run()
    assert (rest.executed, rest.reused) == (4, 4)
    with Repository.open(small.db, create=False) as repository:
        assert repository.verify() == ()


@pytest.mark.slow
def test_chosen_passes_and_an_empty_selection_are_no_success(small: Project) -> None:
    summary = run(small, **word("camera_radar and gap=50"))
    assert summary.exit_code is ExitCode.INCOMPLETE
    gate = {line.verdict for line in summary.verdicts if line.is_gate and line.mandatory}
    assert gate == {Verdict.NOT_RUN}
    assert small.run().exit_code is ExitCode.OK
    # Even where all is done.
    summary = run(small, **word("no_such_name"))
    assert (summary.exit_code, summary.executed) == (ExitCode.INCOMPLETE, 0)
    assert "an empty selection is no success" in summary.message


@pytest.mark.slow
def test_last_failed_executes_after_an_edit_what_failed_before_it(small: Project) -> None:
    first = small.run()
    failed = {row["ordinal"] for row in small.rows() if "FAIL" in row["verdicts"].values()}
    assert 0 < len(failed) < 8
    with small.edited_odd() as odd:
        odd["seed"] = 8
    summary = run(small, choice=Choice(last_failed=True))
    assert summary.campaign != first.campaign
    assert (summary.executed, summary.selected) == (len(failed), len(failed))
    assert {row["ordinal"] for row in small.rows()} == failed


@pytest.mark.slow
def test_enough_failures_begin_no_more(small: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    fails_for_the_candidate(small)
    monkeypatch.setattr(runner, "block_size", lambda _: 1)
    summary = run(small, **word("camera_radar"), limits=Limits(most_failures=2))
    assert summary.executed == 2
    assert summary.exit_code is ExitCode.FAILED
    assert "ended early, 2 runs with a FAIL or an ERROR" in summary.message
    assert "6 test cases remain, the same command goes on" in summary.message
    assert small.run().executed == 6


@pytest.mark.slow
def test_budget_that_is_over_leaves_the_rest_for_the_next_time(small: Project) -> None:
    summary = run(small, limits=Limits(budget_s=1e-9))
    assert (summary.executed, summary.exit_code) == (0, ExitCode.INCOMPLETE)
    assert "the time that --budget gives is over; 8 test cases remain" in summary.message
    # A budget that is enough is not mentioned.
    done = run(small, limits=Limits(budget_s=1e6))
    assert (done.executed, done.exit_code) == (8, ExitCode.OK)
    assert "budget" not in done.message


@pytest.mark.slow
def test_runner_waits_and_takes_over(small: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(runner, "block_size", lambda _: 1)
    monkeypatch.setattr(runner, "POLL_S", 0.0)
    plan = small.plan()
    phases: list[str] = []
    with Repository.open(small.db) as repository:
        stored = repository.plan_campaign(plan.record(), plan.planned(), block_size=1)
        held: list[Block | None] = [repository.claim_block(FAR, 1e6, campaign=stored.campaign)]

        def tell(state: Progress) -> None:
            phases.append(state.phase)
            if phases.count("wait") == 3 and held[0] is not None:
                # The other one gives it back: it is not lost to this one.
                assert repository.release_block(held[0])
                held[0] = None

        summary = run_campaign(plan, db=small.db, progress=tell)
    assert phases.count("wait") == 3
    assert (summary.executed, summary.exit_code) == (8, ExitCode.OK)
    assert count_rows(small.db, "run") == 8


@pytest.mark.slow
def test_runner_that_does_not_want_it_does_not_wait_for_it(small: Project) -> None:
    plan = small.plan()
    with Repository.open(small.db) as repository:
        stored = repository.plan_campaign(plan.record(), plan.planned(), block_size=2)
        block = known(repository.claim_block(FAR, 1e6, campaign=stored.campaign))
        name = next(
            case.architecture
            for ordinal, case, _ in repository.queue.cases(stored.campaign)
            if ordinal == block.cases[0].ordinal
        )
    summary = run(small, **word(f"not {name}"))
    assert summary.executed == 4


# --- what is chosen of a campaign: shards, words, and what failed last


PLAN = Plan("new", 10, 10, 0, is_new=True, ends=(4, 10))


class Campaigns:
    """Campaigns with their test cases, as the queue of a database tells them."""

    def __init__(self, **campaigns: dict[str, str]) -> None:
        """Take the verdict of each test case by name: ``pass``, ``fail``, or empty for none."""
        self.all = campaigns

    def cases(self, campaign: str) -> Iterator[tuple[int, NamedCase, bool]]:
        for ordinal, (name, verdict) in enumerate(self.all[campaign].items()):
            yield ordinal, NamedCase(name, "x", "none", 0, "{}"), bool(verdict)

    def failed(self, campaign: str) -> frozenset[int]:
        verdicts = enumerate(self.all[campaign].values())
        return frozenset(ordinal for ordinal, verdict in verdicts if verdict == "fail")

    def earlier(self, campaign: str) -> list[str]:
        return [name for name in self.all if name != campaign]


def chosen(campaigns: Campaigns, **choice: Any) -> list[int]:
    planned = len(campaigns.all["new"])
    plan = Plan("new", planned, planned, 0, is_new=True, ends=(planned,))
    found = known(Choice(**choice).ordinals(campaigns, plan, 2))  # type: ignore[arg-type]
    return np.flatnonzero(found).tolist()


def test_every_test_case_is_of_one_shard() -> None:
    for of in (1, 2, 3, 5, 7):
        shards = [Shard(number, of).ordinals(PLAN, 2) for number in range(1, of + 1)]
        assert (np.sum(shards, axis=0) == 1).all()
    # More than blocks leave some empty.
    assert not Shard(9, 9).ordinals(PLAN, 3).any()


def test_shards_are_made_of_whole_blocks_in_turn() -> None:
    # Blocks of at most 3 that cross no end: 0-2, 3, 4-6, 7-9.
    first, second = (np.flatnonzero(Shard(place, 2).ordinals(PLAN, 3)) for place in (1, 2))
    assert first.tolist() == [0, 1, 2, 4, 5, 6]
    assert second.tolist() == [3, 7, 8, 9]


def test_shard_is_read_and_others_are_refused() -> None:
    assert Shard.parse(" 2/3 ") == Shard(2, 3)
    for text in ("", "1", "0/3", "4/3", "1/0", "a/b", "-1/3", "1/2/3", "1/99999"):
        with pytest.raises(UsageError, match="--shard"):
            Shard.parse(text)


def test_nothing_asked_for_is_everything() -> None:
    assert Choice().is_everything
    assert Choice().ordinals(Campaigns(), PLAN, 2) is None  # type: ignore[arg-type]


def test_all_that_is_asked_for_counts_at_once() -> None:
    campaigns = Campaigns(new={"a1": "", "a2": "", "b1": "", "b2": "", "a3": ""})
    word = Keyword.parse("a")
    assert chosen(campaigns, keyword=word) == [0, 1, 4]
    assert chosen(campaigns, keyword=word, shard=Shard(1, 2)) == [0, 1, 4]
    assert chosen(campaigns, keyword=word, shard=Shard(2, 2)) == []
    text = Choice(shard=Shard(2, 2), keyword=word, last_failed=True).text
    assert text == "--shard 2/2 -k 'a' --last-failed"


def test_failed_last_is_what_failed_or_has_no_result_where_it_was_executed_last() -> None:
    campaigns = Campaigns(new={"a": "pass", "b": "fail", "c": ""})
    assert chosen(campaigns, last_failed=True) == [1, 2]
    # What passed before an edit is not executed for it.
    campaigns = Campaigns(
        new={"a": "", "b": "", "c": "pass", "d": ""}, before={"b": "fail", "a": "pass", "c": "fail"}
    )
    assert chosen(campaigns, last_failed=True) == [1, 3]
    campaigns = Campaigns(
        new={"a": "", "b": ""}, before={"a": "", "b": "pass"}, first={"a": "fail", "b": "fail"}
    )
    plan = Plan("new", 2, 2, 0, is_new=True, ends=(2,))
    assert failed_last(campaigns, plan).tolist() == [True, False]  # type: ignore[arg-type]


# --- words, what joins them, and what is refused


CASE = NamedCase(
    "cut_in",
    "camera_radar",
    "front_camera_out+nominal_silent",
    2,
    '{"gap":30.0,"lane":1,"kind":"Van","architecture.sensors.front_radar.range":150.0,"wet":true}',
)


CHOOSE = """
cut_in; CUT_IN; cut and radar; nominal_silent; not lead_braking; not not cut_in; lead or cut
cut_in and not (legacy or gap=50); gap=30; gap=30.0; gap="30 m"; "gap=3000 cm"
front_radar.range=150; range=150; kind=van; wet=true; lane=1; scenario=cut_in
architecture=camera_radar; replicate=2; fault=front_camera_out+nominal_silent
lead and cut or cut_in; cut_in or lead and nothing; ( cut_in ); gap=3 or gap
"""
CHOOSE_NOT = """
lead; not cut_in; cut_in and legacy; gap=3; gap=300; ap=30; gap=; kind=va; lane=true
scenario=cut; architecture=camera; unknown=1; not (cut_in or lead)
cut_in and not (lead or radar); lead or cut_in and legacy
"""


def test_words_choose_what_they_mean() -> None:
    for texts, is_chosen in ((CHOOSE, True), (CHOOSE_NOT, False)):
        for text in texts.strip().replace("\n", "; ").split("; "):
            assert Keyword.parse(text).matches(CASE) is is_chosen, text


def test_tags_of_scenario_and_architecture_are_words_too() -> None:
    tags = PartTags({"cut_in": {"team": "Path planning"}}, {"camera_radar": {"gen": "2"}})
    for text, is_chosen in (
        ("planning", True),
        ('team="path planning"', True),
        ("team=planning", False),
        ("gen=2 and cut_in", True),
        ("gen=3", False),
        ("not gen=2", False),
        ("en=2", False),
    ):
        assert Keyword.parse(text).matches(CASE, tags) is is_chosen, text


def test_what_is_no_choice_is_refused() -> None:
    deep = MAX_DEPTH + 1
    for text in (
        "not " * MAX_DEPTH + "a",
        "(" * MAX_DEPTH + "a" + ")" * MAX_DEPTH,
        "a" * MAX_LENGTH,
    ):
        assert Keyword.parse(text).text == text
    for text, why in (
        ("", "lacks a word"),
        ("and", "lacks a word"),
        ("a and", "lacks a word"),
        ("not", "lacks a word"),
        ("()", "lacks a word"),
        ("a b", "has 'b' where"),
        ("a)", "has ')' where"),
        ("(a", "parenthesis"),
        ('"a', "quote"),
        ("gap<=30", "name=value only"),
        ("gap==30", "name=value only"),
        ("(" * deep + "a" + ")" * deep, "nested"),
        ("not " * deep + "a", "nested"),
        ("a" * (MAX_LENGTH + 1), "longer than"),
    ):
        with pytest.raises(UsageError, match="Write words joined by") as refused:
            Keyword.parse(text)
        assert why in str(refused.value)


def test_words_of_the_language_are_plain_words_in_quotes() -> None:
    named = NamedCase("and", "or", "none", 0, "{}")
    assert Keyword.parse('"and" and "or"').matches(named)
    assert not Keyword.parse('"not"').matches(named)


# --- Words: what each expression chooses, and what is wrong with others ---------------------------

CASES = {
    name: NamedCase(
        scenario=scenario,
        architecture=architecture,
        fault_entry=fault,
        point=point,
        replicate=replicate,
    )
    for name, scenario, architecture, fault, point, replicate in (
        ("a", "cut_in", "camera_radar", "none", '{"gap": 30.0, "ego_speed": 22.22222222222222}', 0),
        (
            "b",
            "cut_in",
            "legacy_camera",
            "none",
            '{"gap": 30.0, "ego_speed": 33.333333333333336}',
            0,
        ),
        ("c", "cut_in", "camera_radar", "nominal_silent", '{"gap": 45.5, "ego_speed": 22.2}', 1),
        ("d", "lead_braking", "camera_radar", "none", '{"deceleration": -4.0}', 0),
        ("e", "lead_braking", "lidar", "late+soon", '{"weather": "rain", "place": "m:1+50"}', 2),
        ("f", "Cut_Out", "lidar", "none", "{}", 10),
    )
}
TAGS = PartTags({"cut_in": {"owner": "Anna B", "kind": "risky"}}, {"lidar": {"owner": "carl"}})
WORDS = (
    "cut", "CUT_IN", "cut_in", "camera", "none", "not none", "cut and radar", "cut or lead",
    "cut and not camera", "not (cut or lead)", "not not cut", "(cut)", "gap=30", "gap='30 m'",
    '"gap=30 m"', "gap=3000", '"gap=3000 cm"', "gap=30.0000000001", "gap=30.001", "gap", "gap=",
    "ego_speed=80", '"ego_speed=80 km/h"', '"ego_speed=22.2222 m/s"', "deceleration=-4",
    "weather=rain", "weather=rai", "place=m:1+50", "scenario=cut_in", "scenario=cut",
    "architecture=lidar", "fault=none", "fault=late", "fault=late+soon", "late", "replicate=0",
    "replicate=1", "replicate=10", "replicate", "owner=carl", '"owner=anna b"', "owner=Anna",
    "anna", "kind=risky and gap=30", "a and b or c", "cut or lead and lidar", "nothing", "gap=30m",
    "30",
    "", " ", "and", "cut and", "or cut", "not", "(cut", "cut)", "()", "cut cut", "\"",
    '"cut', "x" * 3000,
    "(" * 300 + "cut" + ")" * 300, "not " * 300 + "cut", "cut AND radar", "and and and",
)  # fmt: skip


def test_what_words_choose_is_frozen() -> None:
    lines = []
    for text in WORDS:
        try:
            parsed = Keyword.parse(text)
        except UsageError as error:
            lines.append(f"{text[:40]!r}: {error}"[:300])
            continue
        plain, tagged = (
            "".join(name for name, case in CASES.items() if parsed.matches(case, tags))
            for tags in (PartTags({}, {}), TAGS)
        )
        lines.append(f"{text[:40]!r}: {plain or 'none'}, with tags {tagged or 'none'}")
    for most in (MAX_LENGTH, MAX_LENGTH + 1):
        try:
            lines.append(f"{most} letters: {Keyword.parse('x' * most).text[:9]}")
        except UsageError as error:
            lines.append(f"{most} letters: {error}")
    for depth in (MAX_DEPTH - 1, MAX_DEPTH, MAX_DEPTH + 1):
        try:
            Keyword.parse("(" * depth + "cut" + ")" * depth)
            lines.append(f"{depth} deep: read")
        except UsageError as error:
            lines.append(f"{depth} deep: {error}"[:20])
    assert_frozen("words.txt", "\n".join([*lines, ""]))
