"""``show`` and ``replay``: what is printed, and that a different trace is never a success."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import adeye.campaign.replay
import adeye.reporting
from adeye.campaign.replay import Replayed
from adeye.errors import InputError
from adeye.trace import Trace
from tests.judge.conftest import HandMade

DESCRIPTION: dict[str, Any] = {
    "run": "ab" * 32,
    "scenario": "cut_in",
    "architecture": "legacy\x1b_camera",
    "fault_entry": "none",
    "parameters": {"gap": 30.0, "rain": 0.0},
    "swept_paths": {"architecture.channels.nominal.links": "[localisation, front_radar]"},
    "outcome": "completed",
    "metrics": {"min_ttc_s": {"value": None, "status": "no_conflict"}, "contact": {"value": 1.0}},
    "verdicts": [{"fsr": "FSR-01", "verdict": "FAIL", "margin": None}],
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


class Results:
    """Stands for the stored runs."""

    def __init__(self) -> None:
        self.replayed = REPLAYED
        self.calls: list[tuple[Any, ...]] = []

    def describe_run(self, db: str | None, run: str) -> dict[str, Any]:
        self.calls.append((db, run))
        if run == "none":
            raise InputError("run 'none': there is none")
        return DESCRIPTION

    def replay_run(
        self,
        db: str | None,
        run: str,
        dump: tuple[str, Path] | None = None,
        look: Callable[[Trace], None] | None = None,
    ) -> Replayed:
        self.calls.append((db, run) if dump is None else (db, run, *dump))
        if look is not None:
            look(HandMade().trace())
        return self.replayed

    def write_replay(self, db: str | None, run: str, path: Path) -> None:
        self.calls.append((db, run, path))


@pytest.fixture
def results(monkeypatch: pytest.MonkeyPatch) -> Results:
    """Put the stand-in behind the verbs."""
    fake = Results()
    monkeypatch.setattr(adeye.campaign.replay, "describe_run", fake.describe_run)
    monkeypatch.setattr(adeye.campaign.replay, "replay_run", fake.replay_run)
    monkeypatch.setattr(adeye.reporting, "write_replay", fake.write_replay)
    return fake


def test_show_prints_everything_harmlessly(adeye: Any, results: Results) -> None:
    ended = adeye("show", "abab", "--db", "x.db")
    assert (ended.code, results.calls) == (0, [("x.db", "abab")])
    assert "\nSwept paths\n" in ended.out
    for part in ("legacy_camera", "gap", "no_conflict", "FSR-01", "contact", "cutter", "2.5"):
        assert part in ended.out
    assert "\x1b" not in ended.out
    assert ended.out.rstrip().endswith("Reproduce it:  adeye replay ababababab")


def test_show_json_is_the_description(adeye: Any, results: Results) -> None:
    assert results.calls == []
    assert adeye("show", "abab", "--json").document == {"schema": "adeye/show@1", **DESCRIPTION}


def test_unknown_run_is_an_input_error(adeye: Any, results: Results) -> None:
    ended = adeye("show", "none")
    assert (ended.code, ended.out) == (2, "")
    assert results.calls == [(None, "none")]


def test_identical_replay_is_a_success(adeye: Any, results: Results) -> None:
    assert results.replayed.identical
    ended = adeye("replay", "abab")
    assert ended.code == 0
    assert "Identical" in ended.out
    document = adeye("replay", "abab", "--json").document
    assert (document["schema"], document["identical"]) == ("adeye/replay@1", True)
    assert document["verdicts"] == {"FSR-01": "PASS"}


def test_different_replay_ends_with_4(adeye: Any, results: Results) -> None:
    note = "it was made by another version"
    results.replayed = replace(REPLAYED, trace_digest="22" * 16, identical=False, note=note)
    for flags in ((), ("--json",)):
        ended = adeye("replay", "abab", *flags)
        assert ended.code == 4
        assert note in ended.out
        assert "22" * 16 in ended.out


def test_replay_page_is_written_also_if_it_differs(adeye: Any, results: Results) -> None:
    results.replayed = replace(REPLAYED, identical=False)
    ended = adeye("replay", "abab", "--html", "r.html")
    assert ended.code == 4
    assert results.calls[-1] == (None, "abab", Path("r.html"))
    assert "wrote r.html" in ended.err


def test_replay_saves_what_a_channel_was_shown(adeye: Any, results: Results) -> None:
    ended = adeye("replay", "abab", "--channel", "nominal", "--dump", "s.jsonl")
    assert ended.code == 0
    assert results.calls == [(None, "abab", "nominal", Path("s.jsonl"))]
    assert "wrote s.jsonl" in ended.err


def test_channel_and_dump_belong_together(adeye: Any, results: Results) -> None:
    for option in (("--channel", "nominal"), ("--dump", "s.jsonl")):
        assert "belong together" in adeye("replay", "abab", *option).refused
        assert results.calls == []


def test_grid_map_is_saved(adeye: Any, results: Results, tmp_path: Path) -> None:
    path = tmp_path / "grid.npz"
    ended = adeye("replay", "abab", "--grid", "0.5 s", "--dump", str(path))
    assert (ended.code, results.calls) == (0, [(None, "abab")])
    assert f"wrote {path}" in ended.err
    saved = np.load(path)
    assert (float(saved["time"]), str(saved["view"])) == (0.5, "truth")
    assert saved["number"].shape == (150, 70)


def test_grid_map_has_the_view_and_cells_that_were_asked_for(
    adeye: Any, results: Results, tmp_path: Path
) -> None:
    path, cells = tmp_path / "grid.npz", tmp_path / "cells.yaml"
    cells.write_text("width: 10 m\ncell: 1 m\ncosts: {default: 3, outside: 9, blocked: 9}\n")
    asked = ("replay", "abab", "--grid", "0.5 s", "--dump", str(path), "--channel", "safety")
    assert adeye(*asked, "--cells", str(cells)).code == 0
    saved = np.load(path)
    assert (str(saved["view"]), np.unique(saved["number"]).tolist()) == ("safety", [3.0])
    assert saved["number"].shape == (75, 10)
    assert adeye(*asked, "--cells", "adeye").code == 0
    assert np.unique(np.load(path)["number"]).tolist() == [25.0, 50.0, 65.0, 90.0]
    assert len(results.calls) == 2


def test_grid_map_that_cannot_be_had_is_refused(adeye: Any, results: Results) -> None:
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
        assert results.replayed is REPLAYED
        assert not Path("g.npz").exists()
