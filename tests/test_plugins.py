"""Parts from outside the package: found by name, hashed as what is executed, checked."""

import hashlib
import importlib
import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib.machinery import PathFinder
from pathlib import Path

import numpy as np
import pytest

from adeye import plugin_code
from adeye import plugins as registry
from adeye.errors import PluginError, SpecError
from adeye.plugins import (
    load_part,
    plugins_digest,
    read_file,
    require,
    source_digest,
    validate_parameters,
)
from adeye.simulate.channels.factory import plugin_channel
from adeye.supervision import sealed
from tests.refusals import refused
from tests.stored import known

ROOT = str(Path(__file__).parents[1])
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


KEPT = """
from pathlib import Path
import numba
GAIN = float(Path(__file__).with_name("gain").read_text())

@numba.njit(cache=True)
def gained(x):
    return GAIN * x

class Mine:
    gain = gained(1.0)
"""


@pytest.mark.slow
def test_machine_code_that_a_plugin_keeps_by_itself_is_not_taken_for_its_source(
    tmp_path: Path,
) -> None:
    (tmp_path / "mine.py").write_text(KEPT)
    program = "from pathlib import Path; from adeye.plugins import load_part; "
    program += "print(load_part('mine.py:Mine', Path()).obj.gain)"
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": ROOT}
    for gain in ("2.0", "3.0"):
        (tmp_path / "gain").write_text(gain)
        command = [sys.executable, "-c", program]
        assert (
            subprocess.check_output(command, cwd=tmp_path, env=environment).decode() == f"{gain}\n"
        )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(CHANNEL)
    return tmp_path


def test_file_beside_the_naming_file_is_loaded_and_executed_once(folder: Path) -> None:
    part = load_part("./mine.py:Mine", folder)
    assert part.obj().act(None) == part.build().act(None) == (0.0, 0.0)
    assert len(part.source_digest) == 64
    assert load_part("mine.py:Mine", folder).obj is part.obj


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


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package on the path, ``bought`` with the module ``drive``, imported by nobody yet."""
    folder = tmp_path / "bought"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "drive.py").write_text("class Mine:\n    gain = 1\n")
    (folder / "core.so").write_bytes(b"one")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    yield folder
    for name in [name for name in sys.modules if name.partition(".")[0] == "bought"]:
        del sys.modules[name]
        plugin_code._EXECUTED.pop(name, None)
    plugin_code._LOOKED.pop("bought", None)


def edited(path: Path) -> None:
    path.write_text(path.read_text().replace("1", "2"))


def edited_in_disguise(path: Path) -> None:
    """Change a source as ``cp -p`` or an archive may: of one size, at one time."""
    was = path.stat()
    edited(path)
    os.utime(path, ns=(was.st_atime_ns, was.st_mtime_ns))


@pytest.mark.parametrize("change", [edited, edited_in_disguise])
def test_package_that_was_changed_since_it_was_loaded_is_refused(
    package: Path, change: Callable[[Path], None]
) -> None:
    assert load_part("bought.drive:Mine", Path()).obj.gain == 1
    assert load_part("bought.drive:Mine", Path()).obj.gain == 1
    change(package / "drive.py")
    for _ in range(2):
        with pytest.raises(
            SpecError, match=r"bought\.drive is in memory as it was before .* written"
        ):
            load_part("bought.drive:Mine", Path())


def test_file_that_a_loaded_module_names_is_not_exchanged(package: Path) -> None:
    (package / "rates.csv").write_text("1")
    with (package / "drive.py").open("a") as source:
        source.write(
            "\nadeye_files = ['rates.csv']\nfrom pathlib import Path\n"
            "RATE = Path(__file__).with_name('rates.csv').read_text()\n"
        )
    assert load_part("bought.drive:Mine", Path()).obj.gain == 1
    (package / "rates.csv").write_text("2")
    with pytest.raises(
        SpecError, match=r"as it was before .*drive\.py or .*rates\.csv was written"
    ):
        load_part("bought.drive:Mine", Path())


@pytest.fixture
def process(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """This process, as if it began when the package was there."""
    began = (package / "core.so").stat().st_ctime
    monkeypatch.setattr(plugin_code, "_process_start", lambda: began)


def test_data_that_somebody_may_have_kept_is_not_exchanged(folder: Path) -> None:
    source = READING.format(named='adeye_files = ["gain.txt"]')
    (folder / "alone.py").write_text(source)
    with (folder / "alone.py").open("a") as code:
        code.write("GAIN = Path(__file__).with_name('gain.txt').read_text()\n")
        code.write("with Path(__file__).with_name('seen.txt').open('a') as seen:\n")
        code.write("    seen.write(GAIN)\n")
    (folder / "gain.txt").write_text("1")
    assert load_part("./alone.py:Mine", folder).build().compute() == "1"
    (folder / "gain.txt").write_text("2")
    # A cache of the standard library is enough to keep it, such as linecache.
    with pytest.raises(SpecError, match=r"this process may hold what .*gain\.txt was before"):
        load_part("./alone.py:Mine", folder)
    # Nor is it executed with what is refused, which it might keep.
    assert (folder / "seen.txt").read_text() == "1"
    # Whoever names it: what both import may have kept it.
    (folder / "other.py").write_text(source)
    with pytest.raises(SpecError, match=r"this process may hold what .*gain\.txt was before"):
        load_part("./other.py:Mine", folder)
    (folder / "gain.txt").write_text("1")
    assert load_part("./alone.py:Mine", folder).build().compute() == "1"


def test_helper_on_a_path_that_the_plugin_adds_is_refused_once_it_changed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    (folder / "helping.py").write_text("FACTOR = 1\n")
    (folder / "mine.py").write_text(
        "import sys\nfrom pathlib import Path\n"
        "sys.path.insert(0, str(Path(__file__).parent))\n"
        "from helping import FACTOR\nclass Mine:\n    factor = FACTOR\n"
    )
    assert load_part("./mine.py:Mine", folder).obj.factor == 1
    edited(folder / "helping.py")
    with pytest.raises(SpecError, match=r"helping is in memory as it was before .*helping\.py"):
        load_part("./mine.py:Mine", folder)
    del sys.modules["helping"]


@pytest.mark.usefixtures("process")
def test_package_that_somebody_else_loaded_and_then_changed_is_refused(package: Path) -> None:
    importlib.import_module("bought.drive")
    edited(package / "drive.py")
    with pytest.raises(SpecError, match=r"bought\.drive is in memory as it was before"):
        load_part("bought.drive:Mine", Path())


@pytest.mark.usefixtures("process", "package")
def test_package_that_somebody_else_loaded_and_left_alone_is_taken() -> None:
    importlib.import_module("bought.drive")
    assert load_part("bought.drive:Mine", Path()).obj.gain == 1


def test_code_of_the_future_is_refused_with_its_cause(folder: Path) -> None:
    path = folder / "late.py"
    path.write_text("class Late: ...\n", "utf-8")
    os.utime(path, (path.stat().st_atime, path.stat().st_mtime + 3600.0))
    refused(SpecError, load_part, "./late.py:Late", folder, says="was written in the future")


@pytest.mark.parametrize("name", ["slow.py:Slow", "slow:Slow"])
def test_code_that_is_written_while_it_is_executed_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    path = folder / "slow.py"
    writes = f"import time, pathlib\ntime.sleep(0.05)\np = pathlib.Path({str(path)!r})\n"
    path.write_text(f"{writes}p.write_text('class Slow: new = 1')\nclass Slow: new = 0\n", "utf-8")
    with pytest.raises(SpecError, match="was written while it was being executed"):
        load_part(name, folder)
    sys.modules.pop("slow", None)
    importlib.invalidate_caches()
    assert load_part(name, folder).obj.new == 1


def test_byte_code_of_another_source_is_refused(package: Path) -> None:
    importlib.import_module("bought.drive")
    for name in ("bought.drive", "bought"):
        del sys.modules[name]
    edited_in_disguise(package / "drive.py")
    importlib.invalidate_caches()
    with pytest.raises(SpecError, match=r"byte code of bought\.drive is of another") as error:
        load_part("bought.drive:Mine", Path())
    assert "__pycache__" in error.value.remedy


def test_digest_of_a_package_covers_all_its_files(package: Path, tmp_path: Path) -> None:
    first = load_part("bought.drive:Mine", Path()).source_digest
    (package / "__pycache__" / "noise").write_text("what Python keeps is no source")
    (package / ".hidden").write_text("nor is what an editor keeps")
    assert load_part("bought.drive:Mine", Path()).source_digest == first
    plugin_code._NAMED.clear()  # as in a new process
    (package / "core.so").write_bytes(b"two")
    second = load_part("bought.drive:Mine", Path()).source_digest
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "weights.bin").write_bytes(b"0.5")
    (elsewhere / "round").symlink_to(package)
    (package / "data").symlink_to(elsewhere)
    third = load_part("bought.drive:Mine", Path()).source_digest
    plugin_code._NAMED.clear()
    (elsewhere / "weights.bin").write_bytes(b"0.6")
    fourth = load_part("bought.drive:Mine", Path()).source_digest
    assert len({first, second, third, fourth}) == 4


def test_code_that_a_file_imports_is_part_of_it_where_it_is_the_users_own(
    package: Path, folder: Path
) -> None:
    bare = load_part("./mine.py:Mine", folder)
    assert bare.source_digest == hashlib.sha256((folder / "mine.py").read_bytes()).hexdigest()
    (folder / "mine.py").write_text(
        "import json, numpy, profile\n"
        "from bought.drive import Mine as Base\n\nclass Mine(Base):\n    pass\n"
    )
    part = load_part("./mine.py:Mine", folder)
    assert part.obj.gain == 1
    labels = [label for label, _ in registry.source_files("./mine.py:Mine", folder)]
    assert labels == ["mine.py", "bought/__init__.py", "bought/core.so", "bought/drive.py"]
    (package / "weights.bin").write_bytes(b"data of another package")
    assert load_part("./mine.py:Mine", folder) == part
    (folder / "packing.py").write_text("import hypothesis, numpy, yaml\n")
    labels = [label for label, _ in plugin_code.with_imports([("x", folder / "packing.py")])]
    assert labels == ["x", "hypothesis/METADATA"]
    (folder / "beside").mkdir()
    (folder / "beside" / "helper_beside.py").write_text("gain = 1")
    (folder / "finder.py").write_text(
        "import os, sys\n"
        "sys.path.insert(0, os.path.join(os.path.dirname(__file__), 'beside'))\n"
        "from helper_beside import gain\n\nclass Mine:\n    pass\n"
    )
    unloaded = plugin_code.with_imports([("finder.py", folder / "finder.py")])
    found = load_part("./finder.py:Mine", folder)
    assert registry.source_digest("./finder.py:Mine", folder) == found.source_digest
    assert load_part("./finder.py:Mine", folder) == found
    labels = [label for label, _ in registry.source_files("./finder.py:Mine", folder)]
    assert labels == [label for label, _ in unloaded]
    assert {"finder.py", "./beside/helper_beside.py", "./mine.py"} <= set(labels)
    sys.path.remove(str(folder / "beside"))
    archive = package.parent / "packed.zip"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("packed.py", "gain = 1")
    sys.path.insert(0, str(archive))
    (folder / "packing.py").write_text("import packed\n")
    labels = [label for label, _ in plugin_code.with_imports([("x", folder / "packing.py")])]
    sys.path.remove(str(archive))
    assert labels == ["x", "packed.zip"]
    edited(package / "drive.py")
    assert registry.source_digest("./mine.py:Mine", folder) != part.source_digest
    with pytest.raises(SpecError, match=r"bought\.drive is in memory as it was before"):
        load_part("./mine.py:Mine", folder)


def test_what_cannot_be_found_is_named(folder: Path) -> None:
    for name, message in (
        ("./other.py:Mine", "there is no file"),
        ("./mine.py:Mein", "Did you mean 'Mine'"),
        ("./mine.py", "does not name a class"),
        (":Mine", "does not name a class"),
        ("no_such_module_here:Mine", "there is no module 'no_such_module_here'"),
        ("sys:exit", "has no source file"),
    ):
        refused(SpecError, load_part, name, folder, says=message)


def test_error_while_importing_is_reported_with_file_and_line(folder: Path) -> None:
    for text, message in (("def act(:", ""), ("y = x / 0", "ZeroDivisionError")):
        (folder / "broken.py").write_text(f"x = 1\n{text}\n")
        caught = refused(SpecError, load_part, "./broken.py:Mine", folder, says=message)
        where = known(caught.where)
        assert (Path(where.path).name, where.line) == ("broken.py", 2)


def test_part_of_adeye_that_is_not_for_guests_leads_to_the_public_face(folder: Path) -> None:
    for line in ("from adeye.simulate.channel import Channel", "from adeye.spec import Odds"):
        (folder / "deep.py").write_text(f"{line}\n{CHANNEL}")
        caught = refused(SpecError, load_part, "./deep.py:Mine", folder)
        assert "adeye.ports" in str(caught.remedy)


def test_code_that_changes_the_working_folder_leaves_relative_paths_alone(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "mine.py").write_text(f"import os\nos.chdir('/')\n{CHANNEL}")
    load_part("./mine.py:Mine", Path())
    assert Path.cwd() == folder


def test_file_with_null_bytes_is_an_input_error(folder: Path) -> None:
    (folder / "binary.py").write_bytes(b"\0\1")
    refused(SpecError, load_part, "./binary.py:Mine", folder, says="null")


def test_missing_method_is_named(folder: Path) -> None:
    require(load_part("./mine.py:Mine", folder), "channel", ("act",))
    with pytest.raises(SpecError, match=r"has no act\(\)"):
        require(load_part("./mine.py:Bare", folder), "channel", ("act",))
    with pytest.raises(SpecError, match="not a class"):
        require(load_part("./mine.py:NUMBER", folder), "channel", ("act",))


RAISING = """
class Kind(type):
    def __getattr__(cls, name):
        raise ValueError(name)

class Raising(metaclass=Kind):
    def act(self): pass
    def reset(self): pass

class Listing(Raising):
    monitor_ids, hooks = (), property(len)

class Silent(Exception):
    def __str__(self):
        raise self

def __getattr__(name):
    raise Silent if name == "Missing" else AttributeError
"""


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("Raising", r"the channel \./bad\.py:Raising raised ValueError: monitor_ids \(.*bad\.py:4"),
        ("Listing", r"\./bad\.py:Listing\.hooks is no tuple of names"),
        ("Missing", r"module of \./bad\.py:Missing raised Silent: it cannot say .*bad\.py:18\)"),
    ],
)
def test_attribute_that_raises_is_blamed_on_its_part(folder: Path, name: str, told: str) -> None:
    (folder / "bad.py").write_text(RAISING)

    def use() -> None:
        plugin_channel(load_part(f"./bad.py:{name}", folder))

    refused((PluginError, SpecError), use, says=told)


def test_parameters_are_validated_by_the_declared_model(folder: Path) -> None:
    part = load_part("./mine.py:Mine", folder)
    good = validate_parameters(part, {"speed": "36 km/h"})
    assert good.errors == ()
    assert known(good.parameters).model_dump() == {"speed": pytest.approx(10.0)}
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


READING = """from pathlib import Path
{named}
class Mine:
    def compute(self):
        return Path(__file__).with_name("gain.txt").read_text()
"""


def test_file_that_a_source_names_is_part_of_it_wherever_it_is_imported(folder: Path) -> None:
    (folder / "reading.py").write_text(READING.format(named='adeye_files = ("gain.txt",)'))
    digests = set()
    for text in ("1", "2", "1"):
        (folder / "gain.txt").write_text(text)
        plugin_code._NAMED.clear()  # as in a new process
        part = load_part("./reading.py:Mine", folder, is_sealed=True)
        with sealed(part.name, part.places):
            assert part.build().compute() == text
        assert source_digest("./reading.py:Mine", folder) == part.source_digest
        digests.add(part.source_digest)
    assert len(digests) == 2


def test_module_of_one_name_in_two_folders_is_imported_for_one_only(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(plugin_code, "_BESIDE", {})
    for place, gain in (("a", 0), ("b", 6), ("c", 0)):
        (folder / place).mkdir()
        (folder / place / "helping_twice.py").write_text(f"GAIN = {gain}\n")
        (folder / place / "unused.py").write_text(f"# {place}\n")
        (folder / place / "driving.py").write_text(
            "import sys\nfrom pathlib import Path\n"
            "sys.path.insert(0, str(Path(__file__).parent))\n"
            "class Mine:\n"
            "    def act(self):\n        from helping_twice import GAIN\n        return GAIN\n"
        )
    assert load_part("./a/driving.py:Mine", folder).build().act() == 0
    for _ in range(2):
        refused(
            SpecError,
            load_part,
            "./b/driving.py:Mine",
            folder,
            says=r"helping_twice is .*/b/helping_twice\.py here, and .*/a/helping_twice\.py is or",
        )
    # The same code is the same, wherever it lies; what nobody imports is nobody's.
    assert load_part("./c/driving.py:Mine", folder).build().act() == 0
    del sys.modules["helping_twice"]
    for place in ("a", "c"):  # who may import whatever is there
        (folder / place / "opening.py").write_text("import importlib\nclass Mine:\n    pass\n")
    load_part("./a/opening.py:Mine", folder)
    refused(SpecError, load_part, "./c/opening.py:Mine", folder, says="is or may be imported")


def test_modules_below_and_those_that_read_beside_themselves_are_told_apart(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(plugin_code, "_BESIDE", {})
    here = (
        "import sys\nfrom pathlib import Path\nsys.path.insert(0, str(Path(__file__).parent{}))\n"
    )
    for place, below in (("a", "liba"), ("b", "libb")):
        (folder / place / below).mkdir(parents=True)
        (folder / place / below / "below_both.py").write_text(f"GAIN = '{place}'\n")
        (folder / place / "reading_both.py").write_text(
            "from pathlib import Path\nGAIN = Path(__file__).read_text()\n"
        )
        (folder / place / "below.py").write_text(
            here.format(f" / '{below}'") + "from below_both import GAIN\nclass Mine:\n    pass\n"
        )
        (folder / place / "equal.py").write_text(
            here.format("") + "from reading_both import GAIN\nclass Mine:\n    pass\n"
        )
    for name in ("below", "equal"):
        load_part(f"./a/{name}.py:Mine", folder)
        refused(SpecError, load_part, f"./b/{name}.py:Mine", folder, says="is or may be imported")
    del sys.modules["below_both"], sys.modules["reading_both"]


def test_module_of_both_hands_a_sealed_part_nothing_that_it_does_not_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(folder)
    (folder / "common_to_both.py").write_text("KEPT = {}\n")
    (folder / "gain.txt").write_text("1")
    text = "from common_to_both import KEPT\nclass Mine:\n    pass\n"
    (folder / "telling.py").write_text(f'adeye_files = ["gain.txt"]\n{text}')
    (folder / "judging.py").write_text(text)
    load_part("./telling.py:Mine", folder)
    refused(
        SpecError,
        load_part,
        "./judging.py:Mine",
        folder,
        is_sealed=True,
        says=r"common_to_both\.py may hand it what .*gain\.txt says, which \./telling\.py:Mine",
    )
    (folder / "judging_well.py").write_text(f'adeye_files = ["gain.txt"]\n{text}')
    plugin_code._HANDED.clear()
    load_part("./judging_well.py:Mine", folder, is_sealed=True)
    load_part("./telling.py:Mine", folder)


def test_importable_file_that_nobody_imported_may_be_held(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    (folder / "limits_here.py").write_text("1\n")
    (folder / "running.py").write_text(
        "import runpy, sys\nfrom pathlib import Path\nclass Mine:\n    pass\n"
    )
    load_part("./running.py:Mine", folder)
    (folder / "limits_here.py").write_text("10\n")
    says = r"this process may hold what .*limits_here\.py was before"
    refused(SpecError, load_part, "./running.py:Mine", folder, says=says)


def test_module_that_no_statement_imports_is_refused_with_what_to_do(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = folder.with_name("elsewhere")
    place.mkdir()
    monkeypatch.syspath_prepend(place)
    for name in ("net_early", "net_late", "net_later", "net_stated"):
        (place / f"{name}.py").write_text("class Net:\n    pass\n")
    by_pickle = "pickle.loads(b'cnet_{}\\nNet\\n.')"
    (folder / "early.py").write_text(
        f"import pickle\nNET = {by_pickle.format('early')}\nclass Mine:\n    pass\n"
    )
    says = "imports net_early, which is in no identity: import it in its source, by a statement"
    refused(SpecError, load_part, "./early.py:Mine", folder, says=says)
    (folder / "late.py").write_text(
        "import pickle\nclass Mine:\n    def __init__(self):\n"
        f"        self.net = {by_pickle.format('late')}\n"
    )
    refused(PluginError, load_part("./late.py:Mine", folder).build, says="imports net_late")
    # By now it is there, so that nothing would be seen to come.
    refused(SpecError, load_part, "./late.py:Mine", folder, says="imports net_late")
    (folder / "late.py").write_text("class Mine:\n    pass\n")
    load_part("./late.py:Mine", folder).build()
    # The next wrong version of it is refused as the first one was.
    (folder / "late.py").write_text(
        "import pickle\nclass Mine:\n    def __init__(self):\n"
        f"        self.net = {by_pickle.format('later')}\n"
    )
    refused(PluginError, load_part("./late.py:Mine", folder).build, says="imports net_later")
    refused(SpecError, load_part, "./late.py:Mine", folder, says="imports net_later")
    (folder / "stated.py").write_text(
        "import pickle\nclass Mine:\n    def __init__(self):\n        import net_stated\n"
        f"        self.net = {by_pickle.format('stated')}\n"
    )
    load_part("./stated.py:Mine", folder).build()
    # Nor does it help that another part has imported it, in whose identity it is.
    (folder / "named.py").write_text(
        "from importlib import import_module\nNET = import_module('net_stated')\n"
        "class Mine:\n    pass\n"
    )
    here = sys.modules["net_stated"]
    refused(SpecError, load_part, "./named.py:Mine", folder, says="imports net_stated")
    assert sys.modules["net_stated"] is here


def test_what_a_package_was_executed_with_is_held_for_good(package: Path) -> None:
    (package / "gains.txt").write_text("1")
    load_part("bought.drive:Mine", Path())
    plugin_code.may_hold([package / "gains.txt"])
    refused(SpecError, load_part, "bought.drive:Mine", Path(), says="this process may hold")


def test_named_file_is_data_whatever_it_ends_in(folder: Path) -> None:
    source = READING.format(named='adeye_files = ["gain.py"]').replace("gain.txt", "gain.py")
    (folder / "reading_code.py").write_text(source)
    (folder / "gain.py").write_text("1")
    assert load_part("./reading_code.py:Mine", folder).build().compute() == "1"
    (folder / "gain.py").write_text("2")
    refused(
        SpecError,
        load_part,
        "./reading_code.py:Mine",
        folder,
        says=r"this process may hold what .*gain\.py was before",
    )


def test_what_was_executed_with_another_state_is_held_for_good(folder: Path) -> None:
    (folder / "reading_twice.py").write_text(READING.format(named='adeye_files = ["gain.txt"]'))
    (folder / "gain.txt").write_text("1")
    load_part("./reading_twice.py:Mine", folder)
    plugin_code.may_hold([folder / "gain.txt"])
    refused(SpecError, load_part, "./reading_twice.py:Mine", folder, says="this process may hold")


def test_sealed_part_cannot_read_what_it_does_not_name(folder: Path) -> None:
    (folder / "reading.py").write_text(READING.format(named=""))
    (folder / "gain.txt").write_text("1")
    part = load_part("./reading.py:Mine", folder, is_sealed=True)
    says = (
        r"reading\.py:Mine reads .*gain\.txt, which is not in its identity: name it in the source"
    )
    with pytest.raises(PluginError, match=says), sealed(part.name, part.places):
        part.build().compute()
    # Only there, and others may meanwhile.
    assert part.build().compute() == "1"
    with sealed(part.name, part.places), sealed("./other.py:Other", frozenset()):
        pass
    with ThreadPoolExecutor() as pool:
        before = pool.submit(int).result()
        with sealed(part.name, part.places):
            assert pool.submit(part.build().compute).result() == "1" * (before + 1)
    (folder / "early.py").write_text(
        "from pathlib import Path\n"
        "class Mine:\n    gain = Path(__file__).with_name('gain.txt').read_text()\n"
    )
    with pytest.raises(SpecError, match=r"PluginError: .*gain\.txt"):
        load_part("./early.py:Mine", folder, is_sealed=True)
    assert load_part("./early.py:Mine", folder).obj.gain == "1"


@pytest.mark.parametrize(
    "how",
    [
        "threading.Thread(target=open, args=(path,)).start()",
        "subprocess.check_output(['cat', path])",
        "os.system('cat ' + path)",
        "multiprocessing.get_context('spawn').Process(target=open, args=(path,)).start()",
        "os.fork()",
        "_thread.start_new_thread(open, (path,))",
        "sqlite3.connect(path)",
        "sqlite3.connect(':memory:')",
        "os.listdir(folder)",
        "list(pathlib.Path(folder).glob('gain*'))",
        "list(os.walk(folder))",
        "ctypes.CDLL(path)",
        "os.open('gain.txt', os.O_RDONLY, dir_fd=os.open(folder, os.O_RDONLY))",
        "open(os.open(path, os.O_RDWR))",
        "ast.literal_eval(open(other).read())",
        "open(named)",
        "np.fromfile(path)",
        "np.memmap(path)",
        "zipfile.ZipFile(path)",
    ],
)
def test_seal_holds_for_every_way_to_read(folder: Path, how: str) -> None:
    (folder / "gain.txt").write_text("1")
    (folder / "other.py").write_text("[1]")
    names = {
        "path": str(folder / "gain.txt"),
        "other": str(folder / "other.py"),
        # In the identity of another part, which is that of other results.
        "named": read_file("channels.nominal", "./gain.txt", folder).path,
        "folder": str(folder),
        "np": np,
        **{name: importlib.import_module(name) for name in _MODULES},
    }
    with pytest.raises(PluginError, match="identity"), sealed("./mine.py:Mine", frozenset()):
        eval(how, names)  # noqa: S307 - of this file


def test_folder_that_a_part_calls_one_of_packages_is_none(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = folder / "site-packages" / "limits.txt"
    place.parent.mkdir()
    place.write_text("1")
    monkeypatch.syspath_prepend(place.parent)
    with (
        pytest.raises(PluginError, match=r"limits\.txt, which is not"),
        sealed("./mine.py:Mine", frozenset()),
    ):
        place.read_text()


def test_refusal_that_is_swallowed_is_told_at_the_end(folder: Path) -> None:
    (folder / "gain.txt").write_text("1")

    def read() -> str:
        with suppress(Exception):
            return (folder / "gain.txt").read_text()
        return "default"

    with (
        pytest.raises(PluginError, match=r"gain\.txt, which is not"),
        sealed("./mine.py:Mine", frozenset()),
    ):
        assert read() == "default"
    with sealed("./mine.py:Mine", frozenset()):
        assert (folder / "none.txt").exists() is False


_MODULES = (
    *("_thread", "ast", "ctypes", "multiprocessing", "os", "pathlib", "sqlite3", "subprocess"),
    *("threading", "zipfile"),
)


def test_sealed_part_may_import_and_list_what_is_installed(folder: Path) -> None:
    with sealed("./mine.py:Mine", frozenset()):
        assert PathFinder.find_spec("not_there", [str(folder)]) is None
        assert "json" in os.listdir(Path(json.__file__).parents[1])  # noqa: PTH208 - as a guest may


def test_sealed_part_imports_and_reads_what_is_hashed(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "rated").mkdir()
    (folder / "rated" / "rates.json").write_text("[2]")
    (folder / "rated" / "__init__.py").write_text(
        "import json, rated_other\nfrom pathlib import Path\n"
        "RATES = json.loads(Path(__file__).with_name('rates.json').read_text())\n"
        "class Mine:\n    rates = RATES, rated_other.MORE\n"
    )
    (folder / "rated_other.py").write_text("MORE = 3\n")
    monkeypatch.syspath_prepend(folder)
    assert load_part("rated:Mine", folder, is_sealed=True).obj.rates == ([2], 3)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ("['there' + '.txt']", "is no plain list of names"),
        ("sorted(globals())", "is no plain list of names"),
        ("'gain.txt'", "is no plain list of names"),
        ("['']", "is no plain list of names"),
        ("[3]", "is no plain list of names"),
        ("['there.txt']", "there is no file 'there.txt' beside it or below"),
        ("['../gain.txt']", "there is no file"),
        ("['/etc/hosts']", "there is no file"),
    ],
)
def test_list_of_files_that_cannot_be_read_as_it_stands_is_refused(
    folder: Path, told: str, message: str
) -> None:
    (folder / "inner").mkdir()
    (folder / "gain.txt").write_text("1")
    (folder / "inner" / "mine.py").write_text(f"adeye_files: list = {told}\nclass Mine: ...\n")
    caught = refused(SpecError, load_part, "inner/mine.py:Mine", folder, says=message)
    assert caught.where is not None
    assert caught.where.line == 1


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
    caught = refused(SpecError, read_file, "channels.mine", name, inner, says=message)
    assert caught.remedy


def test_file_that_is_too_large_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "LARGEST_FILE", 3)
    (folder / "small.bin").write_bytes(b"123")
    (folder / "large.bin").write_bytes(b"1234")
    assert read_file("channels.mine", "small.bin", folder).digest
    with pytest.raises(SpecError, match=r"'large\.bin' has .* GiB, more than"):
        read_file("channels.mine", "large.bin", folder)


@pytest.mark.parametrize(("place", "name"), [("beside", "packed_near"), ("..", "packed_above")])
def test_module_out_of_an_archive_counts_as_the_archive(
    folder: Path, monkeypatch: pytest.MonkeyPatch, place: str, name: str
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    packed = folder / place / "packed.zip"
    packed.parent.mkdir(exist_ok=True)

    def pack(gain: int) -> None:
        with zipfile.ZipFile(packed, "w") as file:
            file.writestr(f"{name}.py", f"gain = {gain}")

    pack(1)
    (folder / "unpacks.py").write_text(
        f"import os, sys\nhere = os.path.dirname(__file__)\n"
        f"sys.path.insert(0, os.path.join(here, '{place}', 'packed.zip'))\n"
        f"from {name} import gain\nclass Mine:\n    pass\n"
    )
    part = load_part("./unpacks.py:Mine", folder)
    assert registry.source_digest("./unpacks.py:Mine", folder) == part.source_digest
    pack(2)
    assert registry.source_digest("./unpacks.py:Mine", folder) != part.source_digest
    refused(SpecError, load_part, "./unpacks.py:Mine", folder, says="before it was written")


GAINS = {"one": 1.0, "ten": 10.0}


def of_one_helper(folder: Path, name: str, helper: str, **parts: str) -> None:
    """Write a module, and parts that begin with what is given."""
    (folder / f"{name}.py").write_text(helper)
    for part, text in parts.items():
        (folder / f"{part}.py").write_text(
            f"import os, sys\nsys.path.insert(0, os.path.dirname(__file__))\n{text}\n"
            "class Mine:\n    pass\n"
        )


def test_two_parts_that_set_a_variable_are_refused_though_the_last_one_sets_what_the_source_says(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    for name, order in (("set_one_way", ("ten", "one")), ("set_other_way", ("one", "ten"))):
        monkeypatch.setattr(plugin_code, "_SHARED", {})
        puts = {part: f"import {name}\n{name}.F = {gain}" for part, gain in GAINS.items()}
        of_one_helper(folder, name, "F = 1.0\n", **puts)
        load_part(f"./{order[0]}.py:Mine", folder)
        says = "F in it is not what its source says"
        refused(SpecError, load_part, f"./{order[1]}.py:Mine", folder, says=says)


def loaded_and(folder: Path, *parts: str, then: str = "") -> None:
    """Load parts as a block of test cases does, and do what one of them would."""
    with plugin_code.settings_kept():
        for part in parts:
            load_part(f"./{part}.py:Mine", folder)
        exec(then, dict(sys.modules))  # noqa: S102


@pytest.mark.parametrize(
    ("helper", "writes"),
    [
        ("F = 1.0", "{0}.F = 10.0"),
        ("F = 1.0", "{0}.G = 10.0"),
        ("F = {'gain': 1.0}", "{0}.F['gain'] = 10.0"),
        ("F = {'gain': [1.0, 2.0]}", "{0}.F['gain'][1] = 10.0"),
        ("import numpy\nF = numpy.ones(3)", "{0}.F[:] = 10.0"),
        ("class Gains:\n    F = 1.0", "{0}.Gains.F = 10.0"),
        (
            "class Gains:\n    def __init__(self):\n        self.gain = 1\nF = Gains()",
            "{0}.F.gain = 9",
        ),
    ],
)
def test_what_is_set_while_parts_compute_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, helper: str, writes: str
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(plugin_code, "_SHARED", {})
    name = "late_" + hashlib.sha256(f"{helper}{writes}".encode()).hexdigest()[:8]
    of_one_helper(folder, name, f"{helper}\n", sets=f"import {name}", reads=f"import {name}")
    loaded_and(folder, "sets", "reads")
    says = "is not what its source says"
    # As a part would while it computes.
    refused(SpecError, loaded_and, folder, "reads", then=writes.format(name), says=says)
    refused(SpecError, load_part, "./reads.py:Mine", folder, says=says)
    loaded_and(folder)  # nobody else is to suffer


@pytest.mark.parametrize("is_first", [True, False])
@pytest.mark.parametrize(
    ("helper", "writes"),
    [
        ("F = 1.0", "{0}.F = 10.0"),
        ("F = 1.0", "{0}.G = 10.0"),
        ("F = (1.0, 2)", "setattr({0}, 'F', (1.0, 3))"),
        ("F = {'gain': 1.0}", "{0}.F['gain'] = 10.0"),
        ("F = {}", "{0}.F.update(gain=10.0)"),
        ("import numpy\nF = numpy.ones(3)", "{0}.F[1] = 10.0"),
        ("class Gains:\n    F = 1.0", "{0}.Gains.F = 10.0"),
        ("class Gains:\n    pass\nF = Gains()", "{0}.F.gain = 10.0"),
        ("from types import SimpleNamespace\nF = SimpleNamespace(gain=1)", "{0}.F.gain = 10"),
        ("def gain():\n    return 1.0", "{0}.gain = lambda: 10.0"),
        ("def gain():\n    return 1.0", "{0}.gain.by = 10.0"),
        ("F = 1.0\ndef put(gain):\n    global F\n    F = gain", "{0}.put(10.0)"),
    ],
)
def test_part_finds_nothing_that_another_one_put_into_a_module_of_both(
    folder: Path, monkeypatch: pytest.MonkeyPatch, helper: str, writes: str, *, is_first: bool
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(plugin_code, "_SHARED", {})
    name = "both_" + hashlib.sha256(f"{helper}{writes}{is_first}".encode()).hexdigest()[:8]
    writing = f"import {name}\n{writes.format(name)}"
    of_one_helper(folder, name, f"{helper}\n", puts=writing, finds=f"import {name}")
    says = rf"{name}\.py is used by .*not what its source says: one of them has set it"
    first, second = ("finds", "puts") if is_first else ("puts", "finds")
    load_part(f"./{first}.py:Mine", folder)
    for _ in range(2):
        refused(SpecError, load_part, f"./{second}.py:Mine", folder, says=says)


def test_module_of_both_that_nobody_changes_may_keep_what_it_computes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(plugin_code, "_SHARED", {})
    helper = (
        "import functools, logging, time\nimport numpy as np\nfrom dataclasses import dataclass\n"
        "LOG, BEGAN, TABLE = logging.getLogger(__name__), time.time(), np.eye(2)\nKEPT = {}\n"
        "@dataclass\nclass Gain:\n    value: float = 1.0\nGAIN, CALLS = Gain(), 0\n"
        "@functools.lru_cache\ndef gain(x):\n    KEPT[x] = 2 * x\n    return KEPT[x]\n"
        "def count():\n    global CALLS\n    CALLS += 1\n"
    )
    of_one_helper(
        folder, "kept_by_both", helper, one="import kept_by_both", two="import kept_by_both"
    )
    loaded_and(folder, "one", "two", "one", then="kept_by_both.gain(3.0)")
    load_part("./two.py:Mine", folder)
    # A number is a setting, which whoever measures next would find.
    says = "CALLS in it is not what its source says"
    counts = "kept_by_both.count()"
    refused(SpecError, loaded_and, folder, "two", then=counts, says=says)
