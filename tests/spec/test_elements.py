"""Elements: what they depend on, and what is consumed and provided by nobody."""

from __future__ import annotations

from typing import Any

from adeye.spec.concept import Element, causes, unprovided


def element(name: str, **more: Any) -> Element:
    return Element(id=name, kind="sensor", text="text", asil_capability="B", **more)


def test_relations_are_listed_once_with_their_kind() -> None:
    made = element(
        "camera",
        supplier="one",
        resources=("power", "power"),
        software=("tracker",),
        provides=("objects",),
        consumes=("map",),
    )
    assert made.relations == (
        ("supplier", "one"),
        ("resource", "power"),
        ("software", "tracker"),
        ("provides", "objects"),
        ("consumes", "map"),
    )
    assert causes([made, element("radar")]) == ("camera", "one", "power", "tracker", "radar")


def test_what_nobody_provides_is_named_with_what_is_provided() -> None:
    assert list(unprovided([element("a", consumes=("map",))])) == [
        (("elements", 0, "consumes", 0), "nobody provides 'map'. Nothing is")
    ]
    found = list(unprovided([element("a", provides=("x",)), element("b", consumes=("x", "y"))]))
    assert found == [(("elements", 1, "consumes", 1), "nobody provides 'y'. Provided are x")]


def test_keys_that_came_later_are_no_part_of_an_element_without_them() -> None:
    assert set(element("a", resources=("p",)).model_dump()) == {
        "id", "kind", "text", "asil_capability", "legacy", "resources"
    }  # fmt: skip
    assert element("a", supplier="one").model_dump()["supplier"] == "one"
