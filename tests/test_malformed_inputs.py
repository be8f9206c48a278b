"""Malformed inputs end with exit code 2, file, line and what to do; never with a traceback."""

import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import yaml

from adeye.cli import main
from tests.frozen import assert_frozen, masked

MALFORMED = Path(__file__).parent / "malformed"
FILES: dict[str, str] = yaml.safe_load((MALFORMED / "project.yaml").read_text("utf-8"))
IN_ODD, IN_SCENARIO, IN_ONE, IN_TWO, IN_CONCEPT = list(FILES)[:5]

SPEEDS = "ego_speed: [80 km/h, 100 km/h]"
NOMINAL = "    kind: nominal\n    links: [pose, camera]\n    rate: 20 Hz\n"
BOMB = "".join(f"x{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 12))


@dataclass(frozen=True)
class Flaw:
    """One malformed input.

    Attributes:
        what: Its name.
        file: The file that is changed.
        old: Text that is replaced; None for the whole file.
        new: What takes its place.
        said: A distinctive part of the message.
        where: File and line that the message names; empty for the line of the change.
    """

    what: str
    file: str
    old: str | None
    new: str | bytes
    said: str
    where: str = ""


def plugin(what: str, kind: str, said: str, more: str = "", where: str = "") -> Flaw:
    new = f"    kind: {kind}\n    links: [pose, camera]\n    rate: 20 Hz\n{more}"
    return Flaw(what, IN_ONE, NOMINAL, new, said, where)


FLAWS = [
    *(
        Flaw(what, file, text["old"], **flaw)
        for file, texts in yaml.safe_load((MALFORMED / "flaws.yaml").read_text("utf-8")).items()
        for text in texts
        for what, flaw in text["flaws"].items()
    ),
    Flaw("path that is too long", IN_ODD, "concepts/small.yaml", "c" * 3000, "is not a file"),
    Flaw("alias bomb", IN_ODD, "odd: small\n", f"odd: small\nx0: &a0 [x, x]\n{BOMB}",
         "more than 100,000 values, aliases included", "odd/small.yaml:7:"),
    Flaw("nesting bomb", IN_ODD, "seed: 7", f"seed: {'[' * 3000}", "nested more than 50 deep"),
    Flaw("not UTF-8", IN_ODD, "seed: 7", b"title: \xff\nseed: 7",
         "byte 0xff is not UTF-8. Save the file as UTF-8"),
    Flaw("file that is too large", IN_ODD, None, f"odd: small\n# {'x' * 1_000_000}\n",
         "more than 1,000,000 bytes"),
]  # fmt: skip


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write the files that have no flaw, and work in their folder."""
    for name, text in FILES.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("ADEYE_DEBUG", raising=False)
    return tmp_path


Run = Callable[..., tuple[int, str]]


@pytest.fixture
def plan(project: Path, capfd: pytest.CaptureFixture[str]) -> Run:
    """Return a function that plans as the console script does: exit code and standard error."""
    assert project.is_dir()

    def call(odd: str = IN_ODD) -> tuple[int, str]:
        code = main(["plan", odd])
        return code, capfd.readouterr().err

    return call


def put_in(project: Path, flaw: Flaw) -> int:
    """Write a flaw into its file and return its line."""
    path = project / flaw.file
    new = flaw.new if isinstance(flaw.new, bytes) else flaw.new.encode()
    if flaw.old is None:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(new)
        return 1
    before, found, after = path.read_text("utf-8").partition(flaw.old)
    assert found, f"{flaw.file} has no {flaw.old!r}"
    path.write_bytes(before.encode() + new + after.encode())
    return before.count("\n") + 1


def assert_refused(code: int, message: str) -> None:
    """Check what holds of every refusal."""
    assert code == 2, message
    assert "Traceback" not in message
    assert "defect of adeye" not in message
    assert "pydantic" not in message
    assert re.match(r"[A-Z][A-Za-z]*Error: ", message)


def test_files_without_a_flaw_are_planned(plan: Run) -> None:
    assert plan() == (0, "")


def test_at_least_forty_five_flaws_are_listed_and_differ() -> None:
    assert len(FLAWS) >= 45
    assert len({flaw.what for flaw in FLAWS}) == len(FLAWS)
    assert len({(flaw.file, flaw.old, flaw.new) for flaw in FLAWS}) == len(FLAWS)


@pytest.mark.parametrize(
    "flaw",
    [
        # Each plans a project anew; an eighth of them is tried at every change.
        pytest.param(flaw, id=flaw.what, marks=() if number % 8 == 0 else pytest.mark.slow)
        for number, flaw in enumerate(FLAWS)
    ],
)
def test_flaw_is_refused_at_its_line_with_a_remedy(flaw: Flaw, project: Path, plan: Run) -> None:
    line = put_in(project, flaw)
    begin = time.process_time()
    code, message = plan()
    assert_refused(code, message)
    assert flaw.said in message
    assert (flaw.where or f"{flaw.file}:{line}:") in message
    assert time.process_time() - begin < 10.0


@pytest.mark.parametrize("file", sorted({flaw.file for flaw in FLAWS}))
def test_messages_of_flaws_are_frozen(file: str, project: Path, plan: Run) -> None:
    """All that is said of each flaw in a file, which is as it was after each."""
    text = FILES.get(file)
    lines = []
    for flaw in FLAWS:
        # What Python says of a plug-in is its own, and what is too long is not shown.
        if flaw.file == file and "plug-in" not in flaw.what and len(str(flaw.new)) < 1000:
            put_in(project, flaw)
            code, message = plan()
            lines.append(f"{flaw.what}: {code} {message}")
            if text is not None:
                (project / file).write_text(text, "utf-8")
    name = re.sub(r"\W", "_", file)
    # So is what the library says that reads YAML.
    said = re.sub(r"(?<=no valid YAML: ).*", "…", masked("".join(lines), project))
    assert_frozen(f"flaws_{name}.txt", said)


def test_what_is_no_odd_is_refused(plan: Run) -> None:
    for odd, said in (
        ("odd/nowhere.yaml", "odd/nowhere.yaml: there is no such file. Check the path."),
        ("odd", "odd:1:1: this is a folder, not a file. Name a file."),
        ("/dev/zero", "/dev/zero:1:1: this is not a regular file. Name a file."),
        ("odd/architectures/one.yaml", "odd/architectures/one.yaml:1:1: architecture: there is no"),
        ("scenarios_db/follow.yaml", "scenarios_db/follow.yaml:"),
    ):
        code, message = plan(odd)
        assert_refused(code, message)
        assert said in message, odd


def test_several_flaws_are_listed_together(project: Path, plan: Run) -> None:
    for flaw in (
        Flaw("seed", IN_ODD, "seed: 7", "sed: 7", ""),
        Flaw("step", IN_ODD, "step: 0.05 s", "step: fast", ""),
        Flaw("fault", IN_ODD, "model: drop_out", "model: dropout", ""),
    ):
        put_in(project, flaw)
    code, message = plan()
    assert_refused(code, message)
    lines = [int(found) for found in re.findall(r"odd/small.yaml:([0-9]+):", message)]
    assert lines == [16, 21, 22]
    assert message.splitlines()[-1] == "3 errors."


def test_flaw_in_a_swept_parameter_of_a_plugin_is_found(project: Path, plan: Run) -> None:
    kind = "./planners.py:Planner"
    put_in(project, plugin("", kind, "", more="    parameters: {gain: 2}\n"))
    path = "architecture.channels.nominal.parameters.gain"
    put_in(project, Flaw("", IN_ODD, SPEEDS, f"{path}: [2, fast]", ""))
    code, message = plan()
    assert_refused(code, message)
    assert "odd/small.yaml:10:" in message
    assert "channels.nominal.parameters.gain: must be a valid number" in message


@pytest.mark.slow
def test_swept_values_that_fit_are_planned(project: Path, plan: Run) -> None:
    axes = (
        "architecture.sensors.camera.range: [80 m, 120 m]\n"
        "        scenario.world.road.lanes: [2, 3]\n"
        "        architecture.channels.nominal.parameters.confirm_hits: {from: 2, to: 4, step: 1}\n"
        "        faults.camera_out.duration: [1 s, 2 s]"
    )
    put_in(project, Flaw("", IN_ODD, SPEEDS, axes, ""))
    assert plan() == (0, "")
