"""What is not a file of traces any more is not read as one; see ``test_rejudging``."""

from pathlib import Path

import numpy as np

from adeye.campaign.keeping import read_kept


def test_missing_and_damaged_files_hold_no_traces(tmp_path: Path) -> None:
    assert read_kept(tmp_path, "missing") is None
    (tmp_path / "short.npz").write_bytes(b"PK\x03\x04 too short")
    assert read_kept(tmp_path, "short") is None
    np.savez(tmp_path / "other.npz", ego=np.zeros(3))
    assert read_kept(tmp_path, "other") is None
