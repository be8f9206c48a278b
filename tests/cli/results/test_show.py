"""``show`` and ``replay``: what is printed, and that a different trace is never a success."""

from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import ANY, Mock, call

import numpy as np
import pytest
from mcap.reader import make_reader

import adeye.answers
import adeye.campaign.replay
import adeye.reporting
from adeye import reporting
from adeye.campaign.replay import Replayed
from adeye.errors import InputError
from tests.conftest import MakeProject
from tests.judge.conftest import HandMade
from tests.project import CANDIDATE, Executed, odd_of

DESCRIPTION: dict[str, Any] = {
    "run": "ab" * 32,
    "scenario": "cut_in",
    "architecture": "legacy\x1b_camera",
    "fault_entry": "none",
    "parameters": {"gap": 30.0, "rain": 0.0},
    "swept_paths": {"architecture.channels.nominal.links": "[localisation, front_radar]"},
    "outcome": "completed",
    "metrics": {"min_ttc_s": {"value": None, "status": "no_conflict"}, "contact": {"value": 1.0}},
    "end_reason": "contact",
    "duration_s": 2.5,
    "verdicts": [
        {
            "fsr": "FSR-01",
            "verdict": "FAIL",
            "margin": None,
            "predicate": "contact",
            "detail": "contact is true",
            "actor": "cutter",
            "time_s": 2.5,
            "measure": "always(not contact)",
        },
        {
            "fsr": "FSR-02",
            "verdict": "FAIL",
            "margin": -0.00053,
            "unit": "s",
            "signal": "ttc",
            "predicate": "ttc >= 1.5 s",
            "value": 1.49947,
            "threshold": 1.5,
            "time_s": 1.25,
            "measure": "always(ttc >= 1.5 s)",
        },
        {"fsr": "FSR-03", "verdict": "PASS", "margin": 0.5},
    ],
    "events": [{"time_s": 2.5, "kind": "contact", "subject": "cutter"}],
    "command": "adeye replay ababababab",
}


REPLAYED = Replayed(
    run="ab" * 32,
    scenario="cut_in",
    architecture="camera_radar",
    fault_entry="none",
    stored_digest="11" * 16,
    trace_digest="11" * 16,
    identical=True,
    rows=501,
    outcome="completed",
    verdicts={"FSR-01": "PASS"},
    note="",
)


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch) -> Mock:
    """Put a stand-in behind the verbs; who looks at a replay sees a trace made by hand."""

    def replay_run(*asked: Any) -> Replayed:
        look, hand_out = asked[3], asked[5]
        if look is not None:
            look(HandMade().trace())
        if hand_out is not None:
            hand_out(Mock(trace=HandMade().trace()))
        return fake.replayed  # type: ignore[no-any-return]

    fake = Mock(replayed=REPLAYED)
    fake.describe_run.return_value = DESCRIPTION
    fake.replay_run.side_effect = replay_run
    monkeypatch.setattr(adeye.answers, "describe_run", fake.describe_run)
    monkeypatch.setattr(adeye.campaign.replay, "replay_run", fake.replay_run)
    monkeypatch.setattr(adeye.reporting, "write_replay", fake.write_replay)
    return fake


def test_show_prints_everything_harmlessly(adeye: Any, results: Mock) -> None:
    ended = adeye("show", "abab", "--all", "--db", "x.db").ok
    assert results.mock_calls == [call.describe_run("x.db", "abab")]
    assert "\nSwept paths\n" in ended.out
    for part in ("legacy_camera", "gap", "no_conflict", "FSR-01", "contact", "cutter", "2.5"):
        assert part in ended.out
    assert "\x1b" not in ended.out
    assert ended.out.rstrip().endswith("Reproduce it:  adeye replay ababababab")


@pytest.mark.usefixtures("results")
def test_show_begins_with_what_failed_and_why(adeye: Any) -> None:
    lines = adeye("show", "abab").ok.out.splitlines()
    assert lines[1].split(maxsplit=1) == ["Outcome", "completed, ended by contact at 2.5 s"]
    at = lines.index("✕ FAIL FSR-01  always(not contact)")
    assert lines[at + 1] == "  contact: contact is true (cutter) at 2.50 s"
    assert lines[at + 3 : at + 5] == [
        "✕ FAIL FSR-02  always(ttc >= 1.5 s)",
        "  ttc >= 1.5 s: ttc is 1.499 s at 1.25 s, short by 0.00053 s",
    ]
    assert lines.index("Parameters") > at
    assert "PASS  FSR-03" in lines
    assert not {"Metrics", "Ids"} & {*lines}


@pytest.mark.usefixtures("results")
def test_show_json_is_the_description(adeye: Any) -> None:
    assert adeye("show", "abab", "--json").document == {"schema": "adeye/show@1", **DESCRIPTION}


def test_unknown_run_is_an_input_error(adeye: Any, results: Mock) -> None:
    results.describe_run.side_effect = InputError("run 'none': there is none")
    assert "there is none" in adeye("show", "none").refused


@pytest.mark.usefixtures("results")
def test_identical_replay_is_a_success(adeye: Any) -> None:
    assert "Identical" in adeye("replay", "abab").ok.out
    document = adeye("replay", "abab", "--json").document
    assert (document["schema"], document["identical"]) == ("adeye/replay@1", True)
    assert document["verdicts"] == {"FSR-01": "PASS"}


def test_different_replay_ends_with_4(adeye: Any, results: Mock) -> None:
    note = "it was made by another version"
    results.replayed = replace(REPLAYED, trace_digest="22" * 16, identical=False, note=note)
    for flags in ((), ("--json",)):
        ended = adeye("replay", "abab", *flags)
        assert ended.code == 4
        assert note in ended.out
        assert "22" * 16 in ended.out


def test_replay_page_is_written_also_if_it_differs(adeye: Any, results: Mock) -> None:
    results.replayed = replace(REPLAYED, identical=False)
    ended = adeye("replay", "abab", "--html", "r.html")
    assert ended.code == 4
    results.write_replay.assert_called_once_with(None, "abab", Path("r.html"))
    assert "wrote r.html" in ended.err


def test_replay_saves_what_a_channel_was_shown(adeye: Any, results: Mock) -> None:
    ended = adeye("replay", "abab", "--channel", "nominal", "--dump", "s.jsonl").ok
    asked = ("nominal", Path("s.jsonl"))
    assert results.mock_calls == [call.replay_run(None, "abab", asked, None, None, None)]
    assert "wrote s.jsonl" in ended.err


def test_channel_and_dump_belong_together(adeye: Any, results: Mock) -> None:
    for option in (("--channel", "nominal"), ("--dump", "s.jsonl")):
        assert "belong together" in adeye("replay", "abab", *option).refused
        assert results.mock_calls == []


def test_grid_map_is_saved(adeye: Any, results: Mock, tmp_path: Path) -> None:
    path = tmp_path / "grid.npz"
    ended = adeye("replay", "abab", "--grid", "0.5 s", "--dump", str(path)).ok
    assert results.mock_calls == [call.replay_run(None, "abab", None, ANY, None, None)]
    assert f"wrote {path}" in ended.err
    saved = np.load(path)
    assert (float(saved["time"]), str(saved["view"])) == (0.5, "truth")
    assert saved["number"].shape == (150, 70)


def test_grid_map_as_asked_for(adeye: Any, results: Mock, tmp_path: Path) -> None:
    path, cells = tmp_path / "grid.npz", tmp_path / "cells.yaml"
    cells.write_text("width: 10 m\ncell: 1 m\ncosts: {default: 3, outside: 9, blocked: 9}\n")
    asked = ("replay", "abab", "--grid", "0.5 s", "--dump", str(path), "--channel", "safety")
    assert adeye(*asked, "--cells", str(cells)).code == 0
    saved = np.load(path)
    assert (str(saved["view"]), np.unique(saved["number"]).tolist()) == ("safety", [3.0])
    assert saved["number"].shape == (75, 10)
    assert adeye(*asked, "--cells", "adeye").code == 0
    assert np.unique(np.load(path)["number"]).tolist() == [25.0, 50.0, 65.0, 90.0]
    assert len(results.mock_calls) == 2


@pytest.mark.usefixtures("results")
def test_run_is_handed_to_the_viewers_that_are_asked_for(
    adeye: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    hand_out = Mock()
    handing_out = Mock(return_value=hand_out)
    monkeypatch.setattr(reporting, "handing_out", handing_out)
    asked = {"mcap": "r.mcap", "osi": "o", "commonroad": "c"}
    options = [word for name, path in asked.items() for word in (f"--{name}", path)]
    ended = adeye("replay", "abab", *options).ok
    more: dict[str, Any] = {"rosbag": None, "shown": None, "album": {}}
    wanted = {name: Path(path) for name, path in asked.items()}
    handing_out.assert_called_once_with(**wanted, **more)
    ((done,), _) = hand_out.call_args
    assert done.trace.runs == 1
    for name in asked.values():
        assert f"wrote {name}" in ended.err


@pytest.mark.parametrize("channel", [None, "safety"])
def test_bag_is_made_of_what_a_channel_is_shown(
    adeye: Any, results: Mock, monkeypatch: pytest.MonkeyPatch, channel: str | None
) -> None:
    handing_out = Mock(return_value=Mock())
    monkeypatch.setattr(reporting, "handing_out", handing_out)
    more = () if channel is None else ("--channel", channel)
    assert "wrote run.bag" in adeye("replay", "abab", "--rosbag", "run.bag", *more).ok.err
    ((_, _, (asked, taken), *_), _) = results.replay_run.call_args
    assert asked == channel
    assert handing_out.call_args.kwargs["shown"] is taken
    assert handing_out.call_args.kwargs["rosbag"] == Path("run.bag")
    assert taken.closed


@pytest.mark.usefixtures("results")
def test_bag_beside_a_dump_is_refused(adeye: Any) -> None:
    for more in (("--channel", "safety"), ("--grid", "1 s")):
        said = adeye("replay", "abab", "--rosbag", "bag", "--dump", "d", *more).refused
        assert "stands beside neither" in said


@pytest.mark.usefixtures("results")
def test_grid_map_that_cannot_be_had_is_refused(adeye: Any) -> None:
    dump = ("--dump", "g.npz")
    for options, what in (
        (("--grid", "1 s"), "--grid needs --dump"),
        (("--grid", "1", *dump), "has no unit"),
        (("--grid", "60 s", *dump), "the run has no 60 s"),
        (("--grid", "1 s", *dump, "--channel", "safty"), "no view 'safty'"),
        (("--grid", "1 s", *dump, "--cells", "none.yaml"), "none.yaml"),
        (("--cells", "adeye"), "--cells belongs to --grid"),
    ):
        assert what in adeye("replay", "abab", *options).refused
        assert not Path("g.npz").exists()


@pytest.mark.parametrize("flag", ["--mcap", "--commonroad"])
def test_database_is_not_written_over(adeye: Any, mini: Executed, flag: str) -> None:
    before = mini.db.read_bytes()
    said = adeye("replay", "abab", "--db", str(mini.db), flag, str(mini.db)).refused
    assert "belongs to the database" in said
    assert mini.db.read_bytes() == before


@pytest.mark.slow
def test_what_a_camera_showed_is_in_the_file_for_viewers(
    adeye: Any, make_project: MakeProject, tmp_path: Path
) -> None:
    project = make_project(odd_of("cut_in"))
    with project.edited(CANDIDATE) as candidate:
        given = candidate["sensors"]["front_camera"] | {"fidelity": "physical", "columns": 80}
        plan_view = ("range", "distance_noise", "bearing_noise", "night_range")
        candidate["sensors"]["front_camera"] = {
            key: value for key, value in given.items() if key not in plan_view
        }
    project.run()
    place = tmp_path / "run.mcap"
    run = project.rows()[0]["run"]
    assert adeye("replay", str(run), "--db", str(project.db), "--mcap", str(place)).ok
    with place.open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    assert topics.count("/sensor/front_camera/image") > 100
    assert topics.count("/sensor/front_camera/calibration") == 1
    assert "/sensor/front_radar/image" not in topics
