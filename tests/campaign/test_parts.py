"""Plug-ins: loaded, listed, hashed and measured with, and compared again after their blocks."""

from __future__ import annotations

import os
import py_compile
import shutil
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from adeye import plugin_code
from adeye.answers import gate_campaign
from adeye.campaign import parts as delivered
from adeye.errors import InputError, IntegrityError, SpecError
from adeye.judge.metrics import METRICS, register_metric
from adeye.judge.verdict import ExitCode, Verdict
from adeye.plugin_code import with_imports
from adeye.plugins import load_part
from adeye.report.gate.decide import GateOptions
from adeye.spec.load import load_architecture, load_odd
from adeye.store.tables import METRIC_IDS
from adeye.testing import zoo
from tests.conftest import MakeProject
from tests.project import CANDIDATE, CONCEPT, MINI, Project, one_scenario
from tests.refusals import refused
from tests.sql import rows
from tests.stored import known, stored
from tests.test_malformed_inputs import FILES, IN_ODD, IN_ONE, NOMINAL

# --- plug-ins and monitors of an architecture, checked at plan time


CHANNEL: str = stored("plugins")["own"]


@pytest.fixture
def project(make_project: MakeProject) -> Project:
    made = make_project()
    write(made)
    return made


def write(project: Project, monitors: str = "") -> None:
    path = project.folder / "odd" / "architectures" / "own.py"
    path.write_text(CHANNEL.replace("{monitors}", monitors), "utf-8")


def parts(project: Project, **channel: Any) -> delivered.Parts:
    """Load the candidate with a plug-in beside its channels."""
    if channel:
        with project.edited(CANDIDATE) as candidate:
            candidate["channels"]["own"] = {"kind": "./own.py:Own", "rate": "20 Hz", **channel}
    return delivered.load_parts(load_architecture(project.folder / CANDIDATE))


def test_architecture_of_built_in_parts_has_no_plugins(project: Project) -> None:
    found = parts(project)
    assert (found.plugins, found.digest) == ((), "")
    assert "object_danger" in found.monitors


def test_plugin_is_known_by_its_code(project: Project) -> None:
    before = parts(project, links=["front_camera"])
    assert [part.name for part in before.plugins] == ["./own.py:Own"]
    path = project.folder / "odd" / "architectures" / "own.py"
    path.write_text(path.read_text("utf-8") + "\n# a comment is a line, too\n", "utf-8")
    after = parts(project)
    assert len({before.digest, after.digest, ""}) == 3


def line_of(project: Project, error: InputError) -> str:
    """Give the line of the candidate that an error points to."""
    lines = (project.folder / CANDIDATE).read_text("utf-8").splitlines()
    return lines[known(error.where).line - 1].strip()


def test_wrong_part_is_refused_where_it_is_named(project: Project) -> None:
    with pytest.raises(SpecError, match=r"channels\.own\.parameters\.gian") as caught:
        parts(project, parameters={"gian": 2.0})
    assert "gian" in line_of(project, caught.value)
    for kind, message in (
        ("./own.py:NoChannel", r"has no act\(\)"),
        ("./own.py:Owm", "Owm"),
        ("./there.py:Own", "no file"),
        ("not_installed_anywhere:Own", "no module"),
    ):
        with pytest.raises(SpecError, match=message) as caught:
            parts(project, kind=kind)
        assert str(caught.value.where).partition(":")[0].endswith("camera_radar.yaml")
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["extra"] = {"kind": "./own.py:Own", "rate": "20 Hz"}
    refused(SpecError, parts, project, says=r"has no sense\(\)")


def test_monitor_of_two_channels_is_refused(project: Project) -> None:
    write(project, monitors='"object_danger",')
    # A class of one object per run has no monitors; on the batch it declares them.
    path = project.folder / "odd" / "architectures" / "own.py"
    batch = "    def reset(self, context):\n        pass\n\n    def act"
    text = path.read_text("utf-8").replace("(self, parameters, context)", "(self)")
    text = text.replace("self.gain = parameters.gain", "self.gain = 1.0")
    path.write_text(text.replace("    def act", batch), "utf-8")
    with pytest.raises(SpecError, match="'object_danger' is declared by another channel"):
        parts(project, links=["front_camera"])


def with_nominal(project: Project, **nominal: Any) -> delivered.Parts:
    """Load the candidate with another nominal channel."""
    with project.edited(CANDIDATE) as candidate:
        candidate["channels"]["nominal"] = nominal
    return delivered.load_parts(load_architecture(project.folder / CANDIDATE))


def policy_parts(project: Project, source: str, **nominal: Any) -> delivered.Parts:
    (project.folder / "odd" / "architectures" / "policy.py").write_text(source, "utf-8")
    policy = {"policy": "./policy.py:drive"}
    return with_nominal(project, kind="policy", parameters=policy, **nominal)


def test_code_and_files_of_a_policy_are_part_of_the_identity(project: Project) -> None:
    source = "def drive(observation):\n    return 0.0, 0.0\n"
    found = policy_parts(project, source)
    assert [part.name for part in found.plugins] == ["./policy.py:drive"]
    assert found.digest == policy_parts(project, source).digest
    changed = policy_parts(project, source + "# changed\n").digest
    (project.folder / "odd" / "architectures" / "net.bin").write_bytes(b"1")
    reading = policy_parts(project, source, files=["net.bin"])
    assert [file.name for file in reading.files] == ["net.bin"]
    assert len({found.digest, changed, reading.digest}) == 3
    with pytest.raises(SpecError, match=r"camera_radar\.yaml:\d+:\d+.*is no policy"):
        policy_parts(project, "drive = 3\n")


def listed(project: Project, *files: str) -> delivered.Parts:
    """Let the plug-in beside the candidate's channels read files."""
    return parts(project, links=["front_camera"], files=list(files))


def test_content_of_a_file_that_a_channel_reads_is_part_of_the_identity(project: Project) -> None:
    without = parts(project, links=["front_camera"])
    weights = project.folder / "odd" / "architectures" / "weights.bin"
    weights.write_bytes(b"first")
    first = listed(project, "weights.bin")
    weights.write_bytes(b"again")
    # This process has executed code with what it was.
    refused(SpecError, listed, project, "weights.bin", says="may hold what .*weights.bin was")
    plugin_code._NAMED.clear()  # as in a new process
    again = listed(project, "weights.bin")
    plugin_code._NAMED.clear()
    weights.write_bytes(b"first")
    assert [file.owner for file in first.files] == ["channels.own"]
    assert len({without.digest, first.digest, again.digest}) == 3
    assert listed(project, "weights.bin").digest == first.digest


def test_file_that_cannot_be_read_is_refused_where_it_is_listed(project: Project) -> None:
    (project.folder / "odd" / "architectures" / "weights.bin").write_bytes(b"1")
    for name, message in (
        ("weihgts.bin", "channel own: 'weihgts.bin' is not there"),
        (".", r"channel own: '\.' is no file"),
        ("../tested.yaml", r"'\.\./tested\.yaml' is outside of"),
        ("./weights.bin", r"file '\./weights\.bin' is listed twice"),
    ):
        caught = refused(SpecError, listed, project, "weights.bin", name, says=message)
        assert line_of(project, caught).removeprefix("- ").strip("'\"") == name


def process_parts(project: Project, *command: str, files: tuple[str, ...] = ()) -> delivered.Parts:
    parameters = {"command": list(command)}
    return with_nominal(project, kind="process", files=list(files), parameters=parameters)


@pytest.mark.parametrize("program", ["drive.py", "drive"])
def test_what_a_program_imports_beside_it_is_part_of_the_identity(
    project: Project, program: str
) -> None:
    folder = project.folder / "odd/architectures"
    (folder / "near").mkdir()
    (folder / program).write_text("import json, helper")
    (folder / "helper.py").write_text("from near import more")
    seen = []
    for text in ("SPEED = 3", "SPEED = 4"):
        (folder / "near/more.py").write_text(text)
        seen.append(process_parts(project, "python3", f"./{program}", files=("helper.py",)))
    names = [item.name for item in seen[0].files]
    assert names == [f"./{program}", "helper.py", "./near/more.py"]
    assert seen[0].digest != seen[1].digest


def test_what_another_python_imports_beside_a_program_is_part_of_the_identity(
    project: Project,
) -> None:
    folder = project.folder / "odd/architectures"
    (folder / "own.py").unlink()
    (folder / "drive").write_text("import helper, near")
    (folder / "near.py").write_text("print 'of Python 2'")
    for name in ("helper.pyc", "helper.cpython-399-x86_64-linux-gnu.so", "further.so", "net.bin"):
        (folder / name).write_bytes(b"\0")
    found = process_parts(project, "python3", "./drive")
    assert [item.name for item in found.files] == [
        *("./drive", "./further.so", "./helper.cpython-399-x86_64-linux-gnu.so"),
        *("./helper.pyc", "./near.py"),
    ]
    (folder / "near.py").write_text("")
    (folder / "helper.pyc").unlink()
    (folder / "helper.cpython-399-x86_64-linux-gnu.so").unlink()
    found = process_parts(project, "python3", "./drive")
    assert [item.name for item in found.files] == ["./drive", "./near.py"]


BY_NAME = (
    'import importlib\nimportlib.import_module("near")',
    'import importlib.util\nimportlib.util.spec_from_file_location("n", "near.py")',
    'from importlib import import_module\nimport_module("near")',
    'import sys\nsys.path.insert(0, "lib")\nimport far',
    'from sys import path\npath.insert(0, "lib")\nimport far',
    '__import__("near")',
    'exec(open("near.py").read())',
    'import runpy\nrunpy.run_path("near.py")',
)
"""Sources that import, or execute, what no statement of them names."""


@pytest.mark.parametrize("source", BY_NAME)
def test_program_that_imports_by_name_counts_with_all_that_it_may_import(
    project: Project, source: str
) -> None:
    folder = project.folder / "odd/architectures"
    (folder / "lib").mkdir()
    for name in ("near.py", "lib/far.py", "lib/data.txt"):
        (folder / name).write_text("SPEED = 3")
    (folder / "own.py").unlink()
    (folder / "drive.py").write_text(source)
    found = process_parts(project, "python3", "./drive.py")
    assert [item.name for item in found.files] == ["./drive.py", "./lib/far.py", "./near.py"]


@pytest.mark.parametrize("source", BY_NAME)
def test_plugin_that_imports_by_name_counts_with_all_that_it_may_import(
    tmp_path: Path, source: str
) -> None:
    (tmp_path / "lib").mkdir()
    for name in ("near.py", "lib/far.py"):
        (tmp_path / name).write_text("SPEED = 3")
    (tmp_path / "mine.py").write_text(source)
    files = [("mine.py", tmp_path / "mine.py")]
    assert {name for name, _ in with_imports(files)} == {"mine.py", "./lib/far.py", "./near.py"}
    (tmp_path / "mine.py").write_text("import os\nHERE = os.path.curdir")
    assert with_imports(files) == files


@pytest.mark.parametrize("tag", [sys.implementation.cache_tag, "cpython-399"])
def test_byte_code_of_another_source_beside_a_program_is_refused(
    project: Project, tag: str
) -> None:
    folder = project.folder / "odd/architectures"
    (folder / "drive.py").write_text("import helper")
    (folder / "helper.py").write_text("SPEED = 3")
    kept = py_compile.compile(str(folder / "helper.py"))
    Path(known(kept)).rename(folder / f"__pycache__/helper.{tag}.pyc")
    process_parts(project, "python3", "./drive.py")
    state = (folder / "helper.py").stat()
    (folder / "other.py").write_text("SPEED = 4")
    os.utime(folder / "other.py", ns=(state.st_atime_ns, state.st_mtime_ns))
    (folder / "other.py").replace(folder / "helper.py")
    says = "channel nominal: the byte code of helper is of another source"
    refused(SpecError, process_parts, project, "python3", "./drive.py", says=says)


def test_files_of_a_command_are_part_of_the_identity(project: Project) -> None:
    folder = project.folder / "odd" / "architectures"
    (folder / "drive").write_text("#!/bin/sh\n")
    (folder / "drive").chmod(0o755)
    (folder / "net.bin").write_bytes(b"1")
    found = process_parts(project, "./drive", "--fast", files=("net.bin",))
    assert [(item.owner, item.name) for item in found.files] == [
        ("channels.nominal", "./drive"),
        ("channels.nominal", "net.bin"),
    ]
    seen = {found.digest}
    (folder / "drive").write_text("#!/bin/sh\nexit\n")
    seen.add(delivered.load_parts(load_architecture(project.folder / CANDIDATE)).digest)
    (folder / "net.bin").write_bytes(b"2")
    seen.add(delivered.load_parts(load_architecture(project.folder / CANDIDATE)).digest)
    assert len(seen - {""}) == 3


def test_wrong_program_is_refused_where_it_is_written(project: Project) -> None:
    folder = project.folder / "odd" / "architectures"
    (folder / "nets").mkdir()
    (found := folder / "b.bin").touch()
    for command, files, message, line in (
        (("./gone",), (), "'./gone' is not there", "- ./gone"),
        (("sh", "-c", "exit"), (), "names no file of the project", "- sh"),
        (("sh", "./own.py"), ("own.py",), "'own.py' is listed twice", "- own.py"),
        *(
            (("sh", "./own.py", word), (), "means a file or folder in no identity", f"- {word}")
            for word in ("--of=./b.bin", "b.bin", "nets", "x:b.bin", f"-c{found}", "x;b.bin")
        ),
    ):
        caught = refused(SpecError, process_parts, project, *command, files=files, says=message)
        assert line_of(project, caught) == line
    says = "means a file or folder in no identity"
    for word in (f'{{"net": "{found}"}}', f"--net='{found}'"):
        refused(SpecError, process_parts, project, "sh", "./own.py", word, says=says)


@pytest.mark.parametrize("way", ["key", "in a mapping", "in a list", "in a list of mappings"])
def test_values_of_a_program_name_no_file_that_is_in_no_identity(
    project: Project, way: str
) -> None:
    (found := project.folder / "net.bin").touch()
    (project.folder / "odd" / "architectures" / "drive.py").touch()
    name = str(found)
    values: dict[str, dict[str, Any]] = {
        "key": {name: 1},
        "in a mapping": {"of": {"net": {name: True}}},
        "in a list": {"of": [name]},
        "in a list of mappings": {"of": [{name: 1}]},
    }
    parameters = {"command": ["python3", "./drive.py"], "values": values[way]}
    says = "means a file or folder in no identity"
    refused(SpecError, with_nominal, project, kind="process", parameters=parameters, says=says)


def test_start_values_of_an_fmu_name_no_file(project: Project) -> None:
    (found := project.folder / "gain.txt").touch()
    (file := project.folder / "odd" / "architectures" / "cruise.fmu").touch()
    with project.edited(CANDIDATE) as candidate:
        parameters = {
            "file": f"./{file.name}",
            "inputs": {"v": "ego.speed"},
            "outputs": {"acceleration": "a", "steering_angle": "delta"},
            "start": {"cfg": str(found)},
        }
        candidate["channels"]["nominal"].update(kind="fmu", parameters=parameters)
    loaded = load_architecture(project.folder / CANDIDATE)
    caught = refused(SpecError, delivered.check_words, loaded, says="in no identity")
    assert "Put the file into the resources" in str(caught)


# --- metrics from outside the package: measured, stored, judged, and part of a result


METRIC: str = stored("plugins")["top_speed"]


@pytest.fixture
def measured(make_project: MakeProject) -> Project:
    made = make_project()
    (made.folder / "odd" / "top.py").write_text(METRIC, "utf-8")
    with made.edited_odd() as odd:
        odd["plugins"] = ["./top.py:TopSpeed"]
        odd["scenarios"] = odd["scenarios"][1:]
    with made.edited(CONCEPT) as concept:
        first = concept["requirements"][0]
        bare = {key: value for key, value in first.items() if key != "formula"}
        bound = {"metric": "top_speed_mps", "at_most": 10.0}
        concept["requirements"] = [first, {**bare, "id": "FSR-99", "bound": bound}]
    return made


@pytest.mark.slow
def test_metric_is_stored_in_a_table_of_its_own_and_judged(measured: Project) -> None:
    summary = measured.run(workers=2)
    line = next(line for line in summary.verdicts if line.fsr == "FSR-99" and line.is_gate)
    assert line.verdict is Verdict.FAIL
    tables = "SELECT name FROM sqlite_master WHERE type = 'table' AND name LIKE 'metric_%'"
    [(name,)] = rows(measured.db, tables)
    query = f"SELECT min(top_speed_mps), count(*) FROM {name}"  # noqa: S608 - our own table
    [(slowest, runs)] = rows(measured.db, query)
    assert (slowest, runs) == (pytest.approx(60 / 3.6, abs=0.2), summary.planned)


@pytest.mark.slow
def test_metric_that_raises_is_refused_though_no_fsr_is_bound_on_it(measured: Project) -> None:
    with measured.edited_odd() as odd:
        odd["scenarios"][0]["sweep"] = {}
    with measured.edited(CONCEPT) as concept:
        formula = "always(ego.speed <= 40 m/s)"
        concept["requirements"] = [{**concept["requirements"][0], "formula": formula}]
    path = measured.folder / "odd" / "top.py"
    sound = measured.run()
    assert sound.exit_code is ExitCode.OK
    path.write_text(METRIC.replace("row = speed", "raise ValueError\n        row = speed"), "utf-8")
    summary = measured.run()
    assert {line.verdict for line in summary.verdicts} == {Verdict.PASS}
    said = f"metric top_speed_mps raised in {summary.planned} run"
    assert (summary.exit_code, said in summary.message) == (ExitCode.INCOMPLETE, True)
    found = gate_campaign(measured.db, None, GateOptions())
    assert [item.text[: len(said)] for item in found.findings if item.decides] == [said]
    with measured.edited_odd() as odd:
        odd["gate"] = {**odd.get("gate", {}), "channel_failures": "allow"}
    allowed = measured.run()
    assert (allowed.exit_code, said in allowed.message) == (ExitCode.OK, True)
    path.write_text(METRIC, "utf-8")
    assert "metric" not in measured.run().message


@pytest.mark.slow
def test_editing_the_metric_executes_its_runs_again(measured: Project) -> None:
    first = measured.run()
    assert measured.run().executed == 0
    path = measured.folder / "odd" / "top.py"
    path.write_text(METRIC.replace("Highest speed", "The highest speed"), "utf-8")
    assert measured.run().executed == first.planned


def test_another_odd_does_not_see_it(measured: Project) -> None:
    measured.plan()
    assert delivered.plugin_of("top_speed_mps") == "./top.py:TopSpeed"
    delivered.use_plugin_metrics((), Path())
    assert delivered.plugin_of("top_speed_mps") is None
    assert set(METRICS) == set(METRIC_IDS)


def test_blocks_that_begin_at_once_register_it_once(
    measured: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    register = register_metric

    def slowly(metric: Any) -> None:
        time.sleep(0.05)
        register(metric)

    monkeypatch.setattr(delivered, "register_metric", slowly)
    delivered.use_plugin_metrics((), Path())
    names, folder = ("./top.py:TopSpeed",), measured.folder / "odd"
    with ThreadPoolExecutor() as threads:
        begun = [threads.submit(delivered.use_plugin_metrics, names, folder) for _ in range(2)]
        assert len({part.name for item in begun for part in item.result()}) == 1
    assert delivered.plugin_of("top_speed_mps") == names[0]


def test_class_that_is_no_metric_is_refused_at_its_line(measured: Project) -> None:
    path = measured.folder / "odd" / "top.py"
    path.write_text(METRIC.replace("def compute", "def measure"), "utf-8")
    refused(InputError, measured.plan, says=r"tested.yaml:\d+:\d+: .* has no compute\(\)")


# --- plug-ins are listed with the hash that loading them gives, and none is imported


BOMB = "import pathlib\npathlib.Path({canary!r}).touch()\n\nclass Planner:\n    pass\n"


@pytest.fixture
def canary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install a package that says so when it is imported."""
    canary = tmp_path / "canary"
    package = tmp_path / "site" / "bombs"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(BOMB.format(canary=str(canary)), encoding="utf-8")
    info = tmp_path / "site" / "bombs-1.2.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bombs\nVersion: 1.2\n")
    (info / "entry_points.txt").write_text(
        "[adeye.channels]\nbomb = bombs:Planner\n[other]\nx = bombs:X\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    return canary


@pytest.fixture
def odd(tmp_path: Path) -> Path:
    texts = {**FILES, IN_ONE: FILES[IN_ONE].replace(NOMINAL, NOMINAL.replace(
        "kind: nominal", "kind: bombs:Planner"))}  # fmt: skip
    texts[IN_ODD] += "plugins: [./metric.py:Odd, ./missing.py:Odd]\n"
    texts["odd/metric.py"] = "raise SystemExit\n"
    for name, text in texts.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / IN_ODD


def test_packages_offer_without_being_imported(canary: Path) -> None:
    (found,) = [item for item in delivered.offered() if item.package == "bombs"]
    assert (found.kind, found.name, found.version) == ("channels", "bomb", "1.2")
    assert found.source == "bombs:Planner"
    assert not canary.exists()
    assert "bombs" not in sys.modules


def test_named_plugins_have_the_hash_that_loading_gives(canary: Path, odd: Path) -> None:
    found = {(item.kind, item.source): item.digest for item in delivered.named(load_odd(odd))}
    assert not canary.exists()
    assert len(found["metric", "./metric.py:Odd"]) == 64
    assert found["metric", "./missing.py:Odd"] == ""
    try:
        loaded = load_part("bombs:Planner", odd.parent)
    finally:
        sys.modules.pop("bombs", None)
    assert canary.exists()
    assert found["channel", "bombs:Planner"] == loaded.source_digest


# --- what a plan hashed is compared again: code, packages, files that channels read, metrics


WATCHED: str = stored("plugins")["watched"]


@pytest.fixture
def watched(make_project: MakeProject, monkeypatch: pytest.MonkeyPatch) -> Project:
    """Name a package, a program, and weights that a plug-in reads."""
    made = make_project({**MINI, "faults": [], "architectures": ["architectures/own.yaml"]})
    folder = made.folder / "odd" / "architectures"
    package = made.folder / "site" / "unchanging"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "gain.py").write_text("GAIN = 0.0\n")
    (package / "steady.py").write_text(WATCHED.format(package="unchanging."))
    monkeypatch.syspath_prepend(str(package.parent))
    # Another test has imported its own.
    for module in [module for module in sys.modules if module.partition(".")[0] == "unchanging"]:
        monkeypatch.delitem(sys.modules, module)
    (folder / "alone.py").write_text(WATCHED.replace("from {package}gain import GAIN", "GAIN = 0"))
    (folder / "weights.bin").write_bytes(b"1")
    zoo.settle(folder)
    own: dict[str, Any] = made.read("odd/architectures/camera_radar.yaml")
    own["architecture"] = "own"
    plain = {"links": ["localisation"]}
    own["channels"] |= {
        "packed": {**plain, "kind": "unchanging.steady:Steady"},
        "alone": {**plain, "kind": "./alone.py:Steady", "files": ["weights.bin"]},
        "program": {**plain, "kind": "process", "parameters": zoo.parameters()},
    }
    made.write("odd/architectures/own.yaml", own)
    with made.edited_odd() as odd:
        odd["gate"] = {"architectures": ["own"]}
    return made


def files(watched: Project) -> dict[str, Path]:
    folder = watched.folder / "odd" / "architectures"
    package = watched.folder / "site" / "unchanging"
    names = (
        package / "gain.py",
        *(folder / name for name in ("alone.py", "weights.bin", "zoo.py")),
    )
    return dict(zip(NAMES, names, strict=True))


NAMES = ["unchanging.steady:Steady", "./alone.py:Steady", "weights.bin", "./zoo.py"]


@pytest.mark.parametrize("name", NAMES)
def test_change_is_told_with_its_file_and_who_names_it(watched: Project, name: str) -> None:
    plan = watched.plan()
    path = files(watched)[name]
    original = path.read_bytes()
    for is_first in (True, False):  # since the plan, and since a block
        path.write_bytes(original)
        unchanged = delivered.Unchanged(plan)
        if not is_first:
            unchanged.check()
        path.write_bytes(original + b"\n# changed")
        told = refused(IntegrityError, unchanged.check)
        assert str(told).startswith(f"{name}, which architecture own names, was changed")
        if not is_first or name != NAMES[0]:
            assert str(path) in str(told)
    path.unlink()
    refused(IntegrityError, unchanged.check, says=name)


def test_what_nobody_writes_is_hashed_once(
    watched: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    hashed: list[str] = []
    unchanged = delivered.Unchanged(watched.plan())
    original = type(next(iter(unchanged._seen))).is_as_planned

    def counting(source: Any) -> bool:
        hashed.append(source.name)
        return original(source)

    monkeypatch.setattr("adeye.campaign.parts.Source.is_as_planned", counting)
    for _ in range(3):
        unchanged.check()
    assert sorted(hashed) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("is_first", [True, False])
def test_file_that_was_another_one_meanwhile_is_noticed(
    watched: Project, name: str, *, is_first: bool
) -> None:
    path = files(watched)[name]
    unchanged = delivered.Unchanged(watched.plan())
    if not is_first:
        unchanged.check()
    original, state = path.read_bytes(), path.stat()
    path.write_bytes(original + b"2")
    path.write_bytes(original)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))
    told = refused(IntegrityError, unchanged.check, says="was changed after the campaign")
    assert str(path) in str(told)


def switch(link: Path, target: str) -> None:
    """Lead a link elsewhere at once, as who deploys does."""
    other = link.with_name(f"{link.name}.new")
    other.symlink_to(target)
    other.replace(link)


@pytest.mark.parametrize("kind", ["folder", "file", "link behind a link"])
@pytest.mark.parametrize("is_put_back", [False, True])
def test_link_that_is_switched_meanwhile_is_noticed(
    watched: Project, kind: str, *, is_put_back: bool
) -> None:
    folder = watched.folder / "odd" / "architectures"
    for version, content in (("v1", b"1"), ("v2", b"2")):
        (folder / version).mkdir()
        (folder / version / "weights.bin").write_bytes(content)
    link = folder / "current"
    link.symlink_to("v1")
    named, target = "current/weights.bin", "v2"
    if kind == "link behind a link":
        (folder / "weights.bin").unlink()
        (folder / "weights.bin").symlink_to("current/weights.bin")
        named = "weights.bin"
    if kind == "file":
        link.unlink()
        link.symlink_to("v1/weights.bin")
        named, target = "current", "v2/weights.bin"
    with watched.edited("odd/architectures/own.yaml") as own:
        own["channels"]["alone"]["files"] = [f"./{named}"]
    unchanged = delivered.Unchanged(watched.plan())
    unchanged.check()
    former = str(link.readlink())
    switch(link, target)
    if is_put_back:
        switch(link, former)
    refused(IntegrityError, unchanged.check, says="was changed after the campaign")


def test_copy_of_the_same_size_and_time_is_noticed(watched: Project, tmp_path: Path) -> None:
    unchanged = delivered.Unchanged(watched.plan())
    unchanged.check()
    path = files(watched)["weights.bin"]
    other = tmp_path / "other.bin"
    other.write_bytes(b"2")
    shutil.copystat(path, other)
    other.replace(path)
    refused(IntegrityError, unchanged.check, says=r"weights\.bin")


def test_campaign_without_plugins_has_nothing_to_compare(make_project: MakeProject) -> None:
    assert not delivered.Unchanged(make_project().plan())._seen


def test_setting_that_a_metric_changes_while_it_measures_ends_the_campaign(
    make_project: MakeProject,
) -> None:
    """What another metric finds in a module of both would hang on which of them came first."""
    project = make_project(one_scenario())
    folder = project.folder / "odd"
    (folder / "setting_of_two.py").write_text("GAIN = {'speed': 1.0}\n")
    beside = (
        "import os, sys\nsys.path.insert(0, os.path.dirname(__file__))\nimport setting_of_two\n"
    )
    (folder / "reads.py").write_text(beside + METRIC)
    other = METRIC.replace("top_speed", "other_speed").replace("TopSpeed", "Other")
    set_late = "        setting_of_two.GAIN['speed'] = 2.0\n        speed = "
    (folder / "sets.py").write_text(beside + other.replace("        speed = ", set_late))
    with project.edited("odd/tested.yaml") as odd:
        odd["plugins"] = ["./reads.py:TopSpeed", "./sets.py:Other"]
    refused(SpecError, project.run, says=r"GAIN\['speed'\] in it is not what its source says")
