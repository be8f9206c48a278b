"""The compiler's door: where machine code is kept, and that it is never stale."""

import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from adeye.kernel import jit, linking
from adeye.kernel.jit import compiled, inlined
from adeye.signals import Floats

INNER = """
from adeye.kernel.jit import compiled

@compiled
def inner(x: float) -> float:
    return {factor} * x
"""
OUTER = """
from adeye.inner import inner
from adeye.kernel.jit import compiled

@compiled
def outer(x: float) -> float:
    return inner(x)
"""
ASK = "from adeye.kernel.jit import cache_directory, is_cache_warm; "


def run(program: str, package: Path, **environment: str) -> list[str]:
    """Run a program on another copy of the package; return the lines it prints."""
    kept = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    # Python tells a changed file by its second and size, which are the same here.
    fixed = {"PYTHONPATH": str(package), "PYTHONDONTWRITEBYTECODE": "1"}
    environment = {**kept, **fixed, **environment}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        cwd=package,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small package around the modules under test."""
    kernel = tmp_path / "source" / "adeye" / "kernel"
    kernel.mkdir(parents=True)
    for module in (jit, linking):
        source = Path(str(module.__file__))
        (kernel / source.name).write_bytes(source.read_bytes())
    (kernel / "__init__.py").touch()
    (kernel.parent / "__init__.py").touch()
    (kernel.parent / "plain.py").write_text("SUBJECT = 1\n")
    (kernel.parent / "inner.py").write_text(INNER.format(factor=2.0))
    (kernel.parent / "outer.py").write_text(OUTER)
    return tmp_path / "source"


@compiled
def ratio(a: float, b: float) -> float:
    """Divide."""
    return a / b


def test_compiled_function_computes_as_written() -> None:
    assert ratio(1.0, 3.0) == 1.0 / 3.0
    # Reassociated or contracted, this would be exactly zero.
    total = compiled(lambda: (0.1 + 0.2) - 0.3)
    assert total() == (0.1 + 0.2) - 0.3 != 0.0


@pytest.mark.skipif(bool(os.environ.get("NUMBA_DISABLE_JIT")), reason="plain Python raises")
def test_division_by_zero_follows_ieee_754() -> None:
    assert ratio(1.0, 0.0) == math.inf
    assert math.isnan(ratio(0.0, 0.0))


@pytest.mark.slow
def test_change_in_another_file_is_never_stale(package: Path, tmp_path: Path) -> None:
    program = "from adeye.outer import outer; print(outer(1.0))"
    cache = str(tmp_path / "cache")
    assert run(program, package, XDG_CACHE_HOME=cache) == ["2.0"]
    (package / "adeye" / "inner.py").write_text(INNER.format(factor=3.0))
    assert run(program, package, XDG_CACHE_HOME=cache) == ["3.0"]


@pytest.mark.slow
def test_code_from_outside_is_not_kept_on_disk(package: Path, tmp_path: Path) -> None:
    program = "from outside import inner; print(inner(1.0))"
    (package / "outside.py").write_text("from gains import GAIN\n" + INNER.format(factor="GAIN"))
    for gain in ("2.0", "3.0"):
        (package / "gains.py").write_text(f"GAIN = {gain}\n")
        assert run(program, package, XDG_CACHE_HOME=str(tmp_path / "cache")) == [gain]


@pytest.mark.slow
def test_cache_is_warm_once_said_so_and_cold_for_other_sources(
    package: Path, tmp_path: Path
) -> None:
    program = ASK + "from adeye.kernel.jit import mark_cache_warm; print(is_cache_warm()); "
    program += "mark_cache_warm(); print(is_cache_warm())"
    # A folder of the user's own choice is the same for all sources.
    for variable in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        cache = {variable: str(tmp_path / variable)}
        (tmp_path / variable).mkdir()
        assert run(program, package, **cache) == ["False", "True"]
        assert run(program, package, **cache) == ["True", "True"]
        (package / "adeye" / "inner.py").write_text(INNER.format(factor=len(variable)))
        assert run(program, package, **cache) == ["False", "True"]


def test_a_part_is_warm_once_it_was_used(package: Path, tmp_path: Path) -> None:
    program = ASK + "from adeye.kernel.jit import mark_cache_warm; mark_cache_warm('camera/a'); "
    program += "print(is_cache_warm(), is_cache_warm('camera/a'), is_cache_warm('camera/a', 'b'))"
    assert run(program, package, XDG_CACHE_HOME=str(tmp_path)) == ["True True False"]


def test_nothing_to_compile_is_warm(package: Path, tmp_path: Path) -> None:
    program = ASK + "print(is_cache_warm())"
    environment = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "NUMBA_DISABLE_JIT": "1"}
    assert run(program, package, **environment) == ["True"]


def test_folder_depends_on_compiled_sources_only(package: Path, tmp_path: Path) -> None:
    program = ASK + "print(cache_directory())"
    cache = str(tmp_path / "cache")
    first = run(program, package, XDG_CACHE_HOME=cache)
    assert Path(first[0]).parent == tmp_path / "cache" / "adeye" / "numba"
    (package / "adeye" / "plain.py").write_text("SUBJECT = 2\n")
    assert run(program, package, XDG_CACHE_HOME=cache) == first
    (package / "adeye" / "kernel" / "new.py").write_text("NUMBER = 1.0\n")
    assert run(program, package, XDG_CACHE_HOME=cache) != first


def folder_of(package: Path, **environment: str) -> Path:
    """Ask where machine code is kept."""
    return Path(run(ASK + "print(cache_directory())", package, **environment)[0])


def test_choice_of_the_user_is_kept(package: Path, tmp_path: Path) -> None:
    program = ASK + "import os; print(cache_directory(), os.environ['NUMBA_CACHE_DIR'])"
    mine = str(tmp_path / "mine")
    assert run(program, package, NUMBA_CACHE_DIR=mine) == [f"{mine} {mine}"]


def test_folder_inherited_from_a_parent_is_not_a_choice(package: Path, tmp_path: Path) -> None:
    stale = str(tmp_path / "stale")
    inherited = {"NUMBA_CACHE_DIR": stale, "ADEYE_NUMBA_CACHE_DIR": stale}
    found = folder_of(package, XDG_CACHE_HOME=str(tmp_path / "cache"), **inherited)
    assert found.is_relative_to(tmp_path / "cache")


def test_numba_imported_before_still_uses_the_folder(package: Path, tmp_path: Path) -> None:
    program = "import numba; " + ASK + "print(cache_directory() == type(cache_directory())("
    program += "jit.compiler().config.CACHE_DIR))"
    program = "from adeye.kernel import jit; " + program
    assert run(program, package, XDG_CACHE_HOME=str(tmp_path / "cache")) == ["True"]


@pytest.mark.slow
def test_compiler_waits_for_the_first_call(package: Path, tmp_path: Path) -> None:
    program = (
        "import sys; from adeye.outer import outer; print('numba' in sys.modules); "
        "print(outer(1.0), 'numba' in sys.modules, len(outer.signatures))"
    )
    printed = run(program, package, XDG_CACHE_HOME=str(tmp_path / "cache"))
    assert (printed[0], printed[1].split()[1:]) == ("False", ["True", "1"])


def test_kernel_is_found_by_its_name_in_other_processes(package: Path, tmp_path: Path) -> None:
    program = "import pickle; from adeye.outer import outer; again = pickle.loads("
    program += "pickle.dumps(outer)); print(again is outer)"
    assert run(program, package, XDG_CACHE_HOME=str(tmp_path / "cache")) == ["True"]


@pytest.mark.parametrize("is_taken", [False, True])
def test_unwritable_cache_has_a_fallback(package: Path, tmp_path: Path, *, is_taken: bool) -> None:
    (tmp_path / "file").touch()
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    open_to_all = temporary / f"adeye-numba-{os.getuid()}"
    if is_taken:
        open_to_all.mkdir()
        open_to_all.chmod(0o777)
    found = folder_of(package, XDG_CACHE_HOME=str(tmp_path / "file"), TMPDIR=str(temporary))
    assert found.is_relative_to(temporary)
    assert not is_taken or not found.is_relative_to(open_to_all)
    private = found if is_taken else found.parent
    assert private.stat().st_mode & 0o077 == 0


def test_relative_cache_home_is_ignored(package: Path, tmp_path: Path) -> None:
    found = folder_of(package, XDG_CACHE_HOME="here", HOME=str(tmp_path))
    assert found.parent == tmp_path / ".cache" / "adeye" / "numba"


def test_this_process_has_a_writable_folder() -> None:
    with tempfile.TemporaryFile(dir=jit.cache_directory()):
        assert len(jit.source_digest()) == 24


@compiled
def fill(values: Floats, number: float) -> None:
    for place in range(values.shape[0]):
        values[place] = double(number) + place


@inlined
def double(number: float) -> float:
    return 2.0 * number


def test_a_compiled_function_changes_the_array_and_leaves_it_to_its_owner() -> None:
    values = np.zeros(3)
    before = sys.getrefcount(values)
    for _ in range(100):
        fill(values, 1.5)
        fill(values[1:], 1.5)
    assert values.tolist() == [3.0, 3.0, 4.0]
    assert sys.getrefcount(values) == before


def test_an_inlined_function_can_be_called_by_itself() -> None:
    assert double(0.5) == 1.0


TOGETHER = """
import sys, time
from pathlib import Path
from adeye.outer import outer

folder, name, other = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
(folder / name).touch()
while not (folder / other).exists():
    time.sleep(0.001)
outer(1.0)
print(sum(outer.stats.cache_hits.values()), sum(outer.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_two_processes_that_start_together_compile_once(package: Path, tmp_path: Path) -> None:
    (tmp_path / "cache").mkdir()
    environment = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": str(package),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }
    both = [
        subprocess.Popen(
            [sys.executable, "-c", TOGETHER, str(tmp_path), *names],
            env=environment,
            cwd=package,
            stdout=subprocess.PIPE,
            text=True,
        )
        for names in (("one", "other"), ("other", "one"))
    ]
    assert sorted(process.communicate()[0].strip() for process in both) == ["0 1", "1 0"]
