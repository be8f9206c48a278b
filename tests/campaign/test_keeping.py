"""What is not a file of traces any more is not read as one; see ``test_rejudging``."""

from __future__ import annotations

import json
import zipfile
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.campaign import traces as keeping
from adeye.campaign.traces import read_kept
from adeye.trace import COLUMNS

if TYPE_CHECKING:
    from pathlib import Path

RUNS, TICKS = 2, 3
NAME = "a" * 64
EMPTY = [name for name in COLUMNS if name not in {"ego", "contact"}]


def arrays_of(**changed: Any) -> dict[str, Any]:
    """Make what a file of two runs of three ticks holds, with other arrays or none."""
    meta = {
        "monitors": ["headway"],
        "faults": [],
        "cases": ["a" * 64, "b" * 64],
        "empty": {name: ["<f8", RUNS, TICKS, 4] for name in EMPTY},
    }
    meta |= changed.pop("meta", {})
    arrays: dict[str, Any] = {
        "length": np.full(RUNS, TICKS),
        "horizon_row": np.full(RUNS, TICKS),
        "complete": np.ones(RUNS, dtype=bool),
        "time": np.arange(TICKS) * 0.1,
        "ego": np.ones((RUNS, TICKS, 7)),
        "contact": np.ones((RUNS, TICKS)),
        "meta": np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8),
    }
    return {name: array for name, array in (arrays | changed).items() if array is not None}


def test_missing_and_damaged_files_hold_no_traces(tmp_path: Path) -> None:
    assert read_kept(tmp_path, NAME) is None
    path = tmp_path / f"{NAME}.npz"
    path.write_bytes(b"PK\x03\x04 too short")
    assert read_kept(tmp_path, NAME) is None
    np.savez(path, ego=np.zeros(3))
    assert read_kept(tmp_path, NAME) is None


def test_file_of_the_right_form_is_read_with_its_empty_columns(tmp_path: Path) -> None:
    np.savez(tmp_path / f"{NAME}.npz", **arrays_of())
    kept = read_kept(tmp_path, NAME)
    assert kept is not None
    assert kept.arrays.keys() == {*COLUMNS, "time", "length", "horizon_row", "complete"}
    assert kept.arrays["authority"].shape == (RUNS, TICKS, 4)


@pytest.mark.parametrize(
    "changed",
    [
        pytest.param({"ego": None}, id="column that is missing"),
        pytest.param({"other": np.zeros((RUNS, TICKS))}, id="column of no trace"),
        pytest.param({"ego": np.ones((RUNS, TICKS + 1, 7))}, id="more ticks"),
        pytest.param({"contact": np.array([["a"] * TICKS] * RUNS)}, id="texts"),
        pytest.param({"length": np.array(3)}, id="no axis"),
        pytest.param({"meta": {"cases": ["a" * 64]}}, id="fewer names than runs"),
        pytest.param({"meta": {"monitors": None}}, id="no names"),
        pytest.param({"meta": {"faults": [1]}}, id="numbers as names"),
        pytest.param({"meta": {"empty": []}}, id="list for a mapping"),
        pytest.param({"meta": {"empty": {n: ["O", RUNS, TICKS] for n in EMPTY}}}, id="objects"),
        pytest.param({"meta": {"empty": {n: ["<f8", -1, TICKS] for n in EMPTY}}}, id="negative"),
        pytest.param({"meta": {"empty": {n: ["<f8", "2"] for n in EMPTY}}}, id="text for a number"),
        pytest.param(
            {"meta": {"empty": {n: ["<f8", RUNS, TICKS, 10**12] for n in EMPTY}}}, id="endless"
        ),
        pytest.param({"meta": np.frombuffer(b"[" * 100_000, dtype=np.uint8)}, id="nested"),
        pytest.param({"meta": np.frombuffer(b"[]", dtype=np.uint8)}, id="list as description"),
    ],
)
def test_other_forms_are_not_read(tmp_path: Path, changed: dict[str, Any]) -> None:
    meta = changed.get("meta")
    arrays = arrays_of(**changed) if isinstance(meta, dict) else {**arrays_of(), **changed}
    np.savez(
        tmp_path / f"{NAME}.npz",
        **{name: item for name, item in arrays.items() if item is not None},
    )
    assert read_kept(tmp_path, NAME) is None


def test_packed_file_is_not_unpacked(tmp_path: Path) -> None:
    """A few kilobytes of it may hold gigabytes of zeros."""
    np.savez_compressed(tmp_path / f"{NAME}.npz", **arrays_of())
    assert read_kept(tmp_path, NAME) is None


def test_members_within_each_other_are_not_read(tmp_path: Path) -> None:
    """Many names for the same bytes are as good a bomb as packed ones."""
    path = tmp_path / f"{NAME}.npz"
    np.savez(path, **arrays_of())
    with zipfile.ZipFile(path, "a") as archive:
        first = archive.getinfo("ego.npy")
        for number in range(20):
            again = zipfile.ZipInfo(f"ego{number}.npy")
            again.header_offset = first.header_offset
            again.CRC, again.file_size = first.CRC, first.file_size
            again.compress_size = first.compress_size
            archive.filelist.append(again)
            archive.NameToInfo[again.filename] = again
        archive._didModify = True  # type: ignore[attr-defined]
    with zipfile.ZipFile(path) as archive:
        assert len(archive.infolist()) > 20
        assert not keeping._is_as_large_as_its_file(archive.infolist(), path.stat().st_size)
    assert read_kept(tmp_path, NAME) is None


def test_file_larger_than_a_block_can_be_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.savez(tmp_path / f"{NAME}.npz", **arrays_of())
    monkeypatch.setattr(keeping, "MOST_BYTES", 3_000)
    assert read_kept(tmp_path, NAME) is None
