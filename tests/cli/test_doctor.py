"""``doctor`` and ``plugins``; the table of capabilities never claims ahead of its proofs."""

import json
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import adeye.campaign.plan
import adeye.campaign.warmup
import adeye.kernel.jit
from adeye import __version__
from adeye.cli import doctor, run
from adeye.cli.doctor import Status, capabilities
from adeye.cli.run import SHIPPED
from adeye.kernel.jit import cache_directory
from adeye.report.credibility import SelfTestResult, write_result
from adeye.simulate.engine import NUMERICS_VERSION
from adeye.spec.load import shipped
from adeye.store import schema
from tests.cli.conftest import Verb
from tests.test_malformed_inputs import FILES

# --- ``doctor``: what is fine, and that what is not fine is no success


ROOT = Path(__file__).parents[2]


def test_libraries_are_those_that_the_project_declares() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    declared = [text.partition(">")[0] for text in project["dependencies"]]
    assert sorted(doctor.LIBRARIES) == sorted(declared)


def test_healthy_installation_is_a_success_and_the_self_test_not_run_yet(adeye: Any) -> None:
    ended = adeye("doctor", "--json").ok
    checks = {check["name"]: check for check in ended.document["checks"]}
    assert checks["adeye"]["text"] == __version__
    assert checks.keys() >= {*doctor.LIBRARIES, "python", "database", "compiled code", "processors"}
    assert checks["self-test"]["is_ok"]
    assert "adeye selftest" in checks["self-test"]["text"]
    assert "BAD" not in adeye("doctor").out


def test_missing_library_is_no_success(adeye: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "LIBRARIES", ("no-such-library",))
    ended = adeye("doctor")
    assert ended.code == 5
    assert "not installed" in ended.out
    assert "no-such-library" in ended.err


def test_database_of_this_release_or_none_yet_is_fine_and_of_another_is_not(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    check = doctor.check_database(None)
    assert check.is_ok
    assert "does not exist yet" in check.text
    assert list(folder.iterdir()) == []
    schema.upgrade(folder / "x.db")
    check = doctor.check_database(str(folder / "x.db"))
    assert check.is_ok
    assert schema.head() in check.text
    monkeypatch.setattr(schema, "head", lambda: "9999")
    check = doctor.check_database(str(folder / "x.db"))
    assert not check.is_ok
    assert "adeye db upgrade" in check.text


def test_self_test_that_was_not_passed_is_not_fine(folder: Path) -> None:
    bad = SelfTestResult(
        version=__version__,
        numerics_version=NUMERICS_VERSION,
        created="2026-01-02T03:04:05",
        masters=2,
        detected=1,
        low=0.1,
        confidence=0.95,
        undetected=("ghost",),
    )
    write_result(bad, folder / ".adeye")
    check = doctor.check_self_test(None)
    assert not check.is_ok
    assert "ghost" in check.text
    good = bad.model_copy(update={"detected": 2, "undetected": ()})
    write_result(good, folder)
    assert doctor.check_self_test(str(folder / "x.db")).is_ok
    assert not doctor.check_self_test("postgresql://x").is_ok


@pytest.mark.parametrize("content", ["", "not a database, but long enough to be one\n" * 99])
def test_other_file_is_not_fine(folder: Path, content: str) -> None:
    (folder / "x.db").write_text(content)
    assert not doctor.check_database(str(folder / "x.db")).is_ok


def test_state_of_the_compiled_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(adeye.kernel.jit, "cache_directory", lambda: tmp_path)
    for word, is_warm in (("warm", True), ("cold", False)):
        monkeypatch.setattr(adeye.kernel.jit, "is_cache_warm", lambda *_, warm=is_warm: warm)
        check = doctor.check_compiled_code()
        assert check.is_ok
        assert word in check.text


def test_requirements_are_all_listed(adeye: Any) -> None:
    document = json.loads(adeye("doctor", "--requirements", "--json").out)
    assert [item["id"] for item in document["requirements"]] == [f"R{n}" for n in range(1, 24)]
    assert "R23" in adeye("doctor", "--requirements").out


# --- the table of capabilities never claims ahead of its proofs


def test_status_has_its_proof() -> None:
    for item in capabilities():
        assert item.text
        prefix = f"tests/requirements/test_r{int(item.id[1:]):02d}_"
        assert item.proof.startswith(prefix) == (item.status is not Status.NOT_YET), item.id


def test_proofs_are_the_files_that_exist() -> None:
    found = {f"tests/requirements/{path.name}" for path in ROOT.glob("tests/requirements/test_r*")}
    assert found == {item.proof for item in capabilities() if item.proof}


# --- ``plugins``


def test_plugins_of_an_odd_are_listed(adeye: Verb, folder: Path) -> None:
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    odd = folder / "odd/small.yaml"
    said = adeye("plugins", str(odd))
    assert (said.code, "The ODD names no plug-in." in said.out) == (0, True)
    with odd.open("a", encoding="utf-8") as file:
        file.write("plugins: [./architectures/leaving.py:Gone, ./none.py:No]\n")
    said = adeye("plugins", str(odd)).ok
    assert "./architectures/leaving.py:Gone" in said.out
    assert "not found" in said.out
    found = json.loads(adeye("plugins", str(odd), "--json").out)
    assert [bool(item["digest"]) for item in found["named"]] == [True, False]
    assert "there is no such file" in adeye("plugins", "nowhere.yaml").refused


# --- ``warmup``: which ODDs are compiled for, and what is said


class Warm:
    """Stands for planning and compiling, a second each; remembers what was asked."""

    def __init__(self) -> None:
        self.plans: list[tuple[Path, dict[str, Any]]] = []
        self.aside: list[Any] = []
        self.now = 0.0

    def make_plan(self, path: Path, **options: Any) -> Any:
        self.now += 1.0
        self.plans.append((path, options))
        return SimpleNamespace(compiled_parts=frozenset())

    def compile_aside(self, *given: Any) -> None:
        self.aside.append(given[1])

    def warm_up(self, _plan: Any, _progress: Any) -> None:
        self.now += 1.0


@pytest.fixture
def warm(monkeypatch: pytest.MonkeyPatch) -> Warm:
    fake = Warm()
    monkeypatch.setattr(adeye.campaign.plan, "make_plan", fake.make_plan)
    monkeypatch.setattr(adeye.campaign.warmup, "warm_up", fake.warm_up)
    monkeypatch.setattr(adeye.campaign.warmup, "compile_aside", fake.compile_aside)
    monkeypatch.setattr(adeye.kernel.jit, "is_cache_warm", lambda *_: True)
    monkeypatch.setattr(run, "time", SimpleNamespace(perf_counter=lambda: fake.now))
    return fake


def test_all_is_compiled_aside_where_nothing_was_before(
    adeye: Any, warm: Warm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adeye.kernel.jit.is_cache_warm", lambda *_: False)
    monkeypatch.setattr("adeye.campaign.warmup.begin_aside", lambda count: count)
    monkeypatch.setattr(run, "usable_processors", lambda: 2)
    begun: list[Any] = []
    monkeypatch.setattr("adeye.campaign.warmup.compile_meanwhile", lambda *it: begun.append(it))
    adeye("warmup", "a.yaml")
    warm.plans[0][1]["meanwhile"]("the plan")
    assert (begun, warm.aside) == ([("the plan", 2)], [2])


def test_shipped_odds_are_compiled_for_unless_some_are_named(adeye: Any, warm: Warm) -> None:
    ended = adeye("warmup").ok
    assert [path for path, _ in warm.plans] == [shipped("odd") / name for name in SHIPPED]
    assert all(path.is_file() for path, _ in warm.plans)
    assert f"Compiled in 4 s, kept in {cache_directory()}" in ended.out


def test_named_odds_and_options_are_passed_on(adeye: Any, warm: Warm) -> None:
    document = adeye("warmup", "a.yaml", "b.yaml", "--variant", "fast", "--json").document
    options = {"backend": "batch", "variant": "fast", "meanwhile": None}
    assert warm.plans == [(Path("a.yaml"), options), (Path("b.yaml"), options)]
    assert (document["odds"], document["seconds"]) == (["a.yaml", "b.yaml"], 4.0)


def test_odd_that_does_not_exist_is_an_input_error(adeye: Any) -> None:
    assert adeye("warmup", "nowhere.yaml").code == 2
