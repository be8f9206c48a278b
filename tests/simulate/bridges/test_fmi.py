"""What an FMU says of itself, and how its variables are wired to signals."""

import math
import shutil
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from adeye.errors import InputError, SpecError
from adeye.simulate.bridges import fmi
from adeye.units import Dimension
from tests.refusals import refused
from tests.simulate.bridges.fmus import SHIPPED, SI, Var, build_fmu, builder, cruise

SPEED, LENGTH = Dimension.SPEED, Dimension.LENGTH


@pytest.fixture(scope="module")
def description(tmp_path_factory: pytest.TempPathFactory) -> fmi.Description:
    return fmi.read_description(cruise(tmp_path_factory.mktemp("fmu")))


def test_description_says_what_the_file_has(description: fmi.Description) -> None:
    assert (description.version, description.model) == ("2.0", "cruise")
    assert description.is_steppable
    speed = description.variables["speed"]
    assert (speed.kind, speed.causality, speed.unit) == ("Real", "input", "km/h")


def test_signal_is_converted_to_the_unit_that_the_fmu_defines(description: fmi.Description) -> None:
    (wire,) = fmi.wire(description, [("ego.speed", "speed", SPEED)], "input")
    assert wire.to_variable(10.0) == pytest.approx(36.0, rel=1e-15)
    assert wire.to_signal(36.0) == pytest.approx(10.0, rel=1e-15)


def test_variable_without_a_unit_is_in_si(tmp_path: Path) -> None:
    found = fmi.read_description(build_fmu(tmp_path, "bare", [Var("u", "input")], ""))
    (wire,) = fmi.wire(found, [("ego.speed", "u", SPEED)], "input")
    assert wire.to_variable(10.0) == 10.0


def test_unit_with_an_offset_is_converted(tmp_path: Path) -> None:
    units = {"late": 's="1" factor="60" offset="30"'}
    path = build_fmu(tmp_path, "late", [Var("t", "input", unit="late")], "", units=units)
    (wire,) = fmi.wire(fmi.read_description(path), [("time", "t", Dimension.TIME)], "input")
    assert wire.to_variable(90.0) == 1.0
    assert wire.to_signal(1.0) == 90.0


@pytest.mark.parametrize(
    ("wanted", "causality", "says"),
    [
        (("lead.gap", "speed", LENGTH), "input", "'km/h', which is not that of a length"),
        (("ego.speed", "sped", SPEED), "input", "Did you mean 'speed'"),
        (("ego.speed", "a", SPEED), "input", "no input but output"),
        (("acceleration", "speed", SPEED), "output", "no output but input"),
    ],
)
def test_variable_that_does_not_fit_is_refused(
    description: fmi.Description, wanted: tuple[str, str, Dimension], causality: str, says: str
) -> None:
    refused(SpecError, fmi.wire, description, [wanted], causality, says=says)


@pytest.mark.parametrize("kind", ["Boolean", "Int32", "UInt8", "Integer"])
def test_whole_number_is_told_and_told_to_nothing_that_has_a_fraction(kind: str) -> None:
    variable = fmi.Variable("v", kind, "input", "discrete", "", "", is_scalar=True)
    description = SimpleNamespace(variables={"v": variable}, units={})
    none = Dimension.NONE
    for signal, dimension in (("friction", none), ("objects.1.vx", SPEED), ("lead.gap", LENGTH)):
        wanted = [(signal, "v", dimension)]
        says = f"is {kind}, no number with a fraction"
        refused(SpecError, fmi.wire, description, wanted, "input", says=says)
    assert fmi.wire(cast("Any", description), [("objects.1.present", "v", none)], "input")


@pytest.mark.parametrize("factor", ["0", "0.0", "NaN", "INF", "-INF"])
def test_unit_without_a_size_is_refused(tmp_path: Path, factor: str) -> None:
    units = {"odd": f's="1" factor="{factor}"'}
    path = build_fmu(tmp_path, "odd", [Var("t", "input", unit="odd")], "", units=units)
    found = fmi.read_description(path)
    refused(SpecError, fmi.wire, found, [("time", "t", Dimension.TIME)], "input", says="factor")


def test_unit_that_is_no_motion_is_refused(tmp_path: Path) -> None:
    path = build_fmu(tmp_path, "mass", [Var("m", "input", unit="kg")], "", units=SI)
    found = fmi.read_description(path)
    refused(SpecError, fmi.wire, found, [("time", "m", Dimension.TIME)], "input", says="'kg'")


@pytest.mark.parametrize(
    ("start", "says"),
    [
        ({"gian": 1.0}, "Did you mean 'gain'"),
        ({"gain": "high"}, "'high' is none of Real 'gain'"),
        ({"gain": math.nan}, "is none of Real 'gain'"),
        ({"gain": math.inf}, "is none of Real 'gain'"),
        ({"gain": True}, "is none of Real 'gain'"),
        ({"a": 1.0}, "variable 'a' of the FMU cannot be set"),
    ],
)
def test_start_value_that_cannot_be_set_is_refused(
    description: fmi.Description, start: dict[str, Any], says: str
) -> None:
    refused(SpecError, fmi.require_start, description, start, says=says)


TAKEN: list[tuple[str, Any, bool]] = [
    ("Int8", -128, True),
    ("Int8", -129, False),
    ("UInt8", 255, True),
    ("UInt8", 256, False),
    ("UInt16", -1, False),
    ("Int64", 2**63 - 1, True),
    ("Int64", 1e30, False),
    ("Integer", 2**31, False),
    ("Enumeration", 2.0, True),
    ("Enumeration", 2.5, False),
    ("Integer", True, False),
    ("Boolean", False, True),
    ("Boolean", 1, False),
    ("Boolean", 0.3, False),
    ("Real", 3, True),
    ("String", "3", True),
    ("String", 3, False),
    ("Binary", "00", False),
]


@pytest.mark.parametrize(("kind", "value", "is_taken"), TAKEN)
def test_value_is_taken_as_it_is_or_not(kind: str, value: object, *, is_taken: bool) -> None:
    assert fmi.takes(kind, value) is is_taken


@pytest.mark.parametrize("name", ["single_track", "follow_and_keep"])
def test_shipped_fmu_is_what_its_script_builds(name: str, tmp_path: Path) -> None:
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    builder.main(tmp_path)
    for member in ("modelDescription.xml", "sources/model.c"):
        made, shipped = (
            zipfile.ZipFile(folder / f"{name}.fmu").read(member) for folder in (tmp_path, SHIPPED)
        )
        assert made == shipped


def archive(path: Path, *members: tuple[zipfile.ZipInfo | str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in members:
            file.writestr(name, content)
    return path


def linked() -> zipfile.ZipInfo:
    info = zipfile.ZipInfo("resources/link")
    info.external_attr = 0o120777 << 16
    return info


BOMB = b"""<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "%s">%s]><fmiModelDescription
fmiVersion="2.0" modelName="&z9;" guid="g"/>""" % (
    b"a" * 100,
    b"".join(
        b'<!ENTITY z%d "%s">' % (at, (b"&z%d;" % (at - 1) if at else b"&a;") * 10)
        for at in range(10)
    ),
)


@pytest.mark.parametrize(
    ("members", "says"),
    [
        ([("../evil", b"x")], "outside of its folder"),
        ([("/etc/evil", b"x")], "outside of its folder"),
        ([("a\\b", b"x")], "outside of its folder"),
        ([(linked(), b"/etc/passwd")], "has a link"),
        ([("resources/zeros", bytes(2**26)), ("big", b"x")], "GiB, more than 0.0625"),
        ([("readme", b"x")], "no valid description"),
        ([("modelDescription.xml", b"<not xml")], "no valid description"),
        ([("modelDescription.xml", b"<fmiModelDescription/>")], "no valid description"),
        ([("modelDescription.xml", BOMB)], "no valid description"),
        ([("modelDescription.xml", bytes(2**25 + 1))], "a description of 32 MiB"),
    ],
    ids=["up", "root", "drive", "link", "large", "none", "torn", "empty", "bomb", "long"],
)
def test_hostile_archive_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, members: Any, says: str
) -> None:
    monkeypatch.setattr(fmi, "LARGEST", 2**26)
    refused(SpecError, fmi.read_description, archive(tmp_path / "x.fmu", *members), says=says)


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    path.write_bytes(b"MZ no archive")
    refused(SpecError, fmi.read_description, path, says="is no FMU")


def test_missing_file_is_told(tmp_path: Path) -> None:
    refused(SpecError, fmi.read_description, tmp_path / "x.fmu", says="there is no file")


def test_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy", None)
    refused(InputError, fmi.read_description, tmp_path / "x.fmu", says=r"adeye\[fmi\]")
