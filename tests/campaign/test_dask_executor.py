"""Blocks on a Dask cluster of real processes: workers and schedulers that die lose nothing."""

from __future__ import annotations

import pickle
import pickletools
import platform
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from adeye.campaign import remote as dask_executor
from adeye.campaign.executor_names import NamedExecutor
from adeye.campaign.remote import DaskExecutor
from adeye.campaign.run import Progress, run_campaign
from adeye.campaign.summary import CampaignSummary
from adeye.errors import MissingExtra, PlatformError, UsageError
from adeye.judge.verdict import ExitCode
from adeye.ports import ExecutorContext
from adeye.store.repository import Repository
from adeye.testing import check_executor
from tests.campaign.cluster import Cluster, started_cluster
from tests.campaign.work import perform
from tests.project import Executed, table_hash
from tests.stored import stored

# Not imported here: whoever finds tests would wait for it, in each process.
if find_spec("distributed") is None:
    pytest.skip("needs adeye[distributed]", allow_module_level=True)

# Dask leaves the collection of its sockets to the interpreter.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


def run_on(
    address: str, mini: Executed, db: Path, progress: Callable[[Progress], None] | None = None
) -> CampaignSummary:
    executor = NamedExecutor("dask", address=address)
    return run_campaign(mini.plan, db=db, executor=executor, progress=progress)


@contextmanager
def executing(folder: Path, workers: int) -> Iterator[tuple[Cluster, DaskExecutor[Any, Any]]]:
    """Start a cluster and an executor that works on it."""
    with (
        started_cluster(folder, workers) as cluster,
        closing(DaskExecutor(ExecutorContext(perform, None, cluster.address))) as executor,
    ):
        yield cluster, executor


def end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


class AtFirst:
    """Does something once, when the first block of a campaign has been saved."""

    def __init__(self, act: Callable[[], object]) -> None:
        self.act, self.has_acted = act, False

    def __call__(self, progress: Progress) -> None:
        if progress.phase == "run" and progress.done and not self.has_acted:
            self.has_acted = True
            self.act()


@pytest.mark.slow
def test_workers_of_this_machine_conform() -> None:
    check_executor(DaskExecutor, is_isolated=True)


@pytest.mark.slow
def test_campaign_on_a_cluster_is_that_of_this_process(mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "dask.db"
    summary = run_campaign(mini.plan, db=db, executor=NamedExecutor("dask", workers=2))
    assert summary.executed == summary.planned == len(mini.plan.cases)
    assert table_hash(db) == table_hash(mini.db)


@pytest.mark.slow
def test_worker_that_is_killed_loses_no_block(mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "killed.db"
    with started_cluster(tmp_path / "cluster", workers=2) as cluster:
        kill = AtFirst(lambda: end(cluster.workers[0]))
        summary = run_on(cluster.address, mini, db, kill)
    assert kill.has_acted
    assert summary.exit_code is mini.summary.exit_code is ExitCode.OK
    assert table_hash(db) == table_hash(mini.db)


@pytest.mark.slow
def test_killed_scheduler_ends_where_it_goes_on(mini: Executed, tmp_path: Path) -> None:
    db = tmp_path / "lost.db"
    with started_cluster(tmp_path / "first", workers=1) as cluster:
        kill = AtFirst(lambda: end(cluster.scheduler))
        with pytest.raises(
            PlatformError, match=r"scheduler at tcp://\S+ is lost.*run again"
        ) as lost:
            run_on(cluster.address, mini, db, kill)
    assert lost.value.exit_code == ExitCode.ENVIRONMENT
    with Repository.open(db) as repository:
        campaign = repository.find_campaign()
        saved = repository.progress(campaign.id).executed
        # Nothing is leased any more, and nobody counts a failure.
        work = campaign.work
        assert (work.leased, work.quarantined) == (0, 0)
    assert 0 < saved < len(mini.plan.cases)
    with started_cluster(tmp_path / "second", workers=1) as cluster:
        summary = run_on(cluster.address, mini, db)
    assert summary.executed == len(mini.plan.cases) - saved
    assert table_hash(db) == table_hash(mini.db)


@pytest.mark.slow
def test_cluster_without_workers(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    import dask

    with (
        dask.config.set({"adeye.patience": 0.7}),
        executing(tmp_path, workers=0) as (_, executor),
        pytest.raises(PlatformError, match=r"has had no worker for 0\.7 s"),
    ):
        list(executor.run(iter(["echo:a"])))
    assert "has no worker; waiting, for 0.7 s at most" in caplog.text


@pytest.mark.slow
def test_worker_that_comes_later_gets_what_waits(tmp_path: Path) -> None:
    with executing(tmp_path, workers=0) as (cluster, executor):

        def tasks() -> Any:
            cluster.add_worker()
            yield "echo:a"
            yield "echo:b"

        assert {done.result for done in executor.run(tasks())} == {"a", "b"}


@pytest.mark.slow
def test_worker_that_cannot_import_the_work_says_what_is_missing(tmp_path: Path) -> None:
    with executing(tmp_path, workers=1) as (_, executor):
        executor._work = _only_here(tmp_path)
        with pytest.raises(PlatformError, match=r"cannot execute a batch: \w*NotFoundError: .*"):
            list(executor.run(iter(["echo:a"])))


def _only_here(tmp_path: Path) -> Any:
    folder = tmp_path / "only"
    folder.mkdir()
    (folder / "only_here.py").write_text("def work(task):\n    return task\n", "utf-8")
    sys.path.insert(0, str(folder))
    try:
        import only_here  # type: ignore[import-not-found]
    finally:
        sys.path.remove(str(folder))
    return only_here.work


OTHER_PYTHON: str = stored("plugins")["other_python"]

OTHER_PLUGIN: str = stored("plugins")["other_plugin"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preload", "why"),
    [
        (OTHER_PYTHON, rf"it has Python 3\.99\.1, the campaign {platform.python_version()}"),
        (OTHER_PLUGIN, "it has another plug-in"),
    ],
    ids=["another_python", "another_plugin"],
)
def test_worker_that_is_unfit_is_named_and_left_out_while_others_work(
    tmp_path: Path, preload: str, why: str, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "preload.py"
    file.write_text(preload, "utf-8")
    with executing(tmp_path, workers=1) as (cluster, executor):
        other = cluster.add_worker("--name", "odd_one", "--preload", str(file))
        executor._client.wait_for_workers(2, timeout=60)
        found = list(executor.run(iter([f"echo:{number}" for number in range(12)])))
        assert other.poll() is None
    assert sorted(done.result or "" for done in found) == sorted(map(str, range(12)))
    assert not any(done.lost for done in found)
    assert re.search(rf"worker odd_one at tcp://\S+ cannot take part: {why}", caplog.text)


@pytest.mark.slow
def test_unfit_cluster_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "preload.py"
    file.write_text(OTHER_PYTHON, "utf-8")
    monkeypatch.setattr(dask_executor, "SETTLE_S", 0.1)
    with executing(tmp_path, workers=0) as (cluster, executor):
        other = cluster.add_worker("--name", "odd_one", "--preload", str(file))
        with pytest.raises(PlatformError, match=r"odd_one at tcp://\S+: it has Python 3\.99"):
            list(executor.run(iter(["echo:a"])))
        assert other.poll() is None


def test_worker_gets_names_and_bytes_and_no_code() -> None:
    call = pickle.dumps(dask_executor._Call(perform, "echo:a"), protocol=4)
    names = {value for code, value, _ in pickletools.genops(call) if code.name.endswith("UNICODE")}
    assert names == {"adeye.campaign.remote", "perform"}
    assert pickle.loads(call) == ("done", "a")  # noqa: S301 - made here


def test_scheduler_that_does_not_answer_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_executor, "_CONNECT_S", 0.5)
    with pytest.raises(PlatformError, match=r"does not answer within 0\.5 s"):
        DaskExecutor(ExecutorContext(perform, None, "tcp://127.0.0.1:9"))


def test_address_that_is_none_is_an_input_error() -> None:
    with pytest.raises(UsageError, match=r"nonsense://.*is no address.*tcp://HOST:PORT"):
        DaskExecutor(ExecutorContext(perform, None, "nonsense://here"))


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"pip install 'adeye\[distributed\]'"):
        DaskExecutor(ExecutorContext(perform))
