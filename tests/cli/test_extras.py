"""A missing extra: one kind of error and one exit code, whichever verb or option needs it."""

import shutil
import sys
import tomllib
from pathlib import Path
from typing import TypeAlias

import pytest

from adeye.cli.new import project_files, write_files
from tests.cli.conftest import Verb
from tests.project import ROOT, Executed
from tests.stored import read_yaml, write_yaml

Needed: TypeAlias = tuple[str, str, str]
"""An extra, a package of it, and the words of a verb that needs it."""

FIRST = "odd/first.yaml"
FMUS = "odd/architectures/fmus"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))

DB = "--db mini.db"
"""Names the database of the mini campaign, of which RUN is a run."""

NEEDS: dict[str, dict[str, tuple[str, ...]]] = {
    "columnar": {
        "pyarrow": (
            f"export {DB} --output tables",
            f"query failing-fsrs {DB} -o rows.parquet",
            "stl always(speed>1) run.parquet",
            f"trace RUN {DB} -o run.parquet",
        )
    },
    "distributed": dict.fromkeys(("dask", "distributed"), ("run odd/first.yaml --executor dask",)),
    "fmi": {
        "fmpy": ("fmu show file", "fmu simulate file --stop 1 --step 0.1", "plan odd/fmi.yaml"),
        "pythonfmu3": ("fmu export plant odd/architectures/camera_radar.yaml",),
    },
    "osi": dict.fromkeys(
        ("mcap_protobuf", "osi3"), (f"replay RUN {DB} --osi traces", f"export {DB} --osi traces")
    ),
    "plot": {"plotille": (f"plot RUN {DB} ttc",)},
    "postgres": {
        "psycopg": (
            "db info --db postgresql://nowhere/team",
            "run odd/first.yaml --db postgresql://nowhere/team",
        )
    },
    "ros2": {"cyclonedds": ("plan odd/ros2.yaml", "run odd/ros2.yaml")},
    "sign": {"cryptography": (f"manifest write {DB} --sign file", "manifest keygen")},
    "viz": {
        "foxglove": (f"replay RUN {DB} --mcap run.mcap",),
        "mcap": (f"replay RUN {DB} --mcap run.mcap",),
        "rosbags": (f"replay RUN {DB} --rosbag bag",),
    },
    "zenoh": {"zenoh": ("plan odd/zenoh.yaml", "run odd/zenoh.yaml")},
}
"""What needs each extra, by the package of it that is missing."""


def test_every_extra_is_tried() -> None:
    declared = set(PYPROJECT["project"]["optional-dependencies"])
    # Those are for who develops adeye.
    assert set(NEEDS) == declared - {"bench", "dev"}


@pytest.fixture
def a_run(folder: Path, mini: Executed) -> str:
    """Lay out a project with an ODD for each kind of architecture, and a database with a run."""
    write_files(folder, project_files())
    shutil.copy(mini.db, folder / "mini.db")
    shutil.copytree(ROOT / FMUS, folder / FMUS)
    for name in ("file", "run.parquet"):
        Path(folder, name).touch()
    parts = {
        "fmi": {"vehicle": read_yaml(ROOT / "odd/architectures/fmu_vehicle.yaml")["vehicle"]},
        **{
            kind: {"channels": {"nominal": {"kind": kind, "parameters": {"command": ["python3"]}}}}
            for kind in ("ros2", "zenoh")
        },
    }
    for name, part in parts.items():
        head = {"extends": "camera_radar.yaml", "architecture": name, "title": name}
        write_yaml(folder / f"odd/architectures/{name}.yaml", {**head, **part})
        odd = {**read_yaml(folder / FIRST), "architectures": [f"architectures/{name}.yaml"]}
        write_yaml(folder / f"odd/{name}.yaml", {**odd, "gate": {"architectures": [name]}})
    return str(mini.project.rows()[0]["run"])[:12]


@pytest.mark.parametrize(
    "needed",
    [
        pytest.param((extra, package, verb), id=f"{package}: {verb}")
        for extra, packages in NEEDS.items()
        for package, verbs in packages.items()
        for verb in verbs
    ],
)
def test_it_is_named_and_ends_with_2_and_nothing_is_written(
    adeye: Verb, a_run: str, folder: Path, monkeypatch: pytest.MonkeyPatch, needed: Needed
) -> None:
    extra, package, verb = needed
    before = sorted(folder.rglob("*"))
    # A module that was imported would not import what it needs again.
    for name in [*sys.modules]:
        if name.partition(".")[0] == package or name.startswith("adeye.exchange."):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    said = adeye(*verb.replace("RUN", a_run).split()).refused
    # Before it, a campaign says how many test cases there are.
    last = said.splitlines()[-1]
    assert last.startswith("MissingExtra: ")
    assert f" needs adeye[{extra}]. Install it: pip install 'adeye[{extra}]'" in last
    # A campaign is noted before its executor is sought.
    noted = folder / ".adeye"
    written = sorted(it for it in folder.rglob("*") if noted not in (it, *it.parents))
    assert written == before
