"""R5: channel, sensor, metric, fault and executor of another package plug in, no change here."""

import sys
from pathlib import Path

import pytest

from adeye.cli.app import main
from tests.conftest import MakeProject
from tests.motorway import fault
from tests.project import CANDIDATE, CONCEPT, Project, odd_of, table_hash, use

pytestmark = pytest.mark.requirements

PACKAGE = {
    "__init__.py": '"""Parts of a third party."""\n\n__version__ = "2.5"\n',
    "follow.py": '''
"""Keeps the speed that it measures, slower when something is near."""

from adeye import ports
from adeye.ports import ScalarCommand


class Follow:
    class Parameters(ports.Parameters):
        near: float = 50.0

    def __init__(self, parameters, context):
        self.near = parameters.near

    def act(self, observation):
        eye = observation.measurements["eye"]
        ahead = [x for x, *_ in eye.detections if x > 0.0]
        return ScalarCommand(-3.0 if ahead and min(ahead) < self.near else 0.0, 0.0)
''',
    "braking.py": '''
"""Brakes from the start, unless the fault that it has a hook for has come."""

import numpy as np

from adeye.signals import OK, ControlCommand


class Braking:
    monitor_ids = ()
    hooks = ("planner_frozen",)

    def reset(self, context):
        self.id = context.channel_id
        self.broken = np.zeros(context.runs, dtype=bool)

    def inject(self, hook, active, size):
        self.broken = active.copy()

    def act(self, observation):
        runs = len(self.broken)
        deceleration = np.where(self.broken, 0.0, 2.0)
        status = np.full(runs, OK)
        stamp = np.full(runs, observation.time)
        return ControlCommand(self.id, -deceleration, np.zeros(runs), stamp, status)
''',
    "pace.py": '''
"""Speed that the ego loses in the first second."""

import numpy as np

from adeye.ports import MetricColumn
from adeye.signals import EGO_SPEED


class Pace:
    uid = "third:pace@1"
    column = "pace_mps"
    unit = "m/s"
    worse = "lower"
    source = "a third party"

    def compute(self, trace):
        row = int(np.searchsorted(trace.time, 1.0))
        speed = trace["ego"][:, :, EGO_SPEED]
        runs = trace.runs
        at = np.full(runs, trace.time[row])
        return MetricColumn(speed[:, 0] - speed[:, row], ("value",) * runs, at, (-1,) * runs)
''',
    "pool.py": '''
"""Executes everything backwards, three at a time, and writes down how much."""

from itertools import islice
from pathlib import Path

from adeye.ports import Done


class Backwards:
    def __init__(self, context):
        self.work, self.notes = context.work, Path(context.address)

    def run(self, tasks):
        while True:
            together = list(islice(tasks, 3))
            if not together:
                return
            for task in reversed(together):
                with self.notes.open("a") as notes:
                    notes.write("block\\n")
                yield Done(task, self.work(task))

    def close(self):
        with self.notes.open("a") as notes:
            notes.write("closed\\n")
''',
    "eye.py": '''
"""Sees every object ahead without error, at its own range."""

import numpy as np

from adeye import ports
from adeye.delivery import Delivery, no_measurement


class Eye:
    class Parameters(ports.Parameters):
        range: float = 80.0

    def __init__(self, context):
        self.context = context
        self.ranges = [self.Parameters(**spec.parameters).range for spec in context.specs]
        objects = len(context.scene.object_ids)
        empty = no_measurement(context.scene.runs, objects, with_estimate=False)
        self.delivery = Delivery(context.every, context.latency, empty)

    def sense(self, scene):
        if self.delivery.is_due(scene.tick):
            objects = len(self.context.scene.object_ids)
            sample = no_measurement(self.context.scene.runs, objects, with_estimate=False)
            sample.stamp[:] = scene.time
            for run, limit in enumerate(self.ranges):
                away = scene.objects[run, :, 0] - scene.ego[run, 0]
                order = [k for k in np.argsort(np.abs(away)) if 0.0 < away[k] <= limit]
                for row, thing in enumerate(order):
                    sample.mask[run, row] = True
                    sample.source[run, row] = thing
                    sample.detections[run, row, 0] = away[thing]
            self.delivery.push(scene.tick, sample)
        return self.delivery.newest(scene.tick)
''',
}


BESIDE = '''
import numpy as np

from adeye.ports import Parameters
from adeye.delivery import no_measurement


class Compass:
    """A sensor that sees nothing and is always alive."""

    def __init__(self, context):
        self.context = context

    def sense(self, scene):
        objects = len(self.context.scene.object_ids)
        reading = no_measurement(self.context.scene.runs, objects, with_estimate=False)
        reading.stamp[:] = scene.time
        return reading


class Cautious:
    """Brakes gently from the start."""

    class Parameters(Parameters):
        deceleration: float = 1.0

    def __init__(self, parameters, context):
        self.deceleration = parameters.deceleration

    def act(self, observation):
        assert set(observation.measurements) == {"compass"}
        return -self.deceleration, 0.0
'''


@pytest.fixture
def third_party(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Install a package of somebody else."""
    name = "third_party_of_r05"
    (tmp_path / "site" / name).mkdir(parents=True)
    for file, text in PACKAGE.items():
        (tmp_path / "site" / name / file).write_text(text, "utf-8")
    # What an installer leaves beside a package.
    told = tmp_path / "site" / f"{name}-2.5.dist-info"
    told.mkdir()
    (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 2.5\n")
    (told / "entry_points.txt").write_text(
        f"[adeye.executors]\nbackwards = {name}.pool:Backwards\n", "utf-8"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    return name


ALONE = {"policy": "fixed_priority", "priority": ["nominal"], "default": "nominal"}


def plugged(project: Project, name: str, *, near: float, reach: float) -> None:
    kinds = {
        "sensors": {"kind": f"{name}.eye:Eye", "parameters": {"range": reach}},
        "channels": {
            "kind": f"{name}.follow:Follow", "links": ["eye"], "parameters": {"near": near}
        },
    }  # fmt: skip
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["eye"] = {"rate": "20 Hz", **kinds["sensors"]}
        candidate["channels"] = {"nominal": {"rate": "20 Hz", **kinds["channels"]}}
        candidate["switch"] = ALONE


@pytest.mark.slow
def test_channel_and_sensor_of_a_third_party_drive_the_ego(
    make_project: MakeProject, third_party: str
) -> None:
    project = make_project(odd_of("cut_in"))
    # Requirements that every architecture can be judged on.
    project.require("FSR-01", "FSR-02")
    distances = {}
    for near, reach in ((60.0, 100.0), (60.0, 20.0), (1.0, 100.0)):
        plugged(project, third_party, near=near, reach=reach)
        summary = project.run()
        assert summary.executed == 1
        row = project.rows()[0]
        assert row["outcome"] == "completed"
        distances[near, reach] = row["min_distance_m"]
    # Both parts matter: a channel that heeds what the sensor sees in time keeps its distance.
    assert distances[60.0, 100.0] > max(distances[60.0, 20.0], distances[1.0, 100.0])
    assert f"{third_party}.eye" in sys.modules


@pytest.mark.slow
def test_parts_from_a_file_of_the_user_run_in_the_loop(make_project: MakeProject) -> None:
    project = make_project()
    folder = project.folder / "odd" / "architectures"
    (folder / "parts.py").write_text(BESIDE, "utf-8")
    with project.edited(CANDIDATE) as candidate:
        candidate["sensors"]["compass"] = {"kind": "./parts.py:Compass", "rate": "10 Hz"}
        candidate["channels"]["nominal"] = {
            "kind": "./parts.py:Cautious",
            "links": ["compass"],
            "parameters": {"deceleration": 2.0},
        }
    project.run()
    rows = [row for row in project.rows() if row["architecture"] == "camera_radar"]
    plain = [row for row in rows if row["fault_entry"] == "none"]
    assert {row["outcome"] for row in plain} == {"completed"}
    assert {round(row["max_deceleration_mps2"], 6) for row in plain} == {2.0}


def braking(project: Project, name: str) -> None:
    """Test a channel with a hook, a fault in it, and a metric of the package."""
    with project.edited(CANDIDATE) as candidate:
        nominal = {"kind": f"{name}.braking:Braking", "links": ["localisation"]}
        candidate["channels"] = {"nominal": nominal}
        candidate["switch"] = ALONE
    project.require("FSR-01")
    with project.edited(CONCEPT) as concept:
        bound = {"formula": None, "bound": {"metric": "pace_mps", "at_least": 1.0}}
        own = {**bound, "id": "FSR-90", "on_contact": "inconclusive"}
        concept["requirements"].append({**concept["requirements"][0], **own})


@pytest.mark.slow
def test_fault_and_metric_of_a_third_party_decide_a_verdict(
    make_project: MakeProject, third_party: str
) -> None:
    frozen = fault("frozen", "hooks.nominal", "planner_frozen")
    uses = use("cut_in", faults=("none", "frozen"))
    project = make_project(odd_of(uses, faults=[frozen], plugins=[f"{third_party}.pace:Pace"]))
    braking(project, third_party)
    project.run()
    rows = {row["fault_entry"]: row for row in project.rows()}
    assert set(rows) == {"none", "frozen"}
    # The channel brakes by itself and not with the fault; the metric sees it and the verdict says.
    assert rows["none"]["max_deceleration_mps2"] == pytest.approx(2.0)
    assert rows["frozen"]["max_deceleration_mps2"] == 0.0
    verdicts = {name: row["verdicts"]["FSR-90"] for name, row in rows.items()}
    assert verdicts == {"none": "PASS", "frozen": "FAIL"}


@pytest.mark.slow
def test_executor_of_a_third_party_is_found_by_its_name_and_changes_no_result(
    make_project: MakeProject,
    third_party: str,  # noqa: ARG001 - it is installed
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    project = make_project()
    notes = tmp_path / "notes"
    options = ["--executor", "backwards", "--scheduler", str(notes), "--quiet"]
    code = main(["run", str(project.odd), "--db", str(project.db), *options])
    assert code == 0, capsys.readouterr().err
    blocks = notes.read_text().splitlines()
    assert blocks.count("block") >= 4
    assert blocks[-1] == "closed"
    project.run(db="here.db")
    assert table_hash(project.db) == table_hash(project.folder / "here.db")
    assert main(["run", str(project.odd), "--executor", "backward"]) == 2
    assert "Did you mean 'backwards'?" in capsys.readouterr().err
