"""The files of the bench: each is what its place says."""

from pathlib import Path

import yaml

from adeye.selftest import bench
from adeye.selftest.bench import FILES, PARTS


def test_every_file_of_the_project_is_one_of_the_bench() -> None:
    folder = Path(bench.__file__).with_name("project")
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert {path.relative_to(folder).as_posix() for path in files} == set(FILES)


def test_every_file_is_yaml_of_the_kind_of_its_folder() -> None:
    kinds = {"scenarios_db": "scenario", "architectures": "architecture", "concepts": "concept"}
    for name, text in FILES.items():
        content = yaml.safe_load(text)
        assert kinds.get(name.split("/")[-2], "odd") in content, name
        assert content[kinds.get(name.split("/")[-2], "odd")] == name.split("/")[-1][:-5]


def test_plugins_are_where_the_files_name_them() -> None:
    folders = {name.rpartition("/")[0] for name in PARTS}
    named = {name.rpartition("/")[0] for name, text in FILES.items() if "./parts.py" in text}
    assert named <= folders
