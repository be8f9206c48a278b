"""The verb that checks channels from outside."""

import shutil
from pathlib import Path

import pytest

from adeye.selftest.conformance import CASES
from adeye.spec.load import catalogue_files, shipped
from tests.cli.conftest import Verb
from tests.selftest import flawed

CANDIDATE = shipped("odd") / "architectures" / "camera_radar.yaml"


@pytest.fixture
def settled(folder: Path) -> Path:
    shutil.copy(flawed.__file__, folder / "flawed.py")
    return folder


@pytest.mark.slow
def test_a_line_for_each_case_says_what_is_wrong(adeye: Verb, settled: Path) -> None:
    path = settled / "tired.yaml"
    path.write_text(
        f"extends: {CANDIDATE}\narchitecture: tired\ntitle: Tired\nchannels:\n"
        "  nominal: {kind: process, parameters: {command: [python3, ./flawed.py], "
        "values: {flaw: tires}}}\n"
    )
    done = adeye("channel", "check", str(path))
    assert done.code == 1
    lines = [line for line in done.out.splitlines() if line]
    assert lines[0] == "nominal, kind process"
    assert [line.split()[1] for line in lines if line[1] in "✓✕–"] == list(CASES)
    assert "stack overflow" in done.out
    assert lines[-1] == "11 passed, 1 failed, 0 not tried."
    told = adeye("channel", "check", str(path), "--json").document
    assert not told["conforms"]
    assert [item["id"] for item in told["cases"] if not item["passed"]] == ["long"]


@pytest.mark.slow
@pytest.mark.usefixtures("settled")
def test_command_is_checked_without_an_architecture(adeye: Verb) -> None:
    assert adeye("channel", "check", "python3", "./flawed.py", "none").ok.out.count("✓") == 12
    done = adeye("channel", "check", "--", "python3", "-I", "./flawed.py", "stays")
    assert done.code == 1
    assert "it goes on for 2 s" in done.out


def test_what_cannot_be_checked_is_an_input_error(adeye: Verb) -> None:
    assert "is no architecture" in adeye("channel", "check", "brake.fmu").refused
    assert "is not there" in adeye("channel", "check", "./nothing").refused
    assert "names no file" in adeye("channel", "check", "perl").refused
    assert "is no architecture" in adeye("channel", "check", "perl", "--channel", "x").refused


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (("--step", "0 s"), "--step 0 s: must be greater than 0"),
        (("--step", "1e9 s"), "--step 1e9 s: must be less than or equal to 1"),
        (("--step", "5 m"), "--step 5 m"),
        (("--seed", "-1"), "--seed -1: must be greater than or equal to 0"),
        (("--set", "gap=30 m", "--set", "gap=40 m"), "--set names 'gap' twice"),
        (("--set", "gap=90 m"), "outside the scenario's range"),
    ],
)
def test_part_is_exported_only_as_an_odd_could_have_it(
    adeye: Verb, folder: Path, given: tuple[str, ...], says: str
) -> None:
    scenario = str(catalogue_files(None)["cut_in"])
    more = ("safety", "--scenario", scenario, *given)
    assert says in adeye("fmu", "export", "channel", str(CANDIDATE), *more).refused
    assert not list(folder.iterdir())


def test_start_value_is_given_once(adeye: Verb) -> None:
    more = ("--stop", "1", "--step", "0.1", "--start", "a=1", "--start", "a=2")
    assert "--start names 'a' twice" in adeye("fmu", "simulate", "x.fmu", *more).refused
