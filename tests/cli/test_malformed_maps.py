"""Malformed maps: an error with its place, exit code 2, no traceback, no hang, little memory."""

import gzip
import itertools
import re
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.processes import python

SMALL = (Path(__file__).parents[1] / "malformed" / "small.xodr").read_bytes()
ROAD_10 = SMALL[SMALL.index(b'<road id="10"') : SMALL.index(b'  <road id="11"')]
HEAD = b'<?xml version="1.0"?>\n'
LAUGHS = b"".join(b'<!ENTITY l%d "%s">\n' % (k, b"&l%d;" % (k - 1) * 10) for k in range(1, 10))

CHANGES: dict[str, tuple[str, str, str]] = {
    # What is wrong: text of the small map, what takes its place, and what is said.
    "root that is missing": ("<OpenDRIVE>", "<Map>", "mismatched tag"),
    "entity": ('name="small"', 'name="&small;"', "undefined entity"),
    "attribute twice": ('name="small"', 'name="a" name="b"', "duplicate attribute"),
    "no quotes": ('name="small"', "name=small", "not well-formed"),
    "two roots": ("</OpenDRIVE>", "</OpenDRIVE><OpenDRIVE/>", "junk after document element"),
    "control character": ('name="small"', 'name="\x01"', "not well-formed"),
    "header that is missing": ("header", "heading", "there is no <header>"),
    "second header": ("</header>", "</header><header revMajor='1' revMinor='6'/>", "second"),
    "other version": ('revMajor="1"', 'revMajor="2"', "revMajor is 2"),
    "version that is missing": ('revMajor="1"', "", "revMajor is missing"),
    "no roads": ("road ", "rode ", "mismatched tag"),
    "id twice": ('road id="2"', 'road id="1"', "is given twice, the first time in line 7"),
    "junction twice": ('<junction id="1"', '<junction id="1"/><junction id="1"', "given twice"),
    "id that is missing": ('road id="2"', "road", "id is missing"),
    "length that is missing": (' length="100" junction', " junction", "length is missing"),
    "length of another road": ('length="100"', 'length="101"', "length is 101 m"),
    "no plan": ("planView", "plan", "it has no <planView>"),
    "no lanes": ("lanes>", "streets>", "it has no <lanes>"),
    "no pieces": ("geometry", "shape", "it has no <geometry>"),
    "no shape": ("<line/>", "", "it has no shape"),
    "two shapes": ("<line/>", '<line/><arc curvature="0"/>', "several shapes, line, arc"),
    "unknown shape": ("<line/>", "<clothoid/>", "it has no shape"),
    "two plans": ("</planView>", "</planView><planView/>", "it is there twice"),
    "gap of pieces": ('s="60" x', 's="61" x', "the piece before ends at 60 m"),
    "overlap of pieces": ('s="60" x', 's="55" x', "the piece before ends at 60 m"),
    "line that begins late": ('<geometry s="0"', '<geometry s="3"', "the road begins at 0 m"),
    "curvature of a point": ('curvature="0.02"', 'curvature="11"', "from -10 to 10"),
    "polynomial astray": ('c="0.01"', 'c="9"', "leads 900 m away"),
    "polynomial to nowhere": ('bU="1"', 'bU="0"', "it leads nowhere"),
    "width astray": ('a="3.5" b="0"', 'a="3.5" b="99"', "Up to 1000 m"),
    "far away": ('x="40"', 'x="1.1e7"', "from -1e+07 to 1e+07"),
    "turned too often": ('hdg="0.2"', 'hdg="1e4"', "from -1000 to 1000"),
    "unknown range": ('"arcLength"', '"length"', "pRange is 'length'"),
    "negative place": ('<laneOffset s="50"', '<laneOffset s="-5"', "s is '-5'"),
    "section behind the end": ('<laneSection s="50">', '<laneSection s="101">', "100 m long"),
    "section twice": ('<laneSection s="50">', '<laneSection s="0">', "two sections begin at 0 m"),
    "section that begins late": ('<laneSection s="0">', '<laneSection s="4">', "begins at 0 m"),
    "no section": ("laneSection", "section", "it has no <laneSection>"),
    "gap of ids": ('<lane id="-2"', '<lane id="-3"', "the ids of its lanes are -1, -3"),
    "lane twice": ('<lane id="-2"', '<lane id="-1"', "the ids of its lanes are -1, -1"),
    "lane on the wrong side": ('<lane id="1"', '<lane id="-1"', "the ids of its lanes are -1"),
    "lane of no side": ('<lane id="1"', '<lane id="0"', "the ids of its lanes are 0"),
    "centre that is none": ('<lane id="0"', '<lane id="5"', "it has neither"),
    "half a lane": ('<lane id="-2"', '<lane id="-2.5"', "id is -2.5"),
    "no width": ("width", "wide", "neither <width> nor <border>"),
    "negative width": ('a="3.5"', 'a="-3.5"', "width is -3.5 m"),
    "width of a town": ('a="3.5"', 'a="3500"', "it comes to 3500 m"),
    "width that begins late": ('<width sOffset="0"', '<width sOffset="2"', "begins at 0 m"),
    "unknown direction": ('<lane id="1"', '<lane direction="up" id="1"', "direction is 'up'"),
    "unknown rule": ('rule="RHT"', 'rule="UHT"', "rule is 'UHT'"),
    "unknown unit": ('unit="km/h"', 'unit="kn"', "unit is 'kn'"),
    "speed of no road": ('max="50"', 'max="9e6"', "max is '9e6'"),
    "negative speed": ('max="50"', 'max="-50"', "max is '-50'"),
    "road that is missing": ('elementId="2"', 'elementId="22"', "there is no road '22'"),
    "junction that is missing": ('elementId="1"/>', 'elementId="9"/>', "there is no junction '9'"),
    "own junction that is missing": ('junction="1"', 'junction="7"', "there is no junction '7'"),
    "link to nothing": (' elementId="2"', "", "elementId is missing"),
    "link to what": ('elementType="junction"', 'elementType="bridge"', "elementType is 'bridge'"),
    "no contact": (' contactPoint="end"/>', "/>", "contactPoint is missing"),
    "middle contact": ('contactPoint="end"', 'contactPoint="middle"', "contactPoint is 'middle'"),
    "way from nowhere": ('incomingRoad="1"', 'incomingRoad="8"', "there is no road '8'"),
    "way to nowhere": ('connectingRoad="10"', 'connectingRoad="8"', "there is no road '8'"),
    "way without a road": (' connectingRoad="10"', "", "connectingRoad is missing"),
    "way from a missing lane": ('from="-2"', 'from="-3"', "none of its lanes is there"),
    "way to a missing lane": ('to="-1"', 'to="4"', "none of its lanes is there"),
    "way from a centre": ('from="-2"', 'from="0"', "none of its lanes is there"),
    "unknown junction": ('name="crossing"', 'type="knot"', "type is 'knot'"),
    "signal behind the end": ('s="95"', 's="195"', "s is '195'"),
    "other file": ("<geoReference>", '<include file="/etc/x"/><geoReference>', "'/etc/x'"),
}  # fmt: skip
NUMBERS = ('length="100"', 's="40" x', 'y="1.33"', 'hdg="0.6"', 'curvature="0.02"', 'c="0.01"',
           'bU="1"', 'sOffset="0" a', 'max="50"', 's="95"', 'revMinor="6"', 'id="-2"')  # fmt: skip
WRONG = ("nan", "inf", "-INF", "1e999", "1_0", "0x10", "\u0661\u0660", "1,5", "ten", "")


def changed(old: str, new: str) -> bytes:
    assert old.encode() in SMALL
    return SMALL.replace(old.encode(), new.encode())


def flaws() -> Iterator[tuple[str, bytes, str]]:
    """Give malformed maps: what is wrong, the file, and what is said of it."""
    for what, (old, new, said) in CHANGES.items():
        yield what, changed(old, new), said
    for text, value in itertools.product(NUMBERS, WRONG):
        name = text.split('="')[0]
        wrong = re.sub('"[^"]*"', f'"{value}"', text, count=1)
        yield f"{name}={value!r} in {text}", changed(text, wrong), f"{name} is {value!r}"
    for part in range(1, 50):
        end = len(SMALL) * part // 50
        yield f"cut after {end} bytes", SMALL[:end], "no well-formed XML"
    yield (
        "bomb",
        HEAD + b'<!DOCTYPE l [<!ENTITY l0 "ha">\n' + LAUGHS + b"]><l>&l9;</l>",
        "<!DOCTYPE",
    )
    yield (
        "external entity",
        HEAD + b'<!DOCTYPE OpenDRIVE [<!ENTITY x SYSTEM "file:///etc/passwd">]>' + SMALL[39:],
        "<!DOCTYPE",
    )
    yield "external type", HEAD + b'<!DOCTYPE a SYSTEM "http://localhost/a.dtd"><a/>', "<!DOCTYPE"
    yield "HTML", b"<!DOCTYPE html>\n<html><body>404</body></html>", "this is an HTML page"
    yield "XHTML", b"<html><body/></html>", "an HTML page"
    yield "net.xml", HEAD + b'<net version="1.20"><location/></net>', "netconvert"
    yield "OpenStreetMap", b"<osm/>", "netconvert --osm-files"
    yield "scenario", b"<OpenSCENARIO/>", "a scenario"
    yield "packed", gzip.compress(SMALL), "packed by gzip"
    yield "zipped", b"PK\x03\x04" + bytes(40), "packed by zip"
    yield "empty", b"", "the file is empty"
    yield "blank", b" \n", "the file is empty"
    yield "text", b"s,x,y\n0,1,2\n", "syntax error"
    yield "YAML", b"odd: motorway\n", "syntax error"
    yield "zeros", bytes(4096), "not well-formed"
    yield "noise", bytes(range(1, 256)) * 40, "not well-formed"
    yield "UTF-16 that says UTF-8", SMALL.decode().encode("utf-16-le"), "encoding"
    yield "Latin that says UTF-8", SMALL.replace(b"small", b"K\xf6ln"), "not well-formed"
    yield "unknown encoding", SMALL.replace(b"UTF-8", b"EBCDIC-7"), "unknown encoding"
    yield "no road at all", SMALL[: SMALL.index(b"  <road")] + b"</OpenDRIVE>", "there is no <road>"
    yield "deep", b"<OpenDRIVE>" + b"<a>" * 100_000, "nested more than 50 deep"
    yield "many elements", b"<OpenDRIVE><a>" + b"<b/>" * 100_001, "more than 100,000 elements"
    yield "long name", b"<OpenDRIVE><" + b"a" * 1_000 + b"/>", "a name has more than 200 letters"
    yield "long tag", b'<OpenDRIVE a="' + b"a" * 2_000_000 + b'"/>', "longer than 1,000,000 bytes"
    yield "long comment", b"<OpenDRIVE><!-- " + b"a" * 2_000_000, "longer than 1,000,000 bytes"
    yield "long text", SMALL.replace(b"[CDATA[", b"[CDATA[" + b"a" * 200_000), "100,000 characters"
    many = b" ".join(b'a%d=""' % k for k in range(200))
    yield "many attributes", b"<OpenDRIVE " + many + b"/>", "more than 100 attributes"
    itself = ROAD_10.replace(
        b'elementId="1" contactPoint="end"', b'elementId="10" contactPoint="start"'
    )
    yield "link to itself", SMALL.replace(ROAD_10, itself), "the road's start is linked to itself"


FLAWS = list(flaws())


def test_there_are_enough() -> None:
    assert len(FLAWS) >= 200
    contents = [content for _, content, _ in FLAWS]
    assert [what for what, content, _ in FLAWS if contents.count(content) > 1] == []


@pytest.mark.parametrize(
    ("content", "said"), [pytest.param(*flaw[1:], id=flaw[0]) for flaw in FLAWS]
)
def test_malformed_map_is_refused_at_its_place(
    adeye: Any, folder: Path, content: bytes, said: str
) -> None:
    (folder / "map.xodr").write_bytes(content)
    started = time.process_time()
    refused = adeye("map", "show", "map.xodr").refused
    assert time.process_time() - started < 1.0
    assert said in refused
    assert "Traceback" not in refused
    assert re.match(r"SpecError: map\.xodr:\d+:\d+: ", refused)


def test_import_of_a_malformed_map_writes_nothing(adeye: Any, folder: Path) -> None:
    (folder / "map.xodr").write_bytes(changed('a="3.5"', 'a="-3.5"'))
    assert "width is -3.5 m" in adeye("map", "import", "map.xodr", "-o", "out").refused
    assert [path.name for path in folder.iterdir()] == ["map.xodr"]


MEASURED = """
import re, sys, time
from pathlib import Path
from adeye.cli import main
for path in sorted(Path().glob("*.xodr")):
    # The peak counts from here on.
    Path("/proc/self/clear_refs").write_text("5")
    begun = time.process_time()
    code = main(["map", "show", path.name])
    status = Path("/proc/self/status").read_text()
    (peak,) = re.findall(r"VmHWM:\\s*(\\d+) kB", status)
    print(path.stem, code, time.process_time() - begun, peak)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_no_malformed_map_takes_much_memory_or_time(folder: Path) -> None:
    (folder / "+.xodr").write_bytes(SMALL[: len(SMALL) // 2])
    for number, (_, content, _) in enumerate(FLAWS):
        (folder / f"{number}.xodr").write_bytes(content)
    ended = python("-c", MEASURED, cwd=folder)
    rows = [line.split() for line in ended.stdout.splitlines()]
    assert len(rows) == len(FLAWS) + 1, ended.stderr
    assert {code for _, code, _, _ in rows} == {"2"}
    assert ended.stderr.count("SpecError: ") == len(rows)
    # What the first imports is counted with it: it is one more than those that are looked at.
    counted = {name: (float(seconds), int(peak)) for name, _, seconds, peak in rows}
    names = {str(number): what for number, (what, _, _) in enumerate(FLAWS)}
    assert {names[n]: s for n, (s, _) in counted.items() if n in names and s >= 1.0} == {}
    assert {names[n]: kb for n, (_, kb) in counted.items() if n in names and kb >= 200_000} == {}
