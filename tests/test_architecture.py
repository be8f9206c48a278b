"""The shape of the repository: layers, module size, names, light imports."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from tests.processes import python

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "adeye"
MODULES = sorted(PACKAGE.rglob("*.py"))

MAX_LINES = 900
MAX_FILE_BYTES = 1_000_000
VAGUE_NAMES = {"utils", "util", "helpers", "helper", "common", "manager", "data", "misc"}

# Third parties that belong to one part of the product.
ONE_PLACE = {
    "alembic": ("adeye.store",),
    "cryptography": ("adeye.report",),
    "foxglove": ("adeye.exchange",),
    "highway_env": ("adeye.simulate.traffic.highway",),
    "jinja2": ("adeye.report",),
    "mcap": ("adeye.exchange",),
    "osi3": ("adeye.exchange",),
    "plotille": ("adeye.cli",),
    "pyarrow": ("adeye.report",),
    "pythonfmu3": ("adeye.simulate.fmu_export",),
    "rich": ("adeye.cli",),
    "rosbags": ("adeye.exchange",),
    "scipy": ("adeye.analysis", "adeye.judge", "adeye.sweep"),
    "sqlalchemy": ("adeye.store",),
    "typer": ("adeye.cli",),
}
# Released together with, and pinned by, a declared dependency.
COMPANIONS = {"llvmlite": "numba", "markupsafe": "jinja2", "pydantic_core": "pydantic"}
# Known to type checkers alone.
STUBS = {"_typeshed"}


def dotted(module: Path) -> str:
    parts = module.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(module: Path) -> Iterator[str]:
    """Yield the top-level name of everything the module imports, also inside functions."""
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield node.module.partition(".")[0]


def third_parties(module: Path) -> set[str]:
    return {name for name in imports(module) if name not in sys.stdlib_module_names} - {
        "adeye",
        *STUBS,
    }


def stored_files() -> list[Path]:
    """Return every file git tracks or would add."""
    if not (ROOT / ".git").exists():
        pytest.skip("a source archive has no list of tracked files")
    listing = subprocess.run(
        ["git", "-c", "safe.directory=*", "ls-files", "-coz", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        check=True,
    )
    paths = (ROOT / name.decode() for name in listing.stdout.split(b"\0") if name)
    return [path for path in paths if path.is_file()]


def test_the_scan_sees_the_package() -> None:
    assert {"adeye", "adeye.spec.scenario", "adeye.errors"} <= {dotted(path) for path in MODULES}


def test_module_has_at_most_900_lines() -> None:
    sizes = {dotted(path): len(path.read_text("utf-8").splitlines()) for path in MODULES}
    assert {name: lines for name, lines in sizes.items() if lines > MAX_LINES} == {}


@pytest.mark.slow
def test_module_begins_with_a_docstring() -> None:
    trees = {dotted(path): ast.parse(path.read_text("utf-8")) for path in MODULES}
    assert [name for name, tree in trees.items() if not ast.get_docstring(tree)] == []


def test_folder_of_modules_is_a_package() -> None:
    # A forgotten __init__.py hides modules from import-linter.
    folders = {path.parent for path in MODULES}
    assert [str(f.relative_to(ROOT)) for f in folders if not (f / "__init__.py").exists()] == []


def test_test_folders_are_not_packages() -> None:
    assert list((ROOT / "tests").rglob("__init__.py")) == []


def test_module_name_says_its_subject() -> None:
    parts = {part for path in MODULES for part in dotted(path).split(".")}
    assert parts & VAGUE_NAMES == set()


def test_no_stored_file_is_over_one_megabyte() -> None:
    sizes = {str(path.relative_to(ROOT)): path.stat().st_size for path in stored_files()}
    assert sizes
    assert {name: size for name, size in sizes.items() if size > MAX_FILE_BYTES} == {}


@pytest.mark.slow
def test_third_party_import_is_a_declared_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    # What develops the product is no part of it.
    extras = project["optional-dependencies"].items()
    needed = [text for extra, texts in extras if extra not in {"bench", "dev"} for text in texts]
    texts = [*project["dependencies"], *needed]
    declared = {re.split(r"[\[>]", text)[0].lower() for text in texts}
    distributions = packages_distributions()
    undeclared = {
        (dotted(path), name)
        for path in MODULES
        for name in third_parties(path)
        # What is not installed, as parts of an extra may be, has the name that it is imported by.
        if not declared & {d.lower() for d in distributions.get(COMPANIONS.get(name, name), [name])}
    }
    assert undeclared == set()


@pytest.mark.slow
def test_library_is_imported_in_its_one_place() -> None:
    used = {dotted(path): third_parties(path) for path in MODULES}
    strangers = [
        (module, library)
        for library, places in ONE_PLACE.items()
        for module, libraries in used.items()
        if library in libraries
        and not any(f"{module}.".startswith(f"{place}.") for place in places)
    ]
    assert strangers == []


@pytest.mark.slow
def test_kernel_imports_numpy_and_numba_only() -> None:
    kernel = [path for path in MODULES if path.is_relative_to(PACKAGE / "kernel")]
    assert kernel
    foreign = {dotted(path): third_parties(path) - {"numpy", "numba"} for path in kernel}
    assert {name: libraries for name, libraries in foreign.items() if libraries} == {}


@pytest.mark.slow
def test_imports_keep_the_contracts() -> None:
    result = python(Path(sys.executable).with_name("lint-imports"))
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.slow
def test_importing_the_command_line_loads_nothing_heavy() -> None:
    heavy = ["highway_env", "numba", "numpy", "pandas", "scipy", "sqlalchemy"]
    program = f"import sys, adeye.cli; print(sorted(set({heavy!r}) & set(sys.modules)))"
    result = python("-c", program)
    assert (result.returncode, result.stdout.strip()) == (0, "[]"), result.stderr


NAMED = ("zip", "open", "load", "savez_compressed")


@cache
def every_call() -> list[tuple[str, str, dict[str, str]]]:
    """List the calls of these names: module, function as it is written, keywords."""
    return [
        (
            dotted(module),
            ast.unparse(node.func),
            {str(k.arg): ast.unparse(k.value) for k in node.keywords},
        )
        for module in MODULES
        for node in ast.walk(ast.parse(module.read_text("utf-8")))
        if isinstance(node, ast.Call)
        and (getattr(node.func, "id", "") in NAMED or getattr(node.func, "attr", "") in NAMED)
    ]


def calls(name: str) -> list[tuple[str, dict[str, str]]]:
    """List the modules of the calls of a function, and what is given by keyword."""
    return [(module, given) for module, function, given in every_call() if function == name]


MAY_DIFFER = {
    "adeye.campaign.replay",
    "adeye.exchange.commonroad",
    "adeye.maps.carriageway",
    "adeye.maps.opendrive_reader",
    "adeye.report.formats.signals",
    "adeye.selftest.conformance",
    "adeye.store.encoding",
    "adeye.store.write.planning",
    "adeye.store.write.results",
}
"""Where one pair of lists may have two lengths: what has no partner is meant to be left out."""


def test_lists_that_belong_together_have_one_length() -> None:
    """A list that is cut to the other one drops a run, a verdict or a column without a word."""
    found = [(module, given.get("strict")) for module, given in calls("zip")]
    assert len(found) > 200
    assert {strict for _, strict in found} == {"True", "False"}
    assert sorted(module for module, strict in found if strict == "False") == sorted(MAY_DIFFER)


def test_a_database_is_made_by_what_executes_only() -> None:
    """Whoever reads a file that is not there says so, and does not leave an empty one."""
    found = calls("Repository.open")
    makers = [module for module, given in found if given.get("create") != "False"]
    assert len(found) > 30
    assert makers == ["adeye.campaign.run", "adeye.campaign.traces", "adeye.cli.database"]


def test_no_array_that_is_read_executes_anything() -> None:
    for module, given in calls("np.load"):
        assert given.get("allow_pickle") == "False", module
    for module, given in calls("np.savez_compressed"):
        assert given.get("allow_pickle", "False") == "False", module
