"""Benchmarks run, say their question in line 1 and measure nothing when they only smoke."""

import ast
import json
from pathlib import Path

import pytest

from tests.processes import python

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted((ROOT / "benchmarks").glob("*.py"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_benchmark_asks_one_question_in_its_first_line(file: Path) -> None:
    text = ast.get_docstring(ast.parse(file.read_text("utf-8"))) or ""
    assert text.partition("\n")[0].endswith("?")


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_smoke_prints_a_table_and_writes_no_result(file: Path) -> None:
    results = ROOT / "reports" / "benchmarks"
    before = set(results.glob("*"))
    if file.stem in {"sumo", "lane_ends"}:
        pytest.importorskip("libsumo")
    done = python(file, "--smoke")
    assert done.returncode == 0, done.stderr
    assert "ratio" in done.stdout
    assert len(done.stdout.splitlines()) >= 2
    assert set(results.glob("*")) == before


@pytest.mark.slow
def test_a_median_of_fewer_than_three_rounds_is_refused() -> None:
    # One after the other in one process, for most of the time goes into imports.
    script = (
        "import runpy, sys; sys.path.insert(0, 'benchmarks')\n"
        "for file in sys.argv[1:]:\n"
        "    sys.argv = [file, '--rounds', '2']\n"
        "    try:\n"
        "        runpy.run_path(file, run_name='__main__')\n"
        "    except SystemExit as error:\n"
        "        print(file, error.code)"
    )
    done = python("-c", script, *FILES)
    assert done.stdout.splitlines() == [f"{file} 2" for file in FILES], done.stderr
    assert done.stderr.count("fewer than 3 rounds") == len(FILES)


def test_result_names_the_machine_and_keeps_earlier_ones(tmp_path: Path) -> None:
    script = (
        "import sys; sys.path.insert(0, 'benchmarks')\n"
        "from pathlib import Path\n"
        "from support.results import machine, write_result\n"
        "result = {'machine': machine(), 'ratio': 2.0}\n"
        f"print(write_result('law', result, Path({str(tmp_path)!r})))"
    )
    done = python("-c", script)
    content = json.loads(Path(done.stdout.strip()).read_text("utf-8"))
    assert content["benchmark"] == "law"
    assert content["ratio"] == 2.0
    assert {"processor", "python", "load", "libraries"} <= set(content["machine"])
