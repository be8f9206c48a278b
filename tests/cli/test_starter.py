"""``init``: a project that loads, counts to twelve, and never overwrites."""

import re
from pathlib import Path
from typing import Any

import pytest

from adeye.cli.new import project_files, write_project
from adeye.spec.load import load_odd
from adeye.sweep.expand import expand


def test_project_loads_and_has_twelve_test_cases(folder: Path) -> None:
    write_project(folder)
    files = load_odd(folder / "odd" / "first.yaml")
    assert expand(files).count == 12
    assert files.gate == ("camera_radar",)


def test_every_requirement_needs_no_more_runs_than_there_are(folder: Path) -> None:
    write_project(folder)
    concept = load_odd(folder / "odd" / "first.yaml").concept.spec
    assert concept.requirements
    assert {item.min_exercised for item in concept.requirements} == {1}


def test_only_one_odd_is_written() -> None:
    odds = [name for name in project_files() if re.fullmatch(r"odd/[^/]+\.yaml", name)]
    assert odds == ["odd/first.yaml"]


def test_init_says_what_it_wrote_and_what_comes_next(adeye: Any, folder: Path) -> None:
    ended = adeye("init", "mine")
    assert ended.code == 0
    assert "wrote mine/odd/first.yaml" in ended.err
    assert ended.out == "Next: cd mine && adeye run odd/first.yaml --report report.html\n"
    assert (folder / "mine/odd/README.md").is_file()


def test_init_here(adeye: Any, folder: Path) -> None:
    assert adeye("init").out == "Next: adeye run odd/first.yaml --report report.html\n"
    assert (folder / "odd/first.yaml").is_file()


@pytest.mark.parametrize("name", project_files())
def test_nothing_is_overwritten_and_then_nothing_is_written(
    adeye: Any, folder: Path, name: str
) -> None:
    (folder / name).parent.mkdir(parents=True)
    (folder / name).write_text("precious")
    ended = adeye("init")
    assert ended.code == 2
    assert name in ended.err
    assert [path for path in folder.rglob("*") if path.is_file()] == [folder / name]
    assert (folder / name).read_text() == "precious"


@pytest.mark.slow
def test_commands_of_the_readme_exist(adeye: Any) -> None:
    verbs = set(re.findall(r"^    adeye (\w+)", project_files()["odd/README.md"], re.MULTILINE))
    assert verbs == {"plan", "run", "query", "show", "replay"}
    for verb in verbs:
        assert adeye(verb, "--help").code == 0
