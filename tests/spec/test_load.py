"""Loading: files are found, extended and merged; an error is placed in the file that holds it."""

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from adeye.errors import InputErrors, SpecError
from adeye.spec.document import load_document
from adeye.spec.load import (
    load_architecture,
    load_odd,
    load_scenario,
    merge,
    odd_asked_about,
    scenario_files,
    shipped,
)
from adeye.spec.sensors import Camera
from tests.project import CONCEPT, Project
from tests.refusals import refused
from tests.stored import known, stored

TABLES = stored("definitions")


ROOT = Path(__file__).parents[2]
BASE = """\
scenario: base
title: A base
provenance: {source: a test}
parameters:
  gap: {default: 40 m, range: [20 m, 60 m]}
world:
  road: {length: 900 m, lanes: 2, lane_width: 3.5 m, shoulder: 2 m, speed_limit: 20 m/s}
environment: {rain: 0 mm/h, fog_visibility: 1 km, friction: 0.9}
ego: {lane: 0, s: 50 m, speed: 20 m/s}
actors:
  lead: {kind: car, start: {lane: 0, ahead_of: ego, gap: gap, speed: 10 m/s}}
horizon: 5 s
"""


@pytest.fixture
def write(tmp_path: Path) -> Any:
    """Return a function that writes a scenario file beside the base."""
    (tmp_path / "base.yaml").write_text(BASE, encoding="utf-8")

    def make(name: str, text: str) -> Path:
        path = tmp_path / f"{name}.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return make


# --- merge ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("base", "override", "merged"), TABLES["merge lays one content over another"]
)
def test_merge_lays_one_content_over_another(base: Any, override: Any, merged: Any) -> None:
    assert merge(base, override) == merged


CONTENT = st.recursive(
    st.integers() | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.sampled_from("abc"), inner),
    max_leaves=8,
)
MAPPING = st.dictionaries(st.sampled_from("abc"), CONTENT)


@given(base=MAPPING, override=MAPPING)
def test_merging_twice_is_merging_once_and_leaves_both_as_they_were(
    base: Any, override: Any
) -> None:
    before = repr((base, override))
    once = merge(base, override)
    assert merge(once, override) == once
    assert merge(base, {}) == merge(base, base) == base
    assert repr((base, override)) == before


# --- extends --------------------------------------------------------------------------------------


def test_extended_scenario_has_both_contents(write: Any) -> None:
    text = "extends: base\nscenario: near\nparameters: {gap: {default: 25 m}}\n"
    loaded = load_scenario(write("near", text))
    assert (loaded.spec.scenario, loaded.spec.title) == ("near", "A base")
    gap = loaded.spec.parameters["gap"]
    assert (gap.default, gap.range) == ("25 m", ("20 m", "60 m"))
    assert "extends" not in loaded.content


def test_chain_of_extends_lets_the_nearest_win(write: Any) -> None:
    write("near", "extends: base.yaml\nscenario: near\nhorizon: 6 s\ntail: 1 s\n")
    loaded = load_scenario(write("nearer", "extends: near\nscenario: nearer\nhorizon: 7 s\n"))
    assert (loaded.spec.horizon, loaded.spec.tail) == (7.0, 1.0)
    assert [Path(document.path).stem for document in loaded.documents] == ["nearer", "near", "base"]


def test_null_removes_what_the_base_has(write: Any) -> None:
    loaded = load_scenario(write("empty", "extends: base\nscenario: empty\nactors: {lead: null}\n"))
    assert loaded.spec.actors == {}


def test_extends_is_found_beside_the_file_that_names_it(write: Any, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    path = write("sub/near", "extends: ../base.yaml\nscenario: near\n")
    assert load_scenario(path).spec.title == "A base"
    with pytest.raises(SpecError, match=r"sub/lost.yaml:1:10: 'base.yaml' is not a file"):
        load_scenario(write("sub/lost", "extends: base\nscenario: lost\n"))


def test_every_file_of_a_chain_names_what_is_beside_itself(write: Any, tmp_path: Path) -> None:
    for folder in ("near", "far"):
        (tmp_path / folder).mkdir()
    write("far/base", (tmp_path / "base.yaml").read_text())
    write("far/middle", "extends: base\nscenario: middle\n")
    path = write("near/last", "extends: ../far/middle.yaml\nscenario: last\n")
    assert load_scenario(path).spec.title == "A base"


@pytest.mark.parametrize("kind", ["concept", "architectures", "plugins"])
def test_name_that_is_inherited_from_another_folder_means_no_other_file(
    tmp_path: Path, kind: str
) -> None:
    shutil.copytree(ROOT / "odd", tmp_path / "odd")
    (tmp_path / "odd" / "fast.py").write_text("class Fast: ...")
    heir = tmp_path / "later" / "heir.yaml"
    shutil.copytree(tmp_path / "odd", heir.parent)
    taken = {
        "concept": "concepts/motorway_chauffeur.yaml",
        "architectures": ["architectures/camera_radar.yaml"],
        "plugins": ["./fast.py:Fast"],
    }
    base = yaml.safe_load((tmp_path / "odd" / "motorway_chauffeur.yaml").read_text())
    (tmp_path / "odd" / "base.yaml").write_text(yaml.safe_dump({**base, **taken, "gate": None}))
    own = {name: value for name, value in taken.items() if name != kind}
    heir.write_text(yaml.safe_dump({"extends": "../odd/base.yaml", "odd": "heir", **own}))
    caught = refused(SpecError, load_odd, heir, says="is inherited from another folder")
    assert str(caught.where).startswith(str(heir.parent / "../odd/base.yaml"))
    remedy = f"Copy fast.py into {heir.parent}." if kind == "plugins" else "Name '../odd/"
    assert remedy in caught.remedy
    heir.write_text(yaml.safe_dump({"extends": "../odd/base.yaml", "odd": "heir", **taken}))
    assert load_odd(heir).odd.spec.odd == "heir"


def test_link_to_an_odd_means_no_other_files_than_it_leads_to(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "odd", tmp_path / "odd")
    link = tmp_path / "linked" / "odd.yaml"
    shutil.copytree(tmp_path / "odd", link.parent)
    link.symlink_to("../odd/motorway_chauffeur.yaml")
    caught = refused(SpecError, load_odd, link, says="is inherited from another folder")
    assert "Name '../odd/" in str(caught)
    beside = tmp_path / "odd" / "link.yaml"
    beside.symlink_to("motorway_chauffeur.yaml")
    assert load_odd(beside).odd.spec.odd == "motorway_chauffeur"


def test_link_extends_no_other_file_than_it_leads_to(tmp_path: Path) -> None:
    for folder in ("theirs", "ours"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "base.yaml").write_text(BASE)
    link = tmp_path / "ours" / "heir.yaml"
    (tmp_path / "theirs" / "heir.yaml").write_text("extends: base\nscenario: heir\n")
    link.symlink_to("../theirs/heir.yaml")
    caught = refused(SpecError, load_scenario, link, says="leads to another folder")
    assert "Use '../theirs/heir.yaml' by its own path" in str(caught)


def test_scenario_extends_one_of_the_package_that_is_not_beside_it(write: Any) -> None:
    loaded = load_scenario(write("mine", "extends: motorway_bay\nscenario: mine\ntitle: Mine\n"))
    assert loaded.spec.title == "Mine"
    assert [document.path for document in loaded.documents][-1].endswith("free_driving.yaml")


def test_scenario_beside_it_goes_before_one_of_the_package(write: Any) -> None:
    write("cut_in", "extends: base\nscenario: cut_in\n")
    assert load_scenario(write("mine", "extends: cut_in\nscenario: mine\n")).spec.title == "A base"


@pytest.mark.parametrize(
    ("first", "second", "chain"),
    [("b", "a", "a → b → a"), ("a", "a", "a → a"), ("b", "b", "a → b → b")],
)
def test_cyclic_extends_is_refused(write: Any, first: str, second: str, chain: str) -> None:
    path = write("a", f"extends: {first}\n")
    write("b" if first == "b" else "c", f"extends: {second}\n")
    refused(SpecError, load_scenario, path, says=f"extends is cyclic: {chain}")


def test_error_is_placed_in_the_file_that_holds_it(write: Any, tmp_path: Path) -> None:
    near = write("near", "extends: base\nscenario: near\nego: {speed: 20 s}\n")
    refused(SpecError, load_scenario, near, says=r"near.yaml:3:14: ego.speed: '20 s' is a time")
    base = tmp_path / "base.yaml"
    base.write_text(BASE.replace("s: 50 m", "s: 50 s"), encoding="utf-8")
    near.write_text("extends: base\nscenario: near\nego: {speed: 20 m/s}\n", encoding="utf-8")
    refused(SpecError, load_scenario, near, says=r"base.yaml:9:19: ego.s: '50 s' is a time")


@pytest.fixture
def suites(tmp_path: Path) -> Path:
    """Copy the shipped architectures."""
    shutil.copytree(ROOT / "odd" / "architectures", tmp_path / "architectures")
    return tmp_path / "architectures"


def test_inherited_key_of_another_fidelity_says_how_to_remove_it(suites: Path) -> None:
    path = suites / "cheap.yaml"
    camera = "fidelity: object, range: 80 m"
    text = "extends: study_camera\narchitecture: cheap\nsensors: {{front_camera: {{{}}}}}\n"
    path.write_text(text.format(camera), encoding="utf-8")
    caught = refused(InputErrors, load_architecture, path)
    unknown = [error for error in caught.errors if "there is no key" in error.message]
    keys = [error.message.split(":")[0].rpartition(".")[2] for error in unknown]
    assert {"columns", "rows", "min_pixel_height"} <= set(keys)
    for key, error in zip(keys, unknown, strict=True):
        assert known(error.where).path.endswith("study_camera.yaml")
        assert f"`{key}: null` at this place in {path} removes it." in error.remedy
    # What the message says is so.
    removed = "".join(f", {key}: null" for key in keys)
    path.write_text(text.format(camera + removed), encoding="utf-8")
    assert isinstance(load_architecture(path).spec.sensors["front_camera"], Camera)


def test_unknown_key_that_is_not_inherited_is_to_be_corrected_where_it_is(write: Any) -> None:
    near = write("near", "extends: base\nscenario: near\nego: {sped: 20 m/s}\n")
    with pytest.raises(SpecError, match=r"near.yaml:3:7: ego.sped: there is no key") as caught:
        load_scenario(near)
    assert "null" not in str(caught.value)


def test_places_of_the_loaded_content_are_in_the_nearest_file(write: Any) -> None:
    loaded = load_scenario(write("near", "extends: base\nscenario: near\nego: {lane: 1}\n"))
    assert str(loaded.locate(("ego", "lane"))).endswith("near.yaml:3:13")
    assert str(loaded.locate(("ego", "s"))).endswith("base.yaml:9:19")
    assert str(loaded.locate(("actors", "lead", "kind"))).endswith("base.yaml:11:16")


def test_base_may_be_incomplete(write: Any) -> None:
    write("part", "horizon: 9 s\ntail: 3 s\n")
    whole = BASE.replace("scenario: base\n", "extends: part\nscenario: whole\n")
    assert load_scenario(write("whole", whole)).spec.tail == 3.0


# --- ODDs -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted((ROOT / "odd").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_odd_loads_with_everything_it_names(path: Path) -> None:
    files = load_odd(path)
    assert files.odd.spec.odd == path.stem
    assert [use.name for use in files.odd.spec.scenarios] == list(files.scenarios)
    assert len(files.architectures) == len(files.odd.spec.architectures)
    assert set(files.gate) <= set(files.architectures)
    assert files.concept.spec.requirements


def test_without_a_gate_every_architecture_decides(tmp_path: Path) -> None:
    text = (ROOT / "odd" / "motorway_chauffeur.yaml").read_text("utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("gate:")]
    for folder in ("architectures", "concepts"):
        (tmp_path / folder).symlink_to(ROOT / "odd" / folder)
    path = tmp_path / "odd.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    files = load_odd(path)
    assert files.gate == tuple(files.architectures) == ("legacy_camera", "camera_radar")


@pytest.mark.parametrize(
    ("used", "alias", "is_told"),
    [
        ("cut_in", "lead_braking", True),
        ("cut_in", "cut_in_traffic", True),
        ("cut_in_traffic", "cut_in", False),
        ("cut_in", "cut_in", False),
        ("cut_in", "another", False),
    ],
)
def test_id_of_another_scenario_is_taken_only_by_what_extends_it(
    tmp_path: Path, used: str, alias: str, *, is_told: bool
) -> None:
    for folder in ("architectures", "concepts"):
        (tmp_path / folder).symlink_to(ROOT / "odd" / folder)
    content = load_document(ROOT / "odd" / "motorway_chauffeur.yaml").value
    content["scenarios"] = [{"use": used, "as": alias}]
    path = tmp_path / "odd.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    if is_told:
        refused(SpecError, load_odd, path, says=f"{alias!r} is another scenario")
    else:
        assert list(load_odd(path).scenarios) == [alias]


def test_catalogue_is_beside_the_odds_folder_else_the_shipped_one(tmp_path: Path) -> None:
    files = load_odd(ROOT / "odd" / "motorway_chauffeur.yaml")
    assert files.scenarios["cut_in"].path.is_relative_to(ROOT / "scenarios_db")
    assert set(scenario_files(shipped("scenarios_db"))) >= {"cut_in", "pedestrian_crossing"}
    assert scenario_files(tmp_path) == {}


def test_scenario_in_two_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    for folder in (tmp_path, tmp_path / "old"):
        (folder / "follow.yaml").write_text("scenario: follow\n", encoding="utf-8")
    refused(SpecError, scenario_files, tmp_path, says="'follow' is in another file, too")


def test_architecture_is_loaded_by_its_path() -> None:
    path = ROOT / "odd" / "architectures" / "camera_radar.yaml"
    loaded = load_architecture(path)
    assert loaded.path == path
    assert loaded.spec.architecture == "camera_radar"
    place = loaded.locate(("sensors", "front_radar", "range"))
    assert path.read_text("utf-8").splitlines()[place.line - 1].strip().startswith("range:")


@pytest.fixture
def of_several_concepts(tmp_path: Path) -> Path:
    """Write an ODD with a concept that speaks of the nominal channel only."""
    project = Project(tmp_path)
    project.require("FSR-01")
    nominal = {"id": "nominal_channel", "kind": "planner", "text": "drives"}
    with project.edited(CONCEPT) as concept:
        concept |= {"elements": [{**nominal, "asil_capability": "D"}], "decompositions": []}
        concept["requirements"][0]["allocation"] = ["nominal_channel"]
    return project.odd


def test_architecture_may_realise_what_another_concept_has(of_several_concepts: Path) -> None:
    assert load_odd(of_several_concepts).concept.spec.elements[0].id == "nominal_channel"


def test_architecture_may_realise_what_a_concept_beside_has(of_several_concepts: Path) -> None:
    folder = of_several_concepts.parent
    architecture = folder / "architectures" / "camera_radar.yaml"
    text = architecture.read_text("utf-8").replace("realises: switch", "realises: arbiter_of_ours")
    architecture.write_text(text, "utf-8")
    (folder / "concepts" / "broken.yaml").write_text("concept: [", "utf-8")
    with pytest.raises(SpecError, match=r"switch realises 'arbiter_of_ours', .* nor of another"):
        load_odd(of_several_concepts)
    concept = (folder / "concepts" / "motorway_chauffeur.yaml").read_text("utf-8")
    other = concept.replace("id: nominal_channel", "id: arbiter_of_ours")
    other = other.replace("- nominal_channel", "- arbiter_of_ours")
    (folder / "concepts" / "other.yaml").write_text(other, "utf-8")
    assert "camera_radar" in load_odd(of_several_concepts).architectures


def test_odd_of_a_campaign_is_not_that_of_a_copy_beside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for copy in ("one", "two"):
        (tmp_path / copy / "odd").mkdir(parents=True)
        (tmp_path / copy / "odd" / "d.yaml").write_text("odd: d\n")
    planned = tmp_path / "one" / "odd" / "d.yaml"
    told = {"odd_path": "odd/d.yaml", "odd_place": str(planned)}
    for folder in (tmp_path / "one", tmp_path):
        monkeypatch.chdir(folder)
        assert odd_asked_about(told).samefile(planned)
    for folder, here in ((tmp_path / "two", "odd/d.yaml"), (tmp_path / "two" / "odd", "d.yaml")):
        monkeypatch.chdir(folder)
        refused(SpecError, odd_asked_about, told, says=f"here is another, {here}")
    # However the file was named: by its absolute path, or from its folder.
    (tmp_path / "two" / "odd" / "maps").mkdir()
    for path in (str(planned), "d.yaml"):
        for place in ("", "odd", "odd/maps"):
            monkeypatch.chdir(tmp_path / "two" / place)
            named = told | {"odd_path": path}
            refused(SpecError, odd_asked_about, named, says="here is another")
        monkeypatch.chdir(tmp_path / "one" / "odd")
        assert odd_asked_about(named).samefile(planned)
    # By whatever path: somebody else worked on it from another copy.
    for path in ("odd/d.yaml", str(tmp_path / "two" / "odd" / "d.yaml")):
        later = {"odd_path": path, "odd_place": str(tmp_path / "two" / "odd" / "d.yaml")}
        monkeypatch.chdir(tmp_path)
        refused(SpecError, odd_asked_about, told, later=[told, later], says="worked on from")
    # What is nearest is meant, not what stands above the project.
    monkeypatch.chdir(tmp_path / "one")
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "d.yaml").write_text("odd: d\n")
    assert odd_asked_about(told).samefile(planned)
    monkeypatch.chdir(tmp_path / "two")
    planned.unlink()
    assert odd_asked_about(told).samefile("odd/d.yaml")
