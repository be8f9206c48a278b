"""The table of capabilities never claims ahead of its proofs."""

from pathlib import Path

from adeye.cli.doctor import Status, capabilities

ROOT = Path(__file__).parents[2]


def test_ids_are_r1_to_r23() -> None:
    assert [item.id for item in capabilities()] == [f"R{number}" for number in range(1, 24)]


def test_status_has_its_proof() -> None:
    for item in capabilities():
        assert item.text
        prefix = f"tests/requirements/test_r{int(item.id[1:]):02d}_"
        assert item.proof.startswith(prefix) == (item.status is not Status.NOT_YET), item.id


def test_proofs_are_the_files_that_exist() -> None:
    found = {f"tests/requirements/{path.name}" for path in ROOT.glob("tests/requirements/test_r*")}
    assert found == {item.proof for item in capabilities() if item.proof}
