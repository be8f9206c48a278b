"""The program of the zoo knows every animal that has an outcome, and no other."""

import ast
import json
import subprocess
import sys

import pytest

from adeye.testing import zoo

HELLO = {
    "hello": "adeye/channel@1",
    "links": [],
    "parameters": {"values": {"animal": "", "from_tick": 1}},
}


def asked(name: str, *lines: object) -> list[str]:
    hello = json.loads(json.dumps(HELLO))
    hello["parameters"]["values"]["animal"] = name
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-B", zoo.PROGRAM],
        input="".join(json.dumps(line) + "\n" for line in (hello, *lines)),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    return done.stdout.splitlines()


def test_every_animal_is_a_function_of_the_program() -> None:
    tree = ast.parse(zoo.PROGRAM.read_text("utf-8"))
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert functions - {"_say", "_answer", "_is_open", "main"} == {
        f"_{name}" for name in zoo.ANIMALS
    }


def test_without_an_animal_it_answers_every_observation() -> None:
    said = [json.loads(line) for line in asked("", {"tick": 0}, {"tick": 1})]
    assert said[0] == {"hello": "adeye/channel@1"}
    assert [item["tick"] for item in said[1:]] == [0, 1]


@pytest.mark.parametrize("name", ["raises", "leaves", "says_half_a_line"])
def test_animal_behaves_until_its_tick(name: str) -> None:
    said = asked(name, {"tick": 0}, {"tick": 1})
    assert json.loads(said[1])["tick"] == 0
    assert not any("acceleration" in line for line in said[2:])
