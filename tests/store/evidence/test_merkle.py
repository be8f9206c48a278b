import hashlib
from dataclasses import replace

import pytest

from adeye.store.evidence.roots import Proof, Tree, leaf_hash, node_hash


def leaves(count: int) -> list[bytes]:
    return [leaf_hash(str(place).encode()) for place in range(count)]


def recursive(items: list[bytes]) -> bytes:
    """RFC 6962, section 2.1, as it is written there."""
    if len(items) == 1:
        return items[0]
    split = 1
    while 2 * split < len(items):
        split *= 2
    return node_hash(recursive(items[:split]), recursive(items[split:]))


def grown(items: list[bytes], watched: int | None = None) -> Tree:
    tree = Tree(watched)
    for item in items:
        tree.add(item)
    return tree


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 8, 9, 31, 33])
def test_root_is_that_of_the_definition(count: int) -> None:
    tree = grown(leaves(count))
    assert tree.root() == recursive(leaves(count))
    assert tree.root() == tree.root()


def test_leaf_and_node_begin_differently() -> None:
    assert leaf_hash(b"ab") == hashlib.sha256(b"\x00ab").digest()
    assert node_hash(b"a", b"b") == hashlib.sha256(b"\x01ab").digest()


@pytest.mark.parametrize("count", [1, 2, 3, 5, 6, 8, 13])
def test_every_leaf_is_proven_and_no_other(count: int) -> None:
    items = leaves(count)
    for place, leaf in enumerate(items):
        tree = grown(items, place)
        proof = tree.proof()
        assert proof.root(leaf) == tree.root()
        assert proof == tree.proof()
        assert proof.root(leaf_hash(b"other")) != tree.root()


def test_proof_is_of_one_place_and_size() -> None:
    items = leaves(6)
    tree = grown(items, 2)
    assert replace(tree.proof(), place=3).root(items[2]) != tree.root()
    for wrong in (Proof(2, 60, tree.proof().path), Proof(9, 6, ()), Proof(0, 1, (items[0],))):
        with pytest.raises(ValueError, match="does not fit"):
            wrong.root(items[2])


def test_nothing_is_proven_of_no_leaf() -> None:
    with pytest.raises(ValueError, match="no root"):
        Tree().root()
    for tree in (grown(leaves(3)), grown(leaves(3), 3)):
        with pytest.raises(ValueError, match="there is no leaf"):
            tree.proof()
