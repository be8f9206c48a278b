import hashlib
from pathlib import Path

import pytest

from adeye import plugins as registry
from adeye.errors import SpecError
from adeye.plugins import load_part, plugins_digest, read_file, require, validate_parameters

CHANNEL = """
from adeye.ports import Parameters as Base
from adeye.spec.quantity import Speed

class Mine:
    class Parameters(Base):
        speed: Speed = 10.0

    def act(self, observation):
        return 0.0, 0.0

class Bare:
    pass

NUMBER = 3
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(CHANNEL)
    return tmp_path


def test_file_beside_the_naming_file_is_loaded(folder: Path) -> None:
    part = load_part("./mine.py:Mine", folder)
    assert part.obj().act(None) == (0.0, 0.0)
    assert part.build().act(None) == (0.0, 0.0)
    assert len(part.source_digest) == 64


def test_same_file_is_executed_once(folder: Path) -> None:
    assert load_part("./mine.py:Mine", folder).obj is load_part("mine.py:Mine", folder).obj


def test_edited_file_is_loaded_again_with_another_digest(folder: Path) -> None:
    before = load_part("./mine.py:Mine", folder)
    (folder / "mine.py").write_text(CHANNEL + "\n")
    after = load_part("./mine.py:Mine", folder)
    assert after.source_digest != before.source_digest
    assert after.obj is not before.obj


def test_module_is_loaded_with_the_digest_of_its_source() -> None:
    part = load_part("json.decoder:JSONDecoder", Path())
    assert part.obj.__name__ == "JSONDecoder"
    assert part.source_digest == load_part("json.encoder:JSONEncoder", Path()).source_digest
    assert part.source_digest != load_part("bisect:bisect", Path()).source_digest


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("./other.py:Mine", "there is no file"),
        ("./mine.py:Mein", "Did you mean 'Mine'"),
        ("./mine.py", "does not name a class"),
        (":Mine", "does not name a class"),
        ("no_such_module_here:Mine", "there is no module 'no_such_module_here'"),
        ("sys:exit", "has no source file"),
    ],
)
def test_what_cannot_be_found_is_named(folder: Path, name: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        load_part(name, folder)


def test_syntax_error_is_reported_with_file_and_line(folder: Path) -> None:
    (folder / "broken.py").write_text("x = 1\ndef act(:\n")
    with pytest.raises(SpecError) as caught:
        load_part("./broken.py:Mine", folder)
    where = caught.value.where
    assert where is not None
    assert (Path(where.path).name, where.line) == ("broken.py", 2)


def test_error_while_importing_is_reported_with_file_and_line(folder: Path) -> None:
    (folder / "raising.py").write_text("x = 1\ny = x / 0\n")
    with pytest.raises(SpecError, match="ZeroDivisionError") as caught:
        load_part("./raising.py:Mine", folder)
    where = caught.value.where
    assert where is not None
    assert (Path(where.path).name, where.line) == ("raising.py", 2)


@pytest.mark.parametrize(
    "line", ["from adeye.simulate.channel import Channel", "from adeye.spec import Odds"]
)
def test_part_of_adeye_that_is_not_for_guests_leads_to_the_public_face(
    folder: Path, line: str
) -> None:
    (folder / "deep.py").write_text(f"{line}\n{CHANNEL}")
    with pytest.raises(SpecError) as caught:
        load_part("./deep.py:Mine", folder)
    assert "adeye.ports" in str(caught.value.remedy)


def test_code_that_changes_the_working_folder_leaves_relative_paths_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "mine.py").write_text(f"import os\nos.chdir('/')\n{CHANNEL}")
    load_part("./mine.py:Mine", Path())
    assert Path.cwd() == folder


def test_file_with_null_bytes_is_an_input_error(folder: Path) -> None:
    (folder / "binary.py").write_bytes(b"\0\1")
    with pytest.raises(SpecError, match="null"):
        load_part("./binary.py:Mine", folder)


def test_missing_method_is_named(folder: Path) -> None:
    require(load_part("./mine.py:Mine", folder), "channel", ("act",))
    with pytest.raises(SpecError, match=r"has no act\(\)"):
        require(load_part("./mine.py:Bare", folder), "channel", ("act",))
    with pytest.raises(SpecError, match="not a class"):
        require(load_part("./mine.py:NUMBER", folder), "channel", ("act",))


def test_parameters_are_validated_by_the_declared_model(folder: Path) -> None:
    part = load_part("./mine.py:Mine", folder)
    good = validate_parameters(part, {"speed": "36 km/h"})
    assert good.errors == ()
    assert good.parameters is not None
    assert good.parameters.model_dump() == {"speed": pytest.approx(10.0)}
    bad = validate_parameters(part, {"speed": "3 m", "sped": 1})
    assert [loc for loc, _ in bad.errors] == [("speed",), ("sped",)]
    assert bad.parameters is None


def test_parameters_of_a_class_without_model_are_errors(folder: Path) -> None:
    part = load_part("./mine.py:Bare", folder)
    assert validate_parameters(part, {}).errors == ()
    assert validate_parameters(part, {"a": 1}).errors[0][0] == ("a",)


def test_parameters_that_are_no_model_are_refused(folder: Path) -> None:
    (folder / "odd.py").write_text("class Odd:\n    Parameters = 3\n")
    with pytest.raises(SpecError, match="no parameter model"):
        validate_parameters(load_part("./odd.py:Odd", folder), {})


def test_digest_of_plugins_does_not_depend_on_order(folder: Path) -> None:
    one, two = load_part("./mine.py:Mine", folder), load_part("./mine.py:Bare", folder)
    assert plugins_digest([one, two]) == plugins_digest([two, one, one])
    assert plugins_digest([one]) != plugins_digest([two])


def test_file_that_a_part_reads_is_known_by_its_content(folder: Path) -> None:
    weights = folder / "weights.bin"
    weights.write_bytes(b"1")
    before = read_file("channels.mine", "./weights.bin", folder)
    assert before.digest == hashlib.sha256(b"1").hexdigest()
    assert before == read_file("channels.mine", "./weights.bin", folder)
    weights.write_bytes(b"2")
    after = read_file("channels.mine", "./weights.bin", folder)
    part = load_part("./mine.py:Mine", folder)
    digests = [plugins_digest([part], files) for files in ([], [before], [after], [before, after])]
    assert len(set(digests)) == 4
    assert plugins_digest([part], [after, before]) == digests[3]


def test_who_reads_a_file_and_under_which_name_counts(folder: Path) -> None:
    for name in ("one", "two"):
        (folder / name).write_bytes(b"same")
    part = load_part("./mine.py:Mine", folder)
    read = [read_file(owner, name, folder) for owner in ("a", "b") for name in ("one", "two")]
    assert len({plugins_digest([part], [file]) for file in read}) == 4


def test_code_is_executed_again_when_what_it_read_has_changed(folder: Path) -> None:
    (folder / "gain.txt").write_text("1.0")
    (folder / "reading.py").write_text(
        "from pathlib import Path\n"
        "GAIN = float((Path(__file__).parent / 'gain.txt').read_text())\n"
        "def gain():\n    return GAIN\n"
    )
    for text in ("1.0", "2.0", "2.0"):
        (folder / "gain.txt").write_text(text)
        read_file("channels.mine", "gain.txt", folder)
        assert load_part("./reading.py:gain", folder).obj() == float(text)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("there.bin", "not there"),
        ("inner", "'inner' is no file"),
        ("../beside.bin", "is outside of"),
        ("/etc/hosts", "is outside of"),
        ("link.bin", "is outside of"),
        ("loop", "loop"),
        ("no\0name", "cannot be read"),
        ("n" * 5000, "cannot be read"),
    ],
)
def test_file_that_is_not_beside_the_naming_file_is_refused(
    folder: Path, name: str, message: str
) -> None:
    inner = folder / "project"
    (inner / "inner").mkdir(parents=True)
    (folder / "beside.bin").write_bytes(b"1")
    (inner / "link.bin").symlink_to(folder / "beside.bin")
    (inner / "loop").symlink_to(inner / "loop")
    with pytest.raises(SpecError, match=message) as caught:
        read_file("channels.mine", name, inner)
    assert caught.value.remedy


def test_file_that_is_too_large_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "LARGEST_FILE", 3)
    (folder / "small.bin").write_bytes(b"123")
    (folder / "large.bin").write_bytes(b"1234")
    assert read_file("channels.mine", "small.bin", folder).digest
    with pytest.raises(SpecError, match=r"'large\.bin' has .* GiB, more than"):
        read_file("channels.mine", "large.bin", folder)
