"""What a name of an executor means, and what excludes what."""

from __future__ import annotations

from pathlib import Path

import pytest

from adeye.campaign.executor_names import NamedExecutor, asked_executor, find_executor
from adeye.campaign.remote import DaskExecutor
from adeye.campaign.run import run_campaign
from adeye.errors import SpecError, UsageError
from tests.project import Executed, table_hash
from tests.stored import stored

OWN: str = stored("plugins")["executors"]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "own.py").write_text(OWN, "utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_dask_is_known_by_its_name() -> None:
    assert find_executor("dask") is DaskExecutor


def test_unknown_name_is_refused_with_the_nearest() -> None:
    with pytest.raises(UsageError, match=r"no executor 'dusk'.*Did you mean 'dask'\?"):
        find_executor("dusk")


def test_class_without_run_is_no_executor(here: Path) -> None:
    assert here.is_dir()
    with pytest.raises(SpecError, match=r"Deaf has no run\(\), so it is no executor"):
        find_executor("./own.py:Deaf")


@pytest.mark.slow
def test_class_of_a_file_executes_a_campaign(mini: Executed, here: Path) -> None:
    named = NamedExecutor("./own.py:Own", workers=3, address="there")
    assert named.text == "executor ./own.py:Own at there with 3 workers"
    summary = run_campaign(mini.plan, db=here / "own.db", executor=named)
    assert summary.executed == len(mini.plan.cases)
    assert table_hash(here / "own.db") == table_hash(mini.db)
    found = find_executor("./own.py:Own")
    made = found.args[0].obj.made  # type: ignore[attr-defined]
    assert made == [(3, "there"), "closed"]


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ((None, 2, 2, None), "--threads and --workers exclude each other"),
        (("threads", None, 2, None), "--executor threads and --workers exclude"),
        (("processes", 2, None, None), "--executor processes and --threads exclude"),
        (("dask", 2, None, None), "--executor dask and --threads exclude"),
        ((None, None, None, "tcp://a:1"), "--scheduler needs an executor that has one"),
        (("processes", None, None, "tcp://a:1"), "--scheduler needs an executor"),
        (("dask", None, 2, "tcp://a:1"), "the one at --scheduler has its own"),
    ],
)
def test_what_excludes_each_other_is_refused(
    asked: tuple[str | None, int | None, int | None, str | None], message: str
) -> None:
    with pytest.raises(UsageError, match=message):
        asked_executor(*asked)


def test_executors_of_this_machine_need_no_other() -> None:
    assert asked_executor(None, None, 2, None) is None
    assert asked_executor("threads", 2, None, None) is None
    assert asked_executor("processes", None, 2, None) is None
    assert asked_executor("dask", None, None, "tcp://a:1") == NamedExecutor(
        "dask", None, "tcp://a:1"
    )
    assert asked_executor("my:Own", None, 4, None) == NamedExecutor("my:Own", 4)
