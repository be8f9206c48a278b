"""What never ends is not read; a password in a location or a setting is never shown or kept."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from adeye.cli.app import main
from tests.chaos.test_fuzz import CASES_CSV, TABLE_CSV, watched
from tests.chaos.test_schema_life import READING
from tests.test_malformed_inputs import FILES, IN_ODD

CANARY = "s3cr3t-canary"
BOMBS = 100


@pytest.fixture
def folder(tmp_path: Path, unset: pytest.MonkeyPatch) -> Path:
    for name, text in {**FILES, "cases.csv": CASES_CSV, "table.csv": TABLE_CSV}.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    unset.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("place", ["/dev/zero", "pipe", "odd"])
@pytest.mark.parametrize(
    "verb",
    [("plan", "IT"), ("reference", "IT"), ("stl", "always(gap > 2)", "IT"), ("plan", IN_ODD),
     ("sensors", "IT"), ("dependencies", "IT"), ("plugins", "IT")],
)  # fmt: skip
def test_what_never_ends_is_refused(
    folder: Path, capfd: pytest.CaptureFixture[str], verb: tuple[str, ...], place: str
) -> None:
    if place == "pipe":
        os.mkfifo(folder / "pipe")
    if verb[1] == IN_ODD:
        path = folder / IN_ODD
        law = f"{{empirical: {folder / place}, column: dv, unit: km/h}}"
        text = path.read_text("utf-8").replace("full_factorial", "random\n      samples: 20")
        path.write_text(text.replace("[80 km/h, 100 km/h]", law), encoding="utf-8")
    with watched():
        assert main([place if word == "IT" else word for word in verb]) == 2
    said = capfd.readouterr().err
    assert "not a regular file" in said or "a folder" in said


@pytest.mark.slow
@pytest.mark.parametrize(
    "location",
    [
        f"mysql://user:{CANARY}@127.0.0.1:9/db",
        f"sqlite+pysqlcipher://:{CANARY}@/x.db",
        f"postgresql+other://user:{CANARY}@127.0.0.1:9/db?password={CANARY}",
    ],
)
@pytest.mark.parametrize("by_setting", [0, 1])
def test_password_of_a_location_is_never_shown(
    folder: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    location: str,
    by_setting: int,
) -> None:
    monkeypatch.setenv("ADEYE_DEBUG", "1")
    if by_setting:
        monkeypatch.setenv("ADEYE_DB", location)
    given = [] if by_setting else ["--db", location]
    for verb in (("run", IN_ODD), *READING):
        words = ["0" if word == "RUN" else word for word in verb]
        assert main([*words, *given]) in {2, 5}
        said = capfd.readouterr()
        assert CANARY not in said.out + said.err, verb
    for path in folder.rglob("*"):
        assert CANARY not in path.name
        assert not path.is_file() or CANARY.encode() not in path.read_bytes()


def bomb(number: int) -> str:
    """Write one of a hundred small texts that are large once they are built, or deep."""
    return f"# {number}\n" + _bomb(number % 5, 20 + number)


def _bomb(way: int, size: int) -> str:
    if way == 0:
        wide = ", ".join(["*a{0}"] * (size // 10))
        lines = [f"x{at}: &a{at} [{wide.format(at - 1)}]" for at in range(1, 25)]
        return "\n".join(["x0: &a0 [x, x]", *lines])
    if way == 1:
        return "a: " + "[" * (60 + 10 * size) + "]" * (60 + 10 * size)
    if way == 2:
        return "{a: " * (60 + 10 * size) + "b" + "}" * (60 + 10 * size)
    if way == 3:
        return "a: &a [*a" + ", *a" * size + "]"
    return "- " * (100 + size) + "x"


def test_bombs_are_refused_at_once(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    import time
    import tracemalloc

    from adeye.errors import SpecError
    from adeye.spec.document import load_document

    assert len({bomb(number) for number in range(BOMBS)}) == BOMBS
    tracemalloc.start()
    try:
        for number in range(BOMBS):
            (folder / "bomb.yaml").write_text(bomb(number), encoding="utf-8")
            begin = time.process_time()
            with pytest.raises(SpecError, match=r"more than|contains itself|nested"):
                load_document("bomb.yaml")
            assert time.process_time() - begin < 0.2
        assert tracemalloc.get_traced_memory()[1] < 64 * 2**20
    finally:
        tracemalloc.stop()
    assert capfd.readouterr().err == ""
