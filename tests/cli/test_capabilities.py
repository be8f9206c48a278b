"""The table of capabilities never claims ahead of its proofs."""

from pathlib import Path

import pytest

from adeye.cli.doctor import CAPABILITIES, Capability, Status

ROOT = Path(__file__).parents[2]


def test_ids_are_r1_to_r23() -> None:
    assert [item.id for item in CAPABILITIES] == [f"R{number}" for number in range(1, 24)]


@pytest.mark.parametrize("item", CAPABILITIES, ids=lambda item: item.id)
def test_status_has_its_proof(item: Capability) -> None:
    assert item.text
    if item.status is Status.NOT_YET:
        assert item.proof == ""
    else:
        number = int(item.id[1:])
        assert item.proof.startswith(f"tests/requirements/test_r{number:02d}_")
        assert (ROOT / item.proof).is_file()


def test_proof_that_exists_is_listed() -> None:
    found = {f"tests/requirements/{path.name}" for path in ROOT.glob("tests/requirements/test_r*")}
    assert found == {item.proof for item in CAPABILITIES if item.proof}
