"""A Merkle tree over leaves that come one after the other: its root, and proofs of one leaf.

Source:
    RFC 6962, "Certificate Transparency", section 2.1: leaves and nodes are hashed with different
    first bytes, and a tree of n leaves is split at the largest power of two below n.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import Final

_LEAF: Final = b"\x00"
_NODE: Final = b"\x01"


def leaf_hash(content: bytes) -> bytes:
    """Hash the content of a leaf."""
    return hashlib.sha256(_LEAF + content).digest()


def node_hash(left: bytes, right: bytes) -> bytes:
    """Hash two subtrees."""
    return hashlib.sha256(_NODE + left + right).digest()


@dataclass(frozen=True)
class Proof:
    """That a leaf is at its place in a tree.

    Attributes:
        place: Of the leaf, from 0.
        leaves: Of the tree.
        path: Hashes of the other subtrees, from the leaf up.
    """

    place: int
    leaves: int
    path: tuple[bytes, ...]

    def root(self, leaf: bytes) -> bytes:
        """Give the root that the tree has if the leaf with this hash is at its place.

        Raises:
            ValueError: The path does not fit the size of the tree.
        """
        place, last, rest = self.place, self.leaves - 1, list(self.path)
        found = leaf
        while last > 0:
            # A last node on its own goes up as it is.
            if place % 2 == 1 or place < last:
                if not rest:
                    break
                other = rest.pop(0)
                found = node_hash(other, found) if place % 2 else node_hash(found, other)
            place, last = place // 2, last // 2
        if rest or last > 0 or not 0 <= self.place < self.leaves:
            msg = f"a path of {len(self.path)} does not fit leaf {self.place} of {self.leaves}"
            raise ValueError(msg)
        return found


_Node = tuple[int, int, bytes]
"""Number of leaves below, place of the first of them, hash."""


@dataclass
class Tree:
    """A tree that grows; it keeps one hash for each power of two in its size.

    Attributes:
        watched: Place of a leaf whose proof is wanted; None for none.
        leaves: Number of leaves.
    """

    watched: int | None = None
    leaves: int = 0
    _full: list[_Node] = field(default_factory=list)
    _path: list[bytes] = field(default_factory=list)

    def add(self, leaf: bytes) -> None:
        """Add the hash of the next leaf."""
        node = (1, self.leaves, leaf)
        self.leaves += 1
        while self._full and self._full[-1][0] == node[0]:
            node = self._joined(self._full.pop(), node, self._path)
        self._full.append(node)

    def root(self) -> bytes:
        """Give the root.

        Raises:
            ValueError: There is no leaf.
        """
        return self._folded([])

    def proof(self) -> Proof:
        """Prove the watched leaf.

        Raises:
            ValueError: There is no leaf at its place.
        """
        if self.watched is None or not 0 <= self.watched < self.leaves:
            msg = f"there is no leaf {self.watched} among {self.leaves}"
            raise ValueError(msg)
        path = list(self._path)
        self._folded(path)
        return Proof(self.watched, self.leaves, tuple(path))

    def _folded(self, path: list[bytes]) -> bytes:
        if not self._full:
            msg = "a tree without leaves has no root"
            raise ValueError(msg)
        node = self._full[-1]
        for left in reversed(self._full[:-1]):
            node = self._joined(left, node, path)
        return node[2]

    def _joined(self, left: _Node, right: _Node, path: list[bytes]) -> _Node:
        if self.watched is not None:
            if left[1] <= self.watched < right[1]:
                path.append(right[2])
            elif right[1] <= self.watched < right[1] + right[0]:
                path.append(left[2])
        return left[0] + right[0], left[1], node_hash(left[2], right[2])
