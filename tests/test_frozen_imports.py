"""What a source of the user's is said to import, by statement or by name, and which files count."""

from pathlib import Path

from adeye import plugin_code
from adeye.errors import AdeyeError
from tests.frozen import assert_frozen, masked

SOURCES = {
    "plain": "import os, json.decoder as d\nfrom numpy.linalg import norm\n",
    "relative": "from . import beside\nfrom .below import thing\n",
    "inside": "def f():\n    import csv\n    class A:\n        from math import pi\n",
    "of adeye": "import adeye.testing\nfrom adeye import signals\n",
    "imports by name": "import importlib\nm = importlib.import_module('beside')\n",
    "from importlib": "from importlib import import_module\n",
    "dunder": "m = __import__('beside')\n",
    "exec": "exec('import beside')\n",
    "eval": "x = eval('1')\n",
    "an attribute called eval": "class A: pass\nA.eval = 1\nx = A.eval\n",
    "sys path": "import sys\nsys.path.insert(0, 'below')\nimport beside\n",
    "from sys": "from sys import path\npath.append('below')\n",
    "sys argv": "import sys\nprint(sys.argv)\n",
    "sys modules": "import sys\nsys.modules.clear()\n",
    "runpy": "import runpy\n",
    "only a word": "'importlib'\n# exec\n",
    "syntax error": "import beside\ndef (:\n",
    "not a text": "\0",
    "beside": "import beside\n",
    "beside and below": "import beside, below.deep\n",
    "reads files": 'adeye_files = ["data.csv", "below/more.txt", "data.csv"]\n',
    "reads a tuple": 'adeye_files: tuple = ("data.csv",)\n',
    "reads nothing": "adeye_files = []\n",
    "reads what is computed": "adeye_files = ['a' + 'b']\n",
    "reads a text": "adeye_files = 'data.csv'\n",
    "reads what is not there": "adeye_files = ['nowhere.csv']\n",
    "reads what is above": "adeye_files = ['../above.csv']\n",
    "reads an empty name": "adeye_files = ['']\n",
    "reads a number": "adeye_files = [1]\n",
    "reads later": "x = 1\n\nadeye_files = ['nowhere.csv']\n",
}


def test_what_sources_import_and_read_is_frozen(tmp_path: Path) -> None:
    folder = tmp_path / "parts"
    for name in ("below", "below/deeper", ".hidden", "below/__pycache__"):
        (folder / name).mkdir(parents=True)
    for name in (
        "data.csv", "beside.py", "below/__init__.py", "below/deep.py", "below/more.txt",
        "below/deeper/last.py", "below/deeper/code.so", ".hidden/x.py", "below/__pycache__/y.py",
        "below/.dotted.py", "../above.csv",
    ):  # fmt: skip
        (folder / name).write_text("", "utf-8")
    (folder / "beside.py").write_text("import below\n", "utf-8")
    packaged = [label for label, _ in plugin_code.package_files([folder / "below", folder])]
    lines = [f"all files: {packaged}"]
    for name, text in SOURCES.items():
        path = folder / "tried.py"
        path.write_text(text, "utf-8")
        plugin_code._names_in.cache_clear()
        plugin_code._told_files.cache_clear()
        stated = plugin_code.stated_imports(path)
        lines.append(f"{name}: {'not all is told' if stated is None else sorted(stated)}")
        for program in (path, folder / "tried"):
            program.write_text(text, "utf-8")
            found = plugin_code.imports_beside(program, "python" if program == path else "")
            lines.append(f"  beside {program.name}: {[item.name for item in found]}")
            if program != path:
                program.unlink()
        try:
            labels = [label for label, _ in plugin_code.with_imports([("tried", path)])]
            lines.append(f"  with {[label for label in labels if 'METADATA' not in label]}")
        except AdeyeError as error:
            lines.append(f"  {error}")
    assert_frozen("imports.txt", masked("\n".join(lines), tmp_path))
