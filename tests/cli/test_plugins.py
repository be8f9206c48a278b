import json
from pathlib import Path

from tests.cli.conftest import Verb
from tests.test_malformed_inputs import FILES


def test_plugins_of_an_odd_are_listed(adeye: Verb, folder: Path) -> None:
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    odd = folder / "odd/small.yaml"
    said = adeye("plugins", str(odd))
    assert (said.code, "The ODD names no plug-in." in said.out) == (0, True)
    with odd.open("a", encoding="utf-8") as file:
        file.write("plugins: [./architectures/leaving.py:Gone, ./none.py:No]\n")
    said = adeye("plugins", str(odd))
    assert said.code == 0
    assert "./architectures/leaving.py:Gone" in said.out
    assert "not found" in said.out
    found = json.loads(adeye("plugins", str(odd), "--json").out)
    assert found["schema"] == "adeye/plugins@1"
    assert [bool(item["digest"]) for item in found["named"]] == [True, False]


def test_unreadable_odd_is_refused(adeye: Verb) -> None:
    said = adeye("plugins", "nowhere.yaml")
    assert (said.code, "there is no such file" in said.err) == (2, True)
