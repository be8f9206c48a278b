"""A map compiled: the graph of its lanes and the arcs of their centre lines, as one file."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adeye.maps.arcs import lane_arcs
from adeye.maps.network import Rows, build_of_rows
from adeye.maps.opendrive import OpenDrive
from adeye.maps.outlines import strips_of

_DIGITS = 9


def compiled_map(drive: OpenDrive) -> dict[str, NDArray[np.generic]]:
    """Return the arrays of a map; numbers are rounded to a nanometre.

    They are those of ``adeye.maps.network.Network``, ``segments`` (S, 10) with the arcs of all
    lanes after ``adeye.maps.arcs``, and ``first_segment`` (N + 1,) where those of each begin.
    """
    rows = Rows(drive)
    arcs = [lane_arcs(*strip) for strip in strips_of(rows)]
    found = {
        **build_of_rows(rows).arrays(),
        "segments": np.concatenate([np.zeros((0, 10)), *arcs]),
        "first_segment": np.cumsum([0, *map(len, arcs)], dtype=np.int32),
    }
    return {
        name: np.round(item, _DIGITS) + 0.0 if item.dtype.kind == "f" else item
        for name, item in found.items()
    }


def archive(arrays: dict[str, Any]) -> bytes:
    """Write arrays as a file of numpy: the same arrays give the same bytes."""
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()
