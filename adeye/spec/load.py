"""Load an ODD with everything it names: scenarios, architectures and the concept."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from adeye.errors import InputError, SourceLocation, SpecError, Together, placed, raise_all, suggest
from adeye.fields import texts_in
from adeye.identity import file_digest
from adeye.plugins import locate_file
from adeye.spec.architecture import Architecture
from adeye.spec.channels import ReferenceName, read_name, reference_content
from adeye.spec.concept import Concept, asil_problems
from adeye.spec.document import Document, Loc, has_part, load_document, validate
from adeye.spec.grid import GridSettings
from adeye.spec.odd import Odd
from adeye.spec.places import SOME_ROAD, PlaceRoad, first_place, is_on_map, map_files, map_notes
from adeye.spec.plausible import FileRecord, implausible
from adeye.spec.quantity import Record
from adeye.spec.scenario import LogicalScenario
from adeye.units import shown

# --- Load an ODD with everything it names: scenarios, architectures and the concept ---------------

Spec = TypeVar("Spec", bound=Record)

INPUTS: Final = "inputs"
"""Key of a campaign's provenance: what ``OddFiles.inputs`` gives."""
MAPS: Final = "maps"
"""Key of it: what ``OddFiles.map_notes`` gives."""
SCENARIOS: Final = "scenarios_db"
"""Folder of scenarios, of a project and of the package."""


@dataclass(frozen=True)
class Loaded(Generic[Spec]):
    """A validated file: the record, the text it came from and the way back to its lines.

    Attributes:
        spec: The validated record.
        content: What the user wrote, inheritance resolved; validates to ``spec`` again.
        path: The file.
        documents: The file and those that it extends, nearest first.
    """

    spec: Spec
    content: dict[str, Any]
    path: Path
    documents: tuple[Document, ...]

    def locate(self, loc: Loc) -> SourceLocation:
        """Find the file, line and column of a place in the content."""
        return _deepest(self.documents, loc).locate(loc)


@dataclass(frozen=True)
class OddFiles:
    """An ODD and everything that it names.

    Attributes:
        odd: The ODD file.
        scenarios: By the id under which the ODD uses them.
        architectures: By their own id, in the ODD's order.
        concept: The functional safety concept.
    """

    odd: Loaded[Odd]
    scenarios: dict[str, Loaded[LogicalScenario]]
    architectures: dict[str, Loaded[Architecture]]
    concept: Loaded[Concept]

    @property
    def gate(self) -> tuple[str, ...]:
        """Architectures whose verdicts decide: those of ``gate``, else all."""
        gate = self.odd.spec.gate
        return tuple(dict.fromkeys(gate.architectures)) if gate else tuple(self.architectures)

    def named_files(self) -> Iterator[Path]:
        """Give the files beside them that a text in them names: plug-ins, programs, data."""
        everything: tuple[Loaded[Any], ...]
        everything = (self.odd, self.concept, *self.architectures.values())
        for loaded in everything:
            for _, text in texts_in(loaded.content):
                for name in _meant(text):
                    if _is(Path.is_file, loaded.path.parent / name):
                        yield loaded.path.parent / name
        for scenario in self.scenarios.values():
            yield from map_files(scenario.spec, scenario.locate)
            for driver in scenario.spec.drivers.values():
                yield locate_file(driver.file, scenario.path.parent)

    def edited(self) -> tuple[str, ...]:
        """List the YAML files that are no longer what was read, or are gone."""
        found = {item.path: item.digest for item in self._documents() if item.digest}
        return tuple(path for path, digest in found.items() if _digest_now(path) != digest)

    def _documents(self) -> Iterator[Document]:
        loaded: tuple[Loaded[Any], ...]
        loaded = (self.odd, self.concept, *self.scenarios.values(), *self.architectures.values())
        return (document for item in loaded for document in item.documents)

    def map_notes(self) -> dict[str, dict[str, int]]:
        """Count by map what was made of it, see ``places.map_notes``."""
        notes: dict[str, dict[str, int]] = {}
        for item in self.scenarios.values():
            notes |= map_notes(item.spec, item.locate)
        return notes

    def inputs(self, more: Iterable[Path] = ()) -> dict[str, str]:
        """Hash the project's files that it was read from, and those that these name.

        Args:
            more: Others that it depends on, such as the code of plug-ins.

        Returns:
            sha256 by the place relative to the folder that the ODD's folder lies in; of what lies
            elsewhere, by itself.
        """
        project = self.odd.path.resolve().parent.parent
        read = (Path(document.path) for document in self._documents())
        paths = {path.resolve() for path in (*read, *self.named_files(), *more)}
        found: dict[str, str] = {}
        for path in sorted(paths):
            if path.is_file():
                digest = file_digest(path)
                is_own = path.is_relative_to(project)
                found[path.relative_to(project).as_posix() if is_own else digest] = digest
        return found


def _digest_now(path: str) -> str:
    """Hash a file as it is now; nothing where it cannot be read."""
    try:
        return file_digest(Path(path))
    except OSError:
        return ""


def load_odd(
    path: str | Path, also: Callable[[Loaded[LogicalScenario]], None] | None = None
) -> OddFiles:
    """Load and validate an ODD, its scenarios, architectures and concept.

    Each file is read whatever is wrong with the others, as far as its name can be told.

    Args:
        path: The ODD's file.
        also: What else each scenario has to pass that can be read.

    Raises:
        InputError: The only thing that is wrong; the message has file, line and column.
        InputErrors: All that is wrong, the ODD's first.
    """
    odd_path, together = Path(path), Together()
    written = _written(odd_path, Odd)
    odd: Loaded[Odd] | None = None
    with together:
        odd = _record(odd_path, written, Odd)
    scenarios = _scenarios(odd_path, written, together, also)
    architectures = _architectures(odd_path, written, together, odd)
    concept: Loaded[Concept] | None = None
    with together:
        concept = _concept(odd_path, written)
    if concept is not None:
        with together:
            _check_asil(concept)
        with together:
            _check_realised(concept, architectures)
    together.finish()
    # Without either there is an error.
    assert odd is not None
    assert concept is not None
    loaded_odd = OddFiles(odd, scenarios, architectures, concept)
    for number, name in enumerate(loaded_odd.gate):
        with together:
            if name not in architectures:
                raise SpecError(
                    f"gate names {name!r}, not one of the ODD's architectures",
                    where=odd.locate(("gate", "architectures", number)),
                    remedy=suggest(name, sorted(architectures)),
                )
    together.finish()
    return loaded_odd


def _items(written: _Merged, key: str) -> Iterator[tuple[int, Any]]:
    """Give the members of a list of an ODD that need not be valid, with their numbers."""
    found = written.value.get(key) if isinstance(written.value, dict) else None
    return iter(enumerate(found if isinstance(found, list) else ()))


def _scenarios(
    path: Path,
    written: _Merged,
    together: Together,
    also: Callable[[Loaded[LogicalScenario]], None] | None,
) -> dict[str, Loaded[LogicalScenario]]:
    """Load the scenarios that an ODD uses, by the ids under which it does."""
    found: dict[str, Loaded[LogicalScenario]] = {}
    catalogue: dict[str, Path] | None = None
    with together:
        catalogue = _catalogue(path, written)
    for number, use in _items(written, "scenarios") if catalogue is not None else ():
        name = use.get("use") if isinstance(use, dict) else None
        if not isinstance(name, str):
            continue
        with together:
            scenario = _used(name, catalogue or {}, written, number)
            alias = use.get("as")
            _check_alias(alias, scenario, catalogue or {}, written.locate(("scenarios", number)))
            found[alias if isinstance(alias, str) else name] = scenario
            if also is not None:
                also(scenario)
    return found


def _check_alias(
    alias: Any,
    scenario: Loaded[LogicalScenario],
    catalogue: Mapping[str, Path],
    where: SourceLocation,
) -> None:
    """Refuse the id of another scenario: what is demanded in that one would be judged in this.

    A scenario may stand for one that it extends.
    """
    name = scenario.spec.scenario
    if alias not in catalogue or alias == name:
        return
    own = catalogue[alias].resolve()
    if own not in {Path(document.path).resolve() for document in scenario.documents}:
        raise SpecError(
            f"as: {alias!r} is another scenario, which {name!r} does not extend",
            where=where,
            remedy="Choose an id that no scenario of the catalogue has.",
        )


def _used(
    name: str, catalogue: Mapping[str, Path], written: _Merged, number: int
) -> Loaded[LogicalScenario]:
    """Load a scenario that an ODD uses."""
    if name not in catalogue:
        raise SpecError(
            f"there is no scenario {name!r} in {written.value.get('catalogue') or SCENARIOS}",
            where=written.locate(("scenarios", number, "use")),
            remedy=suggest(name, sorted(catalogue)),
        )
    scenario = load_scenario(catalogue[name])
    if scenario.spec.scenario != name:
        raise SpecError(
            f"the scenario is named {scenario.spec.scenario!r}, its file {name!r}",
            where=scenario.locate(("scenario",)),
            remedy=f"Write `scenario: {name}`, or rename the file.",
        )
    return scenario


def _architectures(
    path: Path, written: _Merged, together: Together, odd: Loaded[Odd] | None
) -> dict[str, Loaded[Architecture]]:
    """Load the architectures of an ODD: files beside it, and reference drivers by their names."""
    made: list[tuple[Loaded[Architecture] | ReferenceName, SourceLocation]] = []
    for number, name in _items(written, "architectures"):
        where = written.locate(("architectures", number))
        if isinstance(name, str):
            with together:
                item = read_name(name, where) or _load(_beside(path, name, where), Architecture)
                made.append((item, where))
    usual = shipped("odd") / "architectures" / "reference_cc.yaml"
    first = next((item for item, _ in made if isinstance(item, Loaded)), None)
    vehicle = (first.content if first else load_document(usual).value)["vehicle"]
    found: dict[str, Loaded[Architecture]] = {}
    for item, where in made:
        if isinstance(item, Loaded):
            loaded = item
        elif odd is not None:
            # An FMU that moves the vehicle lies where it is named.
            place = first.path if first and vehicle.get("plant") else odd.path
            loaded = _reference(item, vehicle, odd, (where, place))
        else:
            # It decides at the step of the ODD, which cannot be told.
            continue
        with together:
            if loaded.spec.architecture in found:
                raise SpecError(
                    f"architecture {loaded.spec.architecture!r} is listed twice",
                    where=where,
                    remedy="Give each architecture file an id of its own.",
                )
            found[loaded.spec.architecture] = loaded
    return found


def _concept(path: Path, written: _Merged) -> Loaded[Concept] | None:
    """Load the concept that an ODD names; None if it names none, which is an error of the ODD."""
    name = written.value.get("concept") if isinstance(written.value, dict) else None
    if not isinstance(name, str):
        return None
    return _load(_beside(path, name, written.locate(("concept",))), Concept)


def _reference(
    name: ReferenceName,
    vehicle: Mapping[str, Any],
    odd: Loaded[Odd],
    at: tuple[SourceLocation, Path],
) -> Loaded[Architecture]:
    """Make the architecture of a reference driver, as if it were written where it is named.

    Args:
        name: Of the driver.
        vehicle: That it drives.
        odd: That names it.
        at: Where, and the file that files of the vehicle are named in.
    """
    where, path = at
    content = reference_content(name, vehicle, f"{1.0 / odd.spec.step!r} Hz", "0 s")
    document = Document(where.path, content, {(): where}, {})
    return Loaded(validate(document, Architecture), content, path, (document,))


def load_scenario(path: str | Path) -> Loaded[LogicalScenario]:
    """Load one scenario file with what it extends; its formulas are not yet checked.

    What it extends by an id is the file of that name beside it, else the scenario of the package.
    One on a map gets the road of the first of its places.
    """
    loaded = _with_drivers(_load(Path(path), LogicalScenario))
    if loaded.spec.world.map is None:
        return loaded
    if {"map", "road"} <= loaded.documents[0].value.get("world", {}).keys():
        raise SpecError(
            "world: a road and a map are both given",
            where=loaded.locate(("world", "map")),
            remedy="Keep one of them.",
        )
    return at_place(loaded, first_place(loaded.spec, loaded.locate))


def _with_drivers(loaded: Loaded[LogicalScenario]) -> Loaded[LogicalScenario]:
    """Return a scenario that says which FMUs drive its actors, not only what they are called."""
    actors = {}
    for name, driver in loaded.spec.drivers.items():
        where = loaded.locate(("actors", name, "driver", "file"))
        with placed(where, f"actors.{name}.driver: "):
            found = file_digest(locate_file(driver.file, loaded.path.parent))
        if driver.digest not in {"", found}:
            raise SpecError(
                f"actors.{name}.driver.digest: {shown(driver.file)} has sha256 {found}",
                where=loaded.locate(("actors", name, "driver", "digest")),
                remedy="Bring the file back, or leave the key out: adeye fills it in.",
            )
        actors[name] = {"driver": {"digest": found}}
    if not actors:
        return loaded
    content = merge(loaded.content, {"actors": actors})
    spec = validate(_Merged(content, loaded.documents), LogicalScenario)
    return replace(loaded, spec=spec, content=content)


def at_place(loaded: Loaded[LogicalScenario], place: PlaceRoad) -> Loaded[LogicalScenario]:
    """Return a scenario on a map as it is at one of its places."""
    content = {**loaded.content, "world": {**loaded.content["world"], "road": place.content}}
    spec = validate(_Merged(content, loaded.documents), LogicalScenario)
    return replace(loaded, spec=spec, content=content)


def load_architecture(path: str | Path) -> Loaded[Architecture]:
    """Load one architecture file."""
    return _load(Path(path), Architecture)


def load_grid(path: str | Path) -> Loaded[GridSettings]:
    """Load and validate the settings of a grid map.

    Args:
        path: The file.

    Raises:
        SpecError: Anything is wrong; the message has file, line and column.
    """
    return _load(Path(path), GridSettings)


def odd_of(
    provenance: Mapping[str, Any],
    near: Path | None = None,
    later: Sequence[Mapping[str, Any]] = (),
) -> Path:
    """Find the file of the ODD that a campaign was planned from, see ``find_odd``.

    Args:
        provenance: Of the campaign; the path is empty if it does not tell.
        near: Folder of the database.
        later: Provenances of those that worked on it, of which the last one counts whose file is
            there, if the first is gone.
    """
    path, place = (str(provenance.get(name, "")) for name in ("odd_path", "odd_place"))
    found = find_odd(path, near, place) if path else Path()
    if found.is_file():
        return found
    others = (odd_of(item, near) for item in reversed(later))
    return next((other for other in others if other.is_file()), found)


def odd_asked_about(
    provenance: Mapping[str, Any],
    near: Path | None = None,
    later: Iterable[Mapping[str, Any]] = (),
) -> Path:
    """Find the file of the ODD that somebody means who names a campaign only, see ``odd_of``.

    Args:
        provenance: Of the campaign.
        near: Folder of the database.
        later: Provenances of those that worked on it, also from other places.

    Raises:
        SpecError: It was worked on from another file, or where they stand, or above, is another
            one of that name, as in a copy of the project.
    """
    found, now = odd_of(provenance, near), Path.cwd()
    for other in (odd_of(item, near) for item in later):
        if all(_is(Path.is_file, path) for path in (found, other)) and not found.samefile(other):
            raise SpecError(
                f"the campaign was planned from {found}, and worked on from {other}",
                remedy="Name the file of the ODD that you mean.",
            )
    here = _likely(Path(str(provenance.get("odd_place", "")) or found), now)
    if here is not None and _is(Path.is_file, found) and not here.samefile(found):
        raise SpecError(
            f"the campaign was planned from {found}, and here is another, {os.path.relpath(here)}",
            remedy="Name the file of the ODD that you mean.",
        )
    return found


def _likely(place: Path, now: Path) -> Path | None:
    """Find the file that somebody who stands in a folder takes for one at another place.

    It lies in the folder or above as that does in its own, however it was named. What only has its
    name is in the folder itself: above it anything might have.
    """
    ends = [Path(*place.parts[start:]) for start in range(1, len(place.parts))]
    tried = (
        folder / end
        for folder in (now, *now.parents)
        for end in ends
        if folder == now or len(end.parts) > 1
    )
    return next((path for path in tried if _is(Path.is_file, path)), None)


def find_odd(path: str, near: Path | None = None, place: str = "") -> Path:
    """Find the file of an ODD that was named from a folder that nobody remembers.

    Whoever asks may stand in another project that has such a file, too.

    Args:
        path: As it was named.
        near: Folder of the database, which often lies beside it.
        place: Where it was on the machine that named it; another one may not have it.

    Returns:
        The place, if a file is there; else where the path leads to one from the folder of the
        database or one above; else the path as it is, if it does from here; else where it lies
        from the database or from here as it did there, as in a project that was moved; else where
        it would from the root of the repository.
    """
    asked, here = Path(path), (near or Path()).resolve()
    above = () if near is None else (here, *here.parents)
    tried = (Path(place), *(folder / asked for folder in above), asked)
    known = next((item for item in tried if item.is_file()), None)
    if known is None:
        lay = Path(place or path)
        known = _likely(lay, here) or _likely(lay, Path.cwd())
    if known is None:
        root = repository_of(here)
        known = asked if root is None else root / asked
    is_here = known is asked or known.resolve() == asked.resolve()
    return asked if is_here else Path(os.path.relpath(known))


def repository_of(folder: Path) -> Path | None:
    """Return the root of the repository that a folder is in; None outside of one."""
    return next((item for item in (folder, *folder.parents) if (item / ".git").exists()), None)


def shipped(folder: str) -> Path:
    """Return a folder of the content that comes with the package.

    Args:
        folder: ``scenarios_db`` or ``odd``.
    """
    packaged = Path(str(files("adeye"))) / "_catalogue" / folder
    if packaged.is_dir():
        return packaged
    return Path(str(files("adeye"))).parent / folder


def says_odd(path: Path) -> bool:
    """Whether a file says which ODD it is, itself or in what it extends.

    Raises:
        InputError: It cannot be read.
    """
    content = _written(path, Odd).value
    return isinstance(content, dict) and "odd" in content


def _load(path: Path, model: type[Spec]) -> Loaded[Spec]:
    return _record(path, _written(path, model), model)


def _written(path: Path, model: type[Record]) -> _Merged:
    """Read what a file says together with those that it extends; it need not be valid."""
    documents = _with_bases(path, is_scenario=model is LogicalScenario)
    content = documents[-1].value
    for document in reversed(documents[:-1]):
        content = merge(content, document.value)
    if model is LogicalScenario and is_on_map(content):
        content = {**content, "world": {**content["world"], "road": SOME_ROAD}}
    return _Merged(content, documents)


def _record(path: Path, written: _Merged, model: type[Spec]) -> Loaded[Spec]:
    """Validate what a file says."""
    _require_same_files(path, written)
    loaded = Loaded(validate(written, model), written.value, path, written.documents)
    if isinstance(loaded.spec, FileRecord) and model is not LogicalScenario:
        _check_plausible(loaded, loaded.spec)
    return loaded


def _check_plausible(loaded: Loaded[Any], spec: FileRecord) -> None:
    """Refuse nonsense; the formulas of a scenario are looked at where they are checked."""
    found = [
        SpecError(text, where=loaded.locate(loc), remedy=remedy)
        for loc, text, remedy in implausible(spec, spec.beyond_plausible, spec.own_limits())
    ]
    raise_all(found)


@dataclass(frozen=True)
class _Merged:
    """A document put together from a file and those that it extends."""

    value: Any
    documents: tuple[Document, ...]

    def locate(self, loc: Loc) -> SourceLocation:
        return _deepest(self.documents, loc).locate(loc)

    def locate_key(self, loc: Loc) -> SourceLocation:
        return _deepest(self.documents, loc).locate_key(loc)

    def heir(self, loc: Loc) -> str:
        is_own = _deepest(self.documents, loc) is self.documents[0]
        return "" if is_own else self.documents[0].path


def _require_same_files(path: Path, merged: _Merged) -> None:
    """Refuse a name of a file that means another one beside who inherits it than beside its writer.

    A link inherits from what it leads to.

    Raises:
        SpecError: One does; names are relative to the file that inherits them.
    """
    folders = {Path(document.path).resolve().parent for document in merged.documents}
    if folders == {path.parent.resolve()}:
        return
    for loc, text in texts_in(merged.value):
        where = merged.locate(loc)
        for name in _meant(text):
            theirs, ours = Path(where.path).resolve().parent / name, path.parent / name
            if _is(Path.is_file, theirs) and theirs.resolve() != ours.resolve():
                raise SpecError(
                    f"{shown(text)} is inherited from another folder, "
                    f"and would be {shown(str(ours))}",
                    where=where,
                    remedy=_told_anew(text, theirs, path),
                )


def _told_anew(text: str, file: Path, heir: Path) -> str:
    name = _as_named_in(file, heir)
    if text.startswith("./") and name.startswith(".."):  # code lies in the folder of its file
        return f"Copy {file.name} into {heir.parent}."
    return f"Name {shown(name)} in {heir}."


def _as_named_in(file: Path, heir: Path) -> str:
    """Write the path of a file as it is named in another."""
    return os.path.relpath(file.resolve(), heir.parent.resolve())


def _meant(text: str) -> Iterator[str]:
    """Give the names of files that a text may be: a plug-in is written ``./file.py:Class``."""
    yield from filter(None, (text, text.rpartition(":")[0]))


def _with_bases(path: Path, *, is_scenario: bool) -> tuple[Document, ...]:
    documents: list[Document] = []
    seen: list[Path] = []
    current: Path | None = path
    while current is not None:
        naming, current = current, None
        document = load_document(naming)
        seen.append(naming.resolve())
        documents.append(document)
        if isinstance(document.value, dict) and "extends" in document.value:
            base = document.value.pop("extends")
            where = document.locate(("extends",))
            if not isinstance(base, str):
                raise SpecError(
                    f"extends: {shown(base)} is no name",
                    where=where,
                    remedy="Write a file, or the id of one in the same folder.",
                )
            current = _base(naming, base, where, is_scenario=is_scenario)
            if current.resolve() in seen:
                chain = " → ".join(file.stem for file in [*seen, current])
                raise SpecError(
                    f"extends is cyclic: {chain}", where=where, remedy="Remove one of the links."
                )
    return tuple(documents)


def _base(path: Path, base: str, where: SourceLocation, *, is_scenario: bool) -> Path:
    """Find what a file extends: beside it, or a scenario of the package by its id."""
    is_file = base.endswith((".yaml", ".yml"))
    name = base if is_file else f"{base}.yaml"
    if is_scenario and not is_file and not _is(Path.is_file, path.parent / name):
        known = scenario_files(shipped(SCENARIOS))
        if base in known:
            return known[base]
    found, theirs = _beside(path, name, where), path.resolve().parent / name
    if _is(Path.is_file, theirs) and theirs.resolve() != found.resolve():
        raise SpecError(
            f"{path} leads to another folder, and {shown(name)} beside it is not the one there",
            where=where,
            remedy=f"Use {shown(_as_named_in(path, path))} by its own path.",
        )
    return found


def merge(base: Any, override: Any) -> Any:
    """Lay one content over another: mappings merge key by key, null removes a key.

    Source:
        RFC 7386, "JSON Merge Patch".

    >>> merge({"a": 1, "b": {"c": 2, "d": 3}}, {"b": {"c": 4, "d": None}})
    {'a': 1, 'b': {'c': 4}}
    """
    if not isinstance(override, Mapping):
        return override
    merged = dict(base) if isinstance(base, Mapping) else {}
    for key, value in override.items():
        if value is None:
            merged.pop(key, None)
        else:
            merged[key] = merge(merged.get(key), value)
    return merged


def _deepest(documents: tuple[Document, ...], loc: Loc) -> Document:
    for depth in range(len(loc), 0, -1):
        for document in documents:
            if _has(document.value, loc[:depth]):
                return document
    return documents[0]


def _has(value: Any, loc: Loc) -> bool:
    for part in loc:
        if not has_part(value, part):
            return False
        value = value[part]
    return True


def _beside(path: Path, name: str, where: SourceLocation) -> Path:
    found = path.parent / name
    if not _is(Path.is_file, found):
        raise SpecError(
            f"{shown(name)} is not a file",
            where=where,
            remedy=f"Looked for {shown(str(found))}; check the path.",
        )
    return found


def _is(kind: Callable[[Path], bool], path: Path) -> bool:
    """Ask the file system, for which a name can be too long or not a name at all."""
    try:
        return kind(path)
    except (OSError, ValueError):
        return False


def _catalogue(path: Path, written: _Merged) -> dict[str, Path]:
    """List the scenarios that an ODD may use: of its folder, and those of the package."""
    name = written.value.get("catalogue") if isinstance(written.value, dict) else None
    if isinstance(name, str):
        folder = path.parent / name
        if not _is(Path.is_dir, folder):
            raise SpecError(
                f"catalogue {shown(name)} is not a folder",
                where=written.locate(("catalogue",)),
                remedy=f"Looked for {shown(str(folder))}; check the path.",
            )
        return scenario_files(folder)
    found = scenario_files(shipped(SCENARIOS))
    for folder in (path.parent.parent / SCENARIOS, path.parent / SCENARIOS):
        if folder.is_dir():
            return found | scenario_files(folder)
    return found


def scenario_files(catalogue: Path) -> dict[str, Path]:
    """List the scenarios of a folder by id (the file's stem).

    Raises:
        SpecError: Two files have one stem.
    """
    found: dict[str, Path] = {}
    for path in sorted(catalogue.rglob("*.yaml")):
        if path.stem in found:
            raise SpecError(
                f"scenario {path.stem!r} is in another file, too: {found[path.stem]}",
                where=SourceLocation(str(path), 1, 1),
                remedy="Rename one of them.",
            )
        found[path.stem] = path
    return found


def _check_realised(
    concept: Loaded[Concept], architectures: Mapping[str, Loaded[Architecture]]
) -> None:
    """Refuse what realises an element that no concept has.

    An architecture may be judged by several concepts, one of which speaks of a part of it only:
    those in the folder of the ODD's concept, and the shipped ones, whose architectures people copy.
    """
    elements = {element.id for element in concept.spec.elements}
    others: set[str] | None = None
    found: list[InputError] = []
    for item in architectures.values():
        spec = item.spec
        parts: list[tuple[Loc, str | None]] = [(("switch",), spec.switch.realises)]
        parts += [(("sensors", name), part.realises) for name, part in spec.sensors.items()]
        parts += [(("channels", name), part.realises) for name, part in spec.channels.items()]
        for loc, element in parts:
            if element is None or element in elements:
                continue
            others = _other_elements(concept.path) if others is None else others
            if element not in others:
                error = SpecError(
                    f"{'.'.join(map(str, loc))} realises {element!r}, which is no element of "
                    f"concept {concept.spec.concept}, nor of another one",
                    where=item.locate((*loc, "realises")),
                    remedy=suggest(element, sorted(elements)),
                )
                found.append(error)
    raise_all(found)


def _other_elements(concept: Path) -> set[str]:
    """Collect the elements of the concepts beside a concept and of the shipped ones."""
    found: set[str] = set()
    folders = (concept.parent, shipped("odd") / "concepts")
    for path in (path for folder in folders for path in sorted(folder.glob("*.yaml"))):
        try:
            found |= {element.id for element in _load(path, Concept).spec.elements}
        except InputError:
            # A file that nothing names, which may be wrong, or no concept at all.
            continue
    return found


def _check_asil(concept: Loaded[Concept]) -> None:
    problems = asil_problems(concept.spec)
    raise_all([SpecError(text, where=concept.locate(loc)) for loc, text in problems])


# --- Which catalogue of scenarios the verbs read --------------------------------------------------


def catalogue_folder(chosen: Path | None) -> Path:
    """Find the folder of scenarios: the chosen one, ``scenarios_db`` here, or the shipped one.

    Raises:
        UsageError: The chosen one is not a folder.
    """
    from adeye.errors import UsageError

    if chosen is not None:
        if not chosen.is_dir():
            raise UsageError(f"catalogue {chosen} is not a folder", remedy="Name a folder of YAML.")
        return chosen
    here = Path("scenarios_db")
    return here if here.is_dir() else shipped("scenarios_db")


def catalogue_files(chosen: Path | None) -> dict[str, Path]:
    """List the scenarios that the verbs read by id: those of a folder chosen, or of both others.

    One in ``scenarios_db`` here takes the place of the shipped one of the same id.

    Raises:
        UsageError: The chosen one is not a folder.
        SpecError: Two files of one folder have one id.
    """
    found = {} if chosen is not None else scenario_files(shipped(SCENARIOS))
    return dict(sorted((found | scenario_files(catalogue_folder(chosen))).items()))
