"""The page on where things are is true: folders, files, layers, and how large folders are."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "adeye"
PAGE = ROOT / "docs" / "design" / "0010-where-things-are.md"
CONTRIBUTING = ROOT / "CONTRIBUTING.md"

OTHERS = sorted({*(ROOT / "docs").rglob("*.md")} - {PAGE})
PLACES = (PACKAGE, ROOT)
"""Folders that paths on pages begin in."""

MOST_MODULES = 22
LATER = "Rooms that do not exist yet"

_PATH = re.compile(r"`((?:[\w-]+/)*[\w.-]+\.(?:py|j2|js|css|toml|yaml|md|sql|txt)|(?:[\w-]+/)+)`")


def sections(page: Path) -> dict[str, str]:
    """Return the text of each section by its heading; what comes before the first has none."""
    parts = re.split(r"^## (.+)$", page.read_text("utf-8"), flags=re.MULTILINE)
    return dict(zip(["", *parts[1::2]], parts[::2], strict=True))


def folders() -> set[str]:
    """Return the folders of the package that hold a file of ours, relative to it."""
    files = [path for path in PACKAGE.rglob("*") if path.is_file() and path.suffix != ".pyc"]
    return {folder_of(path) for path in files}


def folder_of(file: Path) -> str:
    """Return the folder of a file; one without modules is one with everything below it."""
    above = [folder for folder in file.parents if folder.is_relative_to(PACKAGE)]
    plain = [folder for folder in above if not any(folder.glob("*.py"))]
    return (plain[-1] if plain else file.parent).relative_to(PACKAGE).as_posix()


def named(text: str) -> Iterator[str]:
    """Yield the files and folders that a text names."""
    yield from (match[1] for match in _PATH.finditer(text))


def test_every_folder_stands_in_the_tree_once() -> None:
    tree = re.findall(r"^\| `([^`]+)` \|", sections(PAGE)["The tree"], re.MULTILINE)
    listed = [name.rstrip("/") for name in tree]
    assert sorted(listed) == sorted(folders())


def test_every_folder_begins_with_a_module_of_its_own() -> None:
    for row in re.findall(r"^\| `.*$", sections(PAGE)["The tree"], re.MULTILINE):
        folder, *_, begin = [cell.strip() for cell in row.strip("| ").split(" | ")]
        for name in named(begin):
            assert folder_of(PACKAGE / name) == folder.strip("`/"), row


@pytest.mark.parametrize("page", [PAGE, CONTRIBUTING], ids=lambda page: page.name)
def test_what_the_page_names_exists(page: Path) -> None:
    told = [
        name for title, text in sections(page).items() if title != LATER for name in named(text)
    ]
    assert len(told) > 20
    assert [name for name in told if not any((place / name).exists() for place in PLACES)] == []


@pytest.mark.parametrize("page", OTHERS, ids=lambda page: page.name)
def test_modules_that_other_pages_name_exist(page: Path) -> None:
    told = re.findall(r"`((?:[\w-]+/)+[\w-]+\.py)`", page.read_text("utf-8"))
    assert [name for name in told if not any((place / name).exists() for place in PLACES)] == []


def test_rooms_to_come_are_not_there_yet() -> None:
    rooms = re.findall(r"^\| `([^`]+)` \|", sections(PAGE)[LATER], re.MULTILINE)
    assert rooms
    assert [name for name in rooms if (PACKAGE / name).exists()] == []


def test_layers_are_those_that_are_checked() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    (layers,) = [
        contract["layers"]
        for contract in project["tool"]["importlinter"]["contracts"]
        if contract["type"] == "layers"
    ]
    (listed,) = re.findall(r"^1\. .*?(?=\n\n)", sections(PAGE)["Layers"], re.MULTILINE | re.DOTALL)
    told = [name.removesuffix(".py").rstrip("/").replace("/", ".") for name in named(listed)]
    assert [f"adeye.{name}" for name in told] == layers


def test_every_module_is_in_a_layer() -> None:
    listed = set(named(sections(PAGE)["Layers"]))
    top = {path.name for path in PACKAGE.glob("*.py")} - {"__init__.py"}
    assert top <= listed
    assert {f"{name}/" for name in folders() if "/" not in name and name != "."} <= {
        *listed,
        "simulate/",
    }


def test_folder_holds_at_most_22_modules() -> None:
    sizes = {name: len(list((PACKAGE / name).glob("*.py"))) for name in folders()}
    assert {name: count for name, count in sizes.items() if count > MOST_MODULES} == {}


@pytest.mark.parametrize(
    "face", sorted(PACKAGE.rglob("__init__.py")), ids=lambda path: path.parent.name
)
def test_package_says_what_is_in_it_and_where_to_begin(face: Path) -> None:
    text = " ".join((ast.get_docstring(ast.parse(face.read_text("utf-8"))) or "").split())
    assert len(re.findall(r"[.](?: |$)", text)) >= 2
    assert "Begin with" in text
