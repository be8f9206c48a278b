"""The public functions do what the command line does."""

import inspect
import json
import math
from dataclasses import replace
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import pytest

import adeye
from adeye import api
from adeye.answers import gate_campaign
from adeye.cli.app import main
from adeye.errors import InputError, UsageError
from adeye.judge.verdict import ExitCode
from adeye.report.gate.decide import GateOptions
from adeye.version import __version__
from tests.processes import python
from tests.project import Executed
from tests.refusals import refused


def test_exported_names_are_pinned() -> None:
    assert adeye.__all__ == [
        "CompareOptions", "__version__", "compare", "gate", "plan", "query", "replay", "report",
        "results", "run", "stl", "trace",
    ]  # fmt: skip
    for name in adeye.__all__:
        assert getattr(adeye, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'drive'"):
        _ = adeye.drive


def test_importing_the_package_loads_nothing_heavy() -> None:
    heavy = "[m for m in ('numpy', 'pandas', 'numba') if m in sys.modules]"
    assert python("-c", f"import adeye, sys; print({heavy})").stdout.strip() == "[]"


def test_plan_counts_without_running(mini: Executed) -> None:
    plan = adeye.plan(mini.project.odd)
    assert plan.expansion.count == len(mini.project.rows())


def test_results_are_a_typed_table(mini: Executed) -> None:
    frame = adeye.results(db=mini.db)
    assert len(frame) == mini.summary.planned
    assert str(frame["min_distance_m"].dtype) == "Float64"
    assert str(frame["scenario"].dtype) == "string" or str(frame["scenario"].dtype) == "str"
    assert frame["run"].is_unique


def test_every_parameter_and_verdict_has_a_typed_column(mini: Executed) -> None:
    frame = adeye.results(db=mini.db)
    stored = {row["run"]: row for row in mini.project.rows()}
    verdicts = [name for name in frame if str(name).startswith("verdict_fsr")]
    assert len(verdicts) > 5
    assert frame.attrs["units"]["min_ttc_s"] == "s"
    swept = next(name for name in frame if str(name).startswith("gap"))
    assert str(frame[swept].dtype) == "Float64"
    for row in frame.to_dict("records"):
        known = stored[row["run"]]
        assert row["outcome"] == known["outcome"]
        for fsr, verdict in known["verdicts"].items():
            assert row[f"verdict_{fsr.replace('-', '_').lower()}"] == verdict


def test_query_is_a_frame_of_what_the_command_prints(mini: Executed) -> None:
    counted = (
        "SELECT architecture, count(*) AS runs FROM v_runs WHERE campaign = :campaign GROUP BY 1"
    )
    frame = adeye.query(counted, campaign=1, db=mini.db)
    assert frame.set_index("architecture")["runs"].to_dict() == {
        "camera_radar": 14,
        "legacy_camera": 14,
    }
    assert "fsr" in adeye.query("failing-fsrs", db=mini.db)
    refused(
        InputError, adeye.query, "SELECT run FROM v_runs", db=mini.db, max_rows=3, says="than 3"
    )
    refused(InputError, adeye.query, "DELETE FROM run", db=mini.db)


def test_trace_is_a_frame_with_units(mini: Executed) -> None:
    run = mini.project.rows()[0]["run"]
    frame = adeye.trace(run[:12], ["ego.speed", "time_gap"], db=mini.db)
    assert list(frame)[:3] == ["time", "ego.speed", "time_gap"]
    assert frame.attrs["units"]["ego.speed"] == "m/s"
    assert adeye.trace(run, "ego.speed", db=mini.db).equals(frame[["time", "ego.speed"]])
    refused(InputError, adeye.trace, run, ["ego.sped"], db=mini.db, says="ego.speed")


def test_gate_and_report_are_those_of_the_command(mini: Executed, tmp_path: Path) -> None:
    result = adeye.gate(db=mini.db)
    assert (result.exit_code, bool(result)) == (mini.summary.exit_code, True)
    written = adeye.report(1, junit=tmp_path / "j.xml", json=str(tmp_path / "r.json"), db=mini.db)
    assert written.campaign == result.campaign == mini.summary.campaign
    assert sorted(path.name for path in tmp_path.iterdir()) == ["j.xml", "r.json"]
    assert json.loads((tmp_path / "r.json").read_text("utf-8"))["campaign"] == written.campaign


def test_modules_that_are_called_are_functions_and_modules() -> None:
    for name in ("report", "trace"):
        module: Any = import_module(f"adeye.{name}")
        assert getattr(adeye, name) is module
        assert inspect.signature(module) == inspect.signature(getattr(api, name))
    assert import_module("adeye.trace").TRACE_SCHEMA
    said = python("-c", "import adeye; print(callable(adeye.report), callable(adeye.trace))").stdout
    assert said.split() == ["True", "True"]


def test_records_are_short_where_they_are_shown(mini: Executed) -> None:
    run = mini.project.rows()[0]["run"]
    short = mini.summary.campaign[:10]
    done = f"<CampaignSummary {short}: 28 executed and 0 reused of 28, OK"
    judged = adeye.stl("always(gap > 2)", {"time": [0.0, 1.0], "gap": [9.0, 5.0]})
    found: list[tuple[object, str]] = [
        (mini.plan, "<CampaignPlan mini: 28 test cases>"),
        (mini.summary, f"{done}, contact in 6 runs>"),
        (replace(mini.summary, contacts={}), f"{done}>"),
        (adeye.replay(run, db=mini.db), f"<Replayed {run[:10]}: identical>"),
        (adeye.gate(db=mini.db), f"<GateResult {short}: OK, "),
        (adeye.report(db=mini.db), f"<Report {short}: 28 of 28 test cases, OK>"),
        (adeye.compare(db=mini.db), f"<Comparison {short}: "),
        (judged, "<JudgedTable always(gap > 2): PASS, margin 3 at 1 s>"),
    ]
    for record, text in found:
        assert repr(record).startswith(text)
        assert len(repr(record)) < 120


def test_comparison_is_the_record_that_the_command_prints(
    mini: Executed, capsys: pytest.CaptureFixture[str]
) -> None:
    found = adeye.compare("mini", adeye.CompareOptions(baseline="legacy_camera"), db=mini.db)
    options = ["--baseline", "legacy_camera", "--db", str(mini.db), "--json"]
    assert main(["compare", "mini", *options]) == int(ExitCode.OK)
    printed = json.loads(capsys.readouterr().out)
    assert printed.pop("schema") == "adeye/compare@1"
    assert printed == found.model_dump(mode="json")
    assert found.baseline == found.pairs[0].a == "legacy_camera"


def test_comparison_is_of_the_newest_campaign_unless_said(mini: Executed) -> None:
    found = adeye.compare(db=mini.db)
    assert found.campaign == mini.summary.campaign
    for name in ("1", mini.summary.campaign[:8], str(mini.project.odd)):
        assert adeye.compare(name, db=mini.db) == found
    refused(InputError, adeye.compare, "legacy_camera", db=mini.db, says="There are: 1 ")


def test_a_campaign_may_be_a_number(mini: Executed) -> None:
    assert adeye.results(1, db=mini.db).equals(adeye.results("1", db=mini.db))
    refused(InputError, adeye.results, 9, db=mini.db, says="9")
    with pytest.raises(InputError, match=r"1\.0 is no campaign"):
        adeye.results(1.0, db=mini.db)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="True is no campaign"):
        adeye.compare(True, db=mini.db)  # noqa: FBT003 - what is refused
    with pytest.raises(InputError, match="1 is no run"):
        adeye.replay(1, db=mini.db)  # type: ignore[arg-type]


@pytest.mark.parametrize("count", [0, -1, 1.5, 1.0, True, "2", None, 10**400])
@pytest.mark.parametrize("name", ["threads", "workers"])
def test_what_counts_no_threads_is_refused_before_anything_is_made(
    mini: Executed, tmp_path: Path, name: str, count: Any
) -> None:
    with pytest.raises(InputError, match=f"{name} is "):
        adeye.run(mini.plan, db=tmp_path / "new.db", **{name: count})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_result_is_as_true_as_its_gate(mini: Executed) -> None:
    assert mini.summary.exit_code == ExitCode.OK
    assert mini.summary
    for code in set(ExitCode) - {ExitCode.OK}:
        assert not replace(mini.summary, exit_code=code)
    result = gate_campaign(mini.db, None, GateOptions())
    assert result
    assert not replace(result, exit_code=ExitCode.INCOMPLETE)
    replayed = adeye.replay(mini.project.rows()[0]["run"], db=mini.db)
    assert replayed
    assert not replace(replayed, identical=False)


@pytest.mark.parametrize(("gap", "verdict"), [(9.0, "PASS"), (1.0, "FAIL"), (math.nan, "ERROR")])
def test_judged_table_is_true_if_the_formula_holds(gap: float, verdict: str) -> None:
    found = adeye.stl("always(gap > 2)", {"time": [0.0, 1.0], "gap": [9.0, gap]})
    assert (found.verdict.value, bool(found)) == (verdict, verdict == "PASS")


HUGE = [10**400, 10**5000]
TABLE = {"time": [0.0, 1.0], "gap": [9.0, 9.0]}


@pytest.mark.parametrize("number", HUGE, ids=["400 digits", "5000 digits"])
@pytest.mark.parametrize(
    "call",
    [
        lambda number, _: adeye.plan(number),
        lambda number, mini: adeye.plan(mini.plan.path, backend=number),
        lambda number, mini: adeye.plan(mini.plan.path, variant=number),
        lambda number, mini: adeye.run(mini.plan, db=number),
        lambda number, mini: adeye.run(mini.plan, executor=number),
        lambda number, mini: adeye.replay(number, db=mini.db),
        lambda number, _: adeye.replay("00000", db=number),
        lambda number, mini: adeye.results(number, db=mini.db),
        lambda number, mini: adeye.compare(number, db=mini.db),
        lambda number, mini: adeye.gate(number, db=mini.db),
        lambda number, mini: adeye.report(number, db=mini.db),
        lambda number, mini: adeye.query(number, db=mini.db),
        lambda number, mini: adeye.query("SELECT 1", campaign=number, db=mini.db),
        lambda number, mini: adeye.trace(number, db=mini.db),
        lambda number, mini: adeye.trace("0000", [number], db=mini.db),
        lambda number, _: adeye.stl(number, TABLE),
        lambda number, _: adeye.stl("always(gap > 2)", number),
        lambda number, _: adeye.stl("always(gap > 2)", {**TABLE, "gap": [9.0, number]}),
        lambda number, _: adeye.stl("always(gap > 2)", {**TABLE, "time": [0, number]}),
        lambda number, _: adeye.stl("always(gap > a)", TABLE, parameters={"a": number}),
        lambda number, _: adeye.stl("always(gap > 2)", TABLE, units={"gap": number}),
        lambda number, _: adeye.stl("always(gap > 2)", TABLE, words={"gap": [number]}),
        lambda number, _: adeye.stl("always(gap > 2)", TABLE, time=number),
        lambda number, _: adeye.stl("always(gap > 2)", TABLE, horizon=number),
    ],
)
def test_number_beyond_all_bounds_is_an_input_error(mini: Executed, call: Any, number: int) -> None:
    refused(InputError, call, number, mini)


ALWAYS = "always(gap > 2)"
WRONG: dict[str, tuple[tuple[Any, ...], Any]] = {
    "backend": ((None, 1, b"batch"), lambda mini, it: adeye.plan(mini.plan.path, backend=it)),
    "progress": ((1, "bar"), lambda mini, it: adeye.run(mini.plan, db=mini.db, progress=it)),
    "options": ((1, "camera", {}), lambda mini, it: adeye.compare(None, it, db=mini.db)),
    "units": ((None, 1, "m", [], ["gap"]), lambda _, it: adeye.stl(ALWAYS, TABLE, units=it)),
    "words": ((None, 1, "m", [], ["gap"]), lambda _, it: adeye.stl(ALWAYS, TABLE, words=it)),
    "parameters": ((None, 1, "m", []), lambda _, it: adeye.stl(ALWAYS, TABLE, parameters=it)),
    "words of 'gap'": (
        (None, 1, "near", b"near", {"near": 1}),
        lambda _, it: adeye.stl(ALWAYS, TABLE, words={"gap": it}),
    ),
    "a word of 'gap'": (
        (None, 1),
        lambda _, it: adeye.stl(ALWAYS, TABLE, words={"gap": [it]}),
    ),
}
WRONG |= {
    name: (
        given,
        lambda mini, it, name=name: adeye.compare(
            None, adeye.CompareOptions(**{name: it}), db=mini.db
        ),
    )
    for name, given in {
        "architectures": (None, 1, "camera_radar", [1], [["a"]]),
        "baseline": (1, True, ["camera_radar"]),
        "objectives": (None, 1, "margin", [1], [["margin"]]),
        "confidence": (None, "0.9", [], True),
        "epsilon": (None, 1, "margin", ["margin"]),
    }.items()
}


@pytest.mark.parametrize("name", WRONG)
def test_argument_of_a_wrong_type_is_named_with_what_is_allowed(name: str, mini: Executed) -> None:
    given, call = WRONG[name]
    for value in given:
        caught = refused(UsageError, call, mini, value)
        assert caught.message.startswith((f"{name} is ", f"{name} are "))
        assert caught.remedy.startswith("Give ")


def test_difference_that_is_no_number_is_refused(mini: Executed) -> None:
    value: Any
    for value in (None, "1", True, [], float("nan")):
        options = adeye.CompareOptions(epsilon={"margin": value})
        refused(UsageError, adeye.compare, None, options, db=mini.db, says="epsilon of margin is ")


@pytest.mark.parametrize("name", ["a\0b", "\ud800", "a\0b.parquet"])
def test_text_that_names_nothing_is_an_input_error(name: str, mini: Executed) -> None:
    refused(InputError, adeye.plan, name)
    refused(InputError, adeye.stl, ALWAYS, name)
    refused(InputError, adeye.results, db=name)
    refused(InputError, adeye.run, mini.plan, db=name)
    refused(InputError, adeye.compare, name, db=mini.db)


# --- The version is one, wherever it is asked for -------------------------------------------------


def test_version_of_the_package_is_that_of_the_distribution() -> None:
    assert adeye.__version__ == __version__
    try:
        installed = version("adeye")
    except PackageNotFoundError:
        pytest.skip("adeye is not installed here, only on the path")
    assert installed == __version__


@pytest.mark.parametrize(
    "tolerances",
    [{"m": "0.1"}, {"m": True}, {"m": math.nan}, {"m": -1.0}, {1: 0.1}, {"m": 10**400}],
)
def test_tolerance_that_is_no_size_is_refused(mini: Executed, tolerances: Any) -> None:
    says = "is no size"
    refused(UsageError, adeye.gate, db=mini.db, baseline="b.json", tolerances=tolerances, says=says)
    refused(UsageError, adeye.gate, db=mini.db, tolerances={"m": 0.1}, says="about a baseline")


def test_report_is_as_true_as_its_gate(mini: Executed) -> None:
    found = adeye.report(db=mini.db)
    for code in ExitCode:
        assert bool(found.model_copy(update={"exit_code": code})) is (code is ExitCode.OK)
