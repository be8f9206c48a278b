"""``trace`` and ``plot``: what is printed and written, and what feeds ``stl``."""

from pathlib import Path
from typing import Any

import pytest

from tests.project import Executed


@pytest.fixture
def asked(mini: Executed) -> tuple[str, ...]:
    """A run with a fault, and its database."""
    row = next(row for row in mini.project.rows() if row["fault_entry"] == "nominal_silent")
    return (row["run"][:12], "--db", str(mini.db))


def test_signals_are_printed_as_csv_with_units(adeye: Any, asked: tuple[str, ...]) -> None:
    ended = adeye("trace", *asked, "-s", "ego.speed", "-s", "authority.*").ok
    first, *rows = ended.out.splitlines()
    assert first.startswith("time [s],ego.speed [m/s],authority.nominal [false|true],")
    assert rows[0].startswith("0.0,")
    assert "--horizon '" in ended.err


def test_what_is_written_is_judged_by_stl(
    adeye: Any, asked: tuple[str, ...], tmp_path: Path
) -> None:
    file = tmp_path / "run.npz"
    assert f"wrote {file}" in adeye("trace", *asked, "-o", str(file)).ok.err
    assert "PASS" in adeye("stl", "eventually(channel.nominal.status == silent)", str(file)).ok.out
    assert adeye("stl", "always(ego.speed < 1 m/s)", str(file)).code == 1


def test_json_has_the_signals_with_units(adeye: Any, asked: tuple[str, ...]) -> None:
    document = adeye("trace", *asked, "-s", "ego.speed", "--json").document
    assert (document["schema"], document["units"]["ego.speed"]) == ("adeye/trace@1", "m/s")
    names = [item["name"] for item in document["signals"]]
    assert names == ["time", "ego.speed"]
    assert len(document["signals"][1]["values"]) == len(document["signals"][0]["values"])


def test_wrong_names_are_refused_before_anything_is_written(
    adeye: Any, asked: tuple[str, ...], tmp_path: Path
) -> None:
    file = tmp_path / "run.csv"
    assert (
        "no signal 'ego.sped'" in adeye("trace", *asked, "-s", "ego.sped", "-o", str(file)).refused
    )
    assert "ends in no form" in adeye("trace", *asked, "-o", str(tmp_path / "run.xlsx")).refused
    assert (
        "does not end in .svg"
        in adeye("plot", *asked, "ttc", "-o", str(tmp_path / "r.png")).refused
    )
    assert list(tmp_path.iterdir()) == []


def test_picture_is_written(adeye: Any, asked: tuple[str, ...], tmp_path: Path) -> None:
    file = tmp_path / "run.svg"
    adeye("plot", *asked, "ttc", "ego.s*", "-o", str(file)).ok  # noqa: B018 - fails unless it ends well
    text = file.read_text("utf-8")
    assert text.startswith("<?xml")
    for name in ("ttc [s]", "ego.speed [m/s]", "ego.steering_angle [rad]"):
        assert name in text


def test_terminal_has_a_picture_of_each_signal(adeye: Any, asked: tuple[str, ...]) -> None:
    pytest.importorskip("plotille")
    out = adeye("plot", *asked, "ego.speed", "channel.nominal.status").ok.out
    assert "\nego.speed [m/s]" in out
    assert "\nchannel.nominal.status\nsilent from 0 s, ok from 0.05 s, silent from 3 s, no" in out
    assert any("\N{BRAILLE PATTERN BLANK}" < letter <= "\u28ff" for letter in out)
