"""Plug-ins and monitors of an architecture, loaded and checked at plan time.

A result names the code that it was executed with by the hash that the plan took. What is executed
is read when a block begins, and a channel may read its files at any tick, so a result counts only
if everything is still as planned after its block.
"""

from __future__ import annotations

import os
import re
import threading
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import wraps
from importlib.machinery import PathFinder
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import yaml

from adeye import plugins
from adeye.errors import IntegrityError, SpecError, UsageError, placed
from adeye.fields import texts_in
from adeye.identity import file_digest
from adeye.judge.metrics import METRICS, register_metric
from adeye.plugin_code import (
    NAMES,
    code_digest,
    files_digest,
    may_hold,
    places_of,
    require_own_data,
    require_unkept,
    spec_files,
    with_imports,
)
from adeye.plugins import Part, ReadFile
from adeye.ports import MetricColumn
from adeye.simulate.bridges import middleware
from adeye.simulate.channels.factory import BUILT_IN as BUILT_IN_CHANNELS
from adeye.simulate.channels.factory import make_channel, plugin_channel
from adeye.simulate.channels.fmu import wire_channel
from adeye.simulate.channels.policy import load_policy
from adeye.simulate.channels.process.channel import (
    HERE,
    command_files,
    counted_files,
    find_program,
)
from adeye.simulate.sensors.fmu import wire_sensor
from adeye.simulate.traffic.plant import wire_plant
from adeye.spec.channels import (
    CommandChannel,
    FmuChannel,
    HostedChannel,
    OutsideChannel,
    PluginChannel,
    PolicyChannel,
)
from adeye.spec.document import Loc, parse_document
from adeye.spec.load import Loaded
from adeye.spec.programs import FmuUse, Plant
from adeye.spec.quantity import IDENTIFIER
from adeye.spec.sensors import FmuSensor, PluginSensor
from adeye.store.plugin_metrics import is_free
from adeye.supervision import guest, sealed
from adeye.units import shown

if TYPE_CHECKING:
    from adeye.campaign.plan import CampaignPlan
    from adeye.judge.metrics.registry import Measure
    from adeye.judge.series import TraceSeries
    from adeye.spec.architecture import Architecture
    from adeye.spec.load import OddFiles
    from adeye.spec.scenario import LogicalScenario

# --- Plug-ins and monitors of an architecture, loaded and checked at plan time --------------------


@dataclass(frozen=True)
class Parts:
    """What an architecture brings beside its own file.

    Attributes:
        plugins: Plug-ins that it names.
        monitors: Monitor ids that its channels declare, in the order of the channels.
        metrics: Metrics from outside the package that the ODD lists.
        files: Files that its channels say they read.
    """

    plugins: tuple[Part, ...]
    monitors: tuple[str, ...]
    metrics: tuple[Part, ...] = ()
    files: tuple[ReadFile, ...] = ()

    @property
    def digest(self) -> str:
        """Hash of the plug-ins' code, versions and files; empty if there are none."""
        parts = (*self.plugins, *self.metrics)
        return plugins.plugins_digest(parts, self.files) if parts or self.files else ""


def load_parts(loaded: Loaded[Architecture], metrics: tuple[Part, ...] = ()) -> Parts:
    """Load the plug-ins of an architecture, ask its channels for monitors, hash what they read.

    Raises:
        SpecError: A plug-in does not load, its parameters are not valid, or a file that it reads
            is not there.
    """
    found = replace(load_code(loaded, metrics), files=tuple(_files(loaded)))
    check_words(loaded)
    for channel in loaded.spec.channels:  # what was written while code was executed
        _require_unkept(loaded, channel, is_executed=True)
    return found


def parts_now(architecture: Architecture, folder: Path, metrics: tuple[Part, ...] = ()) -> Parts:
    """Load what an architecture names that a database holds, as it is by now.

    Args:
        architecture: As it is stored.
        folder: Of the file that it was written in.
        metrics: Of the ODD.

    Raises:
        SpecError: Something that it names is not there any more.
    """
    name = architecture.architecture
    text = yaml.safe_dump(architecture.model_dump(mode="json"), allow_unicode=True)
    document = parse_document(text, f"architecture {name} of the database")
    stored = Loaded(architecture, document.value, folder / f"{name}.yaml", (document,))
    return load_parts(stored, metrics)


def load_code(loaded: Loaded[Architecture], metrics: tuple[Part, ...] = ()) -> Parts:
    """Load the plug-ins of an architecture and ask its channels for monitors; read no more.

    Raises:
        SpecError: A plug-in does not load, or its parameters are not valid.
    """
    folder = loaded.path.parent
    named: list[Part] = []
    monitors: list[str] = []
    _check_fmus(loaded)
    for name, sensor in loaded.spec.sensors.items():
        if isinstance(sensor, PluginSensor):
            named.append(_plugin(loaded, ("sensors", name), sensor, "sensor", ("sense",)))
    for name, channel in loaded.spec.channels.items():
        _require_unkept(loaded, name)
        if isinstance(channel, PolicyChannel):
            where = loaded.locate(("channels", name, "parameters", "policy"))
            with placed(where, keeps_place=True):
                named.append(load_policy(channel.parameters.policy, folder))
            _require_own_data(loaded, name, named[-1])
            continue
        if isinstance(channel, HostedChannel):
            _require_program(loaded, name, channel)
            continue
        if channel.kind in BUILT_IN_CHANNELS:
            made = make_channel(channel.kind, folder, channel.parameters)
        else:
            assert isinstance(channel, PluginChannel)
            part = _plugin(loaded, ("channels", name), channel, "channel", ("act",))
            _require_own_data(loaded, name, part)
            named.append(part)
            with placed(loaded.locate(("channels", name, "kind"))):
                made = plugin_channel(part)
        for monitor in made.monitor_ids:
            if re.fullmatch(IDENTIFIER, monitor) is None:
                raise SpecError(
                    f"channel {name}: {shown(monitor)} cannot name a monitor",
                    where=loaded.locate(("channels", name, "kind")),
                    remedy="Use lower case letters, digits and underscores after a letter.",
                )
            if monitor in monitors:
                raise SpecError(
                    f"channel {name}: monitor {monitor!r} is declared by another channel, too",
                    where=loaded.locate(("channels", name)),
                    remedy="Monitor ids are unique within an architecture.",
                )
            monitors.append(monitor)
    return Parts(tuple(named), tuple(monitors), metrics)


def _require_unkept(
    loaded: Loaded[Architecture], channel: str, *, is_executed: bool = False
) -> None:
    """Refuse files that changed since code which reads them was executed in this process."""
    spec, folder = loaded.spec.channels[channel], loaded.path.parent
    if isinstance(spec, PluginChannel | PolicyChannel):
        paths = [folder / name for name in spec.files if (folder / name).is_file()]
        files = [(f"{NAMES}{path.name}", path) for path in paths]
        require_unkept(f"channel {channel}", files, is_executed=is_executed)


def _require_own_data(loaded: Loaded[Architecture], channel: str, part: Part) -> None:
    """Refuse that what a channel reads is handed to a sealed part by a module of both."""
    spec = loaded.spec.channels[channel]
    assert isinstance(spec, PluginChannel | PolicyChannel)
    files = [loaded.path.parent / name for name in spec.files]
    with placed(loaded.locate(("channels", channel)), f"channel {channel}: "):
        require_own_data(part.name, part.helpers, places_of(("", path) for path in files), None)


def _check_fmus(loaded: Loaded[Architecture]) -> None:
    """Look whether the FMUs of vehicle and sensors are there, and wired to what they have."""
    for loc, use in loaded.spec.fmus.items():
        with placed(loaded.locate(loc), f"{'.'.join(loc)}: "):
            if isinstance(use, Plant):
                wire_plant(use, loaded.path.parent)
            elif isinstance(use, FmuSensor):
                wire_sensor(use, loaded.path.parent)


def _require_program(loaded: Loaded[Architecture], name: str, channel: HostedChannel) -> None:
    """Refuse a channel whose program, FMU or middleware is not there."""
    folder = loaded.path.parent
    with placed(loaded.locate(("channels", name, "kind")), f"channel {name}: "):
        middleware.require(channel.kind)
    key = ("command",) if isinstance(channel, CommandChannel) else ()
    with placed(loaded.locate(("channels", name, "parameters", *key)), f"channel {name}: "):
        if isinstance(channel, FmuChannel):
            wire_channel(channel.parameters, folder)
        elif isinstance(channel, CommandChannel):
            find_program(channel.parameters.command, folder)


def named_files(architecture: Architecture) -> dict[str, tuple[str, ...]]:
    """List the files that each channel names, as written, its program with them; and other FMUs."""
    named = {
        f"channels.{name}": tuple(file for _, file in _named(architecture, name))
        for name in architecture.channels
    }
    return named | {".".join(loc): (use.file,) for loc, use in architecture.fmus.items()}


def _named(architecture: Architecture, name: str) -> list[tuple[plugins.Loc, str]]:
    """List where in a channel's record which file is named."""
    channel = architecture.channels[name]
    found: list[tuple[plugins.Loc, str]] = []
    if isinstance(channel, CommandChannel):
        files = command_files(channel.parameters.command)
        found += [(("parameters", "command", at), file) for at, file in files.items()]
    if isinstance(channel, FmuChannel):
        found.append((("parameters", "file"), channel.parameters.file))
    if isinstance(channel, OutsideChannel):
        found += [(("files", at), file) for at, file in enumerate(channel.files)]
    return found


def _files(loaded: Loaded[Architecture]) -> Iterator[ReadFile]:
    for place, use in loaded.spec.fmus.items():
        name = ".".join(place)
        with placed(loaded.locate((*place, "file")), f"{name}: "):
            yield plugins.read_file(name, use.file, loaded.path.parent)
    for channel in loaded.spec.channels:
        found: set[Path] = set()
        for loc, name in _named(loaded.spec, channel):
            where = loaded.locate(("channels", channel, *loc))
            with placed(where, f"channel {channel}: "):
                file = plugins.read_file(f"channels.{channel}", name, loaded.path.parent)
            if file.path in found:
                raise SpecError(
                    f"channel {channel}: file {shown(name)} is listed twice",
                    where=where,
                    remedy="Name each file once.",
                )
            found.add(file.path)
            yield file
        # What Python finds beside its program is a part of it, listed or not.
        with placed(loaded.locate(("channels", channel)), f"channel {channel}: "):
            counted = _counted(loaded, channel)
        for path in sorted({*counted} - found):
            name = f"{HERE}{path.relative_to(loaded.path.parent.resolve())}"
            yield plugins.read_file(f"channels.{channel}", name, loaded.path.parent)


def check_words(loaded: Loaded[Architecture]) -> None:
    """Refuse words, values and start values that mean files which no identity has.

    Raises:
        SpecError: One does.
    """
    for place, use in loaded.spec.fmus.items():
        _require_in_fmu(loaded, place, use)
    for channel, spec in loaded.spec.channels.items():
        if isinstance(spec, FmuChannel):
            _require_in_fmu(loaded, ("channels", channel, "parameters"), spec.parameters)
        if isinstance(spec, CommandChannel):
            _require_counted(loaded, channel, spec, _counted(loaded, channel))


def _counted(loaded: Loaded[Architecture], channel: str) -> tuple[Path, ...]:
    """List the files that count with a channel, see ``counted_files``."""
    spec = loaded.spec.channels[channel]
    command = spec.parameters.command if isinstance(spec, CommandChannel) else ()
    return counted_files(command, getattr(spec, "files", ()), loaded.path.parent)


def check_driver_words(loaded: Loaded[LogicalScenario]) -> None:
    """Do as ``check_words`` with the FMUs that drive actors of a scenario."""
    for name, driver in loaded.spec.drivers.items():
        _require_in_fmu(loaded, ("actors", name, "driver"), driver)


def _require_in_fmu(loaded: Loaded[Any], place: Loc, use: FmuUse) -> None:
    """Refuse start values of an FMU that mean files: it may read them, and no identity has them."""
    words: list[tuple[Loc, str]]
    words = [(("start", *loc), text) for loc, text in texts_in(use.start)]
    remedy = "Put the file into the resources of the FMU."
    _require_no_other_file(loaded, place, words, (), f"{'.'.join(map(str, place[:2]))}: ", remedy)


def _require_counted(
    loaded: Loaded[Architecture], channel: str, spec: CommandChannel, counted: Container[Path]
) -> None:
    """Refuse words and values that mean files which no identity has: results would be reused."""
    words: list[tuple[Loc, str]]
    words = [
        (("command", at), word)
        for at, word in enumerate(spec.parameters.command)
        if at and not word.startswith(HERE)
    ]
    values = getattr(spec.parameters, "values", {})
    texts = [*texts_in(values), *_paths_as_keys(values)]
    words += [(("values", *loc), text) for loc, text in texts]
    _require_no_other_file(
        loaded,
        ("channels", channel, "parameters"),
        words,
        counted,
        f"channel {channel}: ",
        f"Name each file in files, or as a word {HERE}file of the command.",
    )


def _paths_as_keys(content: Any, loc: Loc = ()) -> Iterator[tuple[Loc, str]]:
    """Give every key of a content that may be a path, with its place."""
    if isinstance(content, Mapping):
        yield from (((*loc, key), key) for key in content if "/" in key)
        for key, item in content.items():
            yield from _paths_as_keys(item, (*loc, key))
    elif isinstance(content, list | tuple):
        for at, item in enumerate(content):
            yield from _paths_as_keys(item, (*loc, at))


def _require_no_other_file(
    loaded: Loaded[Any],
    place: Loc,
    words: Iterable[tuple[Loc, str]],
    counted: Container[Path],
    whose: str,
    remedy: str,
) -> None:
    folder = loaded.path.parent
    for loc, word in words:
        named = {*_PARTED.split(word), word[word.find("/") :] if "/" in word else word, word}
        for name in sorted(named - {"", ".", ".."}):
            # A word that happens to be called as a folder at hand is none.
            places = [folder / name, *([Path(name)] if "/" in name or "." in name else [])]
            if not name.startswith(_OF_SYSTEM) and any(
                _uncounted(path, counted) for path in places
            ):
                raise SpecError(
                    f"{whose}{shown(word)} means a file or folder in no identity",
                    where=loaded.locate((*place, *loc)),
                    remedy=remedy,
                )


def _uncounted(path: Path, counted: Container[Path]) -> bool:
    # Unlike Path.exists it takes any text, however long.
    return os.path.exists(path) and path.resolve() not in counted  # noqa: PTH110


_PARTED: Final = re.compile(r"""[=:,;@'"\s{}()\[\]]|file://""")
"""What stands before a name of a file in a word."""
_OF_SYSTEM: Final = ("/usr/", "/opt/", "/bin/", "/lib/", "/lib64/", "/dev/", "/proc/")
"""Where installed software lies, which no identity has; its version belongs into ``version``."""


def _plugin(
    loaded: Loaded[Architecture],
    loc: tuple[str, str],
    spec: PluginSensor | PluginChannel,
    kind: str,
    methods: tuple[str, ...],
) -> Part:
    with placed(loaded.locate((*loc, "kind")), keeps_place=True):
        is_sensor = isinstance(spec, PluginSensor)
        part = plugins.load_part(spec.kind, loaded.path.parent, is_sealed=is_sensor)
        plugins.require(part, kind, methods)
        checked = plugins.validate_parameters(part, spec.parameters)
    for place, message in checked.errors:
        raise SpecError(
            f"{'.'.join((*loc, 'parameters', *map(str, place)))}: {message}",
            where=loaded.locate((*loc, "parameters", *place)),
        )
    return part


# --- Plug-ins without importing them: what packages offer, and what an ODD names, with code
# hashes.

GROUP: Final = "adeye."
"""Beginning of the groups of entry points that packages offer parts in, such as
``adeye.channels``."""


@dataclass(frozen=True, slots=True)
class Offered:
    """A part that an installed package offers; nothing uses it until a file names ``source``.

    Attributes:
        name: As the package calls it.
        kind: What of: the group behind ``adeye.``.
        package: The distribution.
        version: Of the distribution.
        source: ``module:Class``, as an ODD or architecture would name it.
    """

    name: str
    kind: str
    package: str
    version: str
    source: str


@dataclass(frozen=True, slots=True)
class Named:
    """A part that an ODD or one of its architectures names.

    Attributes:
        source: ``module:Class`` or ``./file.py:Class``, as written.
        kind: channel, sensor, policy or metric.
        owner: The file that names it, as the user wrote its path.
        digest: sha256 of the file, or of all files of the package; empty if it is not found.
    """

    source: str
    kind: str
    owner: str
    digest: str


def offered() -> tuple[Offered, ...]:
    """List what installed packages offer, from their metadata alone."""
    found = {
        Offered(
            item.name,
            item.group.removeprefix(GROUP),
            item.dist.name if item.dist is not None else "",
            item.dist.version if item.dist is not None else "",
            item.value,
        )
        for group in entry_points().groups
        if group.startswith(GROUP)
        for item in entry_points(group=group)
    }
    return tuple(sorted(found, key=lambda item: (item.kind, item.name, item.source)))


def named(files: OddFiles) -> tuple[Named, ...]:
    """List the plug-ins that an ODD and its architectures name; none is imported."""
    found = {
        Named(source, kind, str(owner), _digest(source, owner.parent))
        for owner, kind, source in _sources(files)
    }
    return tuple(sorted(found, key=lambda item: (item.owner, item.kind, item.source)))


def _sources(files: OddFiles) -> Iterator[tuple[Path, str, str]]:
    for source in files.odd.spec.plugins:
        yield files.odd.path, "metric", source
    for loaded in files.architectures.values():
        for sensor in loaded.spec.sensors.values():
            if isinstance(sensor, PluginSensor):
                yield loaded.path, "sensor", sensor.kind
        for channel in loaded.spec.channels.values():
            if isinstance(channel, PluginChannel):
                yield loaded.path, "channel", channel.kind
            if isinstance(channel, PolicyChannel):
                yield loaded.path, "policy", channel.parameters.policy


def _digest(source: str, folder: Path) -> str:
    """Hash the code behind a name as ``registry`` does when it loads it."""
    module = source.rpartition(":")[0]
    try:
        if module.endswith(".py"):
            path = (folder / module).resolve()
            return code_digest(with_imports([(path.name, path)]), is_file=True)
        # The finder of files only looks; import_module would execute the package.
        spec = PathFinder.find_spec(module.partition(".")[0])
        return "" if spec is None else files_digest(with_imports(spec_files(spec)))
    except (OSError, ValueError, SpecError):
        return ""


# --- Metrics from outside the package: loaded as the ODD lists them, in every process -------------

_REGISTERED: Final[dict[str, tuple[str, str]]] = {}
"""Name of the plug-in and digest of its source behind each column that is not built in."""
_REGISTERING: Final = threading.Lock()


def use_plugin_metrics(names: Sequence[str], folder: Path) -> tuple[Part, ...]:
    """Register the metrics of an ODD, and those of no other ODD.

    The uid of each gets the digest of its source, so that a verdict on it is of this very code.

    Args:
        names: Entry points, ``module:Class`` or ``./file.py:Class``.
        folder: Folder of the ODD's file.

    Returns:
        What was loaded.

    Raises:
        SpecError: There is no such class, or it is no metric.
        UsageError: It lacks an attribute, has one that is not allowed, or its column is taken.
    """
    parts = tuple(plugins.load_part(name, folder, is_sealed=True) for name in names)
    # Threads of blocks come here as well.
    with _REGISTERING:
        _register(parts)
    return parts


def _register(parts: Sequence[Part]) -> None:
    wanted = {(part.name, part.source_digest) for part in parts}
    for column in [key for key, owner in _REGISTERED.items() if owner not in wanted]:
        del METRICS[column]
        del _REGISTERED[column]
    for part in parts:
        owner = (part.name, part.source_digest)
        if owner in _REGISTERED.values():
            continue
        plugins.require(part, "metric", ("compute",))
        before = set(METRICS)
        with guest(part.name, "metric"), sealed(part.name, part.places):
            register_metric(part.obj)
        for column in set(METRICS) - before:
            found = METRICS[column]
            if not is_free(column):
                del METRICS[column]
                raise UsageError(
                    f"metric {found.uid}: column {column!r} is a word of SQL or of the database",
                    remedy="Give it a name of its own with its unit, such as top_speed_mps.",
                )
            uid = f"{found.uid}#{part.source_digest[:12]}"
            measure = _visiting(part, found.measure)
            METRICS[column] = replace(found, uid=uid, measure=measure, plugin=part.name)
            _REGISTERED[column] = owner


def _visiting(part: Part, measure: Measure) -> Measure:
    """Say who works while a metric is computed."""

    @wraps(measure)
    def visit(series: TraceSeries) -> MetricColumn:
        with guest(part.name), sealed(part.name, part.places):
            answer: MetricColumn = _taken(measure(series))
            return answer

    return visit


_HELD: Final = {str, bytes, list, tuple, np.ndarray}
"""Types of what a metric answers that hold all they tell."""


def _taken(answer: Any) -> Any:
    """Take apart what a metric answers while it may work: what is lazy would work later."""
    if not isinstance(answer, MetricColumn):  # refused by who asked
        return answer
    parts: dict[str, Any] = {
        item.name: tuple(part)
        for item in fields(answer)
        if isinstance(part := getattr(answer, item.name), Iterable) and type(part) not in _HELD
    }
    return replace(answer, **parts)


def plugin_of(column: str) -> str | None:
    """Name the plug-in that a metric comes from; None for a built-in one."""
    owner = _REGISTERED.get(column)
    return None if owner is None else owner[0]


# --- Notice that code or a file of a plug-in is changed on disk while a campaign runs -------------

_Signature = tuple[tuple[str, int, int, int, int], ...]
"""Of each file: path, inode, size, and when content and entry were last written [ns]."""

_GONE: Final = -1


@dataclass(frozen=True, slots=True)
class Source:
    """A plug-in or a file that one reads, as the plan found it.

    Attributes:
        name: As the user wrote it.
        user: Who names it: an architecture, or the ODD.
        folder: Folder of the file that names it.
        digest: Hash when the campaign was planned.
        path: Of a file that a plug-in reads, as it is named: links in it are followed anew whenever
            it is read. None for code.
    """

    name: str
    user: str
    folder: Path
    digest: str
    path: Path | None = None

    def paths(self) -> list[Path]:
        """List the files behind it."""
        if self.path is not None:
            return [self.path]
        try:
            return [path for _, path in plugins.source_files(self.name, self.folder)]
        except SpecError:  # the module's file has gone
            return []

    def is_as_planned(self) -> bool:
        """Hash it again and compare."""
        try:
            if self.path is None:
                return plugins.source_digest(self.name, self.folder) == self.digest
            return file_digest(self.path) == self.digest
        except (OSError, SpecError):
            return False


class Unchanged:
    """Compares plug-ins and the files that they read with what the plan found.

    They are hashed again only if the system says that one was written, so that asking after each
    block costs next to nothing. None may be written at all meanwhile: it may have been another one
    while a run read or imported it, and be put back since.
    """

    def __init__(self, plan: CampaignPlan | Iterable[Source]) -> None:
        """Take down what a plan found, or was told to have found; nothing is compared yet."""
        found = plan if isinstance(plan, Iterable) else sources(plan)
        self._seen: dict[Source, _Signature | None] = dict.fromkeys(found)
        self._begun: dict[Source, _Signature] = {
            source: _signature(source) for source in self._seen
        }

    def check(self) -> None:
        """Compare.

        Raises:
            IntegrityError: A file is not as planned.
        """
        for source, before in self._seen.items():
            # Taken before the hash: what is written between is noticed by the next comparison.
            now = _signature(source)
            if now == before:
                continue
            begun = self._begun[source]
            if not source.is_as_planned() or begun != now:
                written = set(now) ^ set(before or begun)
                may_hold(Path(item[0]) for item in written)
                raise IntegrityError(
                    f"{source.name}, which {source.user} names, was changed after the campaign was "
                    f"planned{_written(before or begun, now)}. Results since the last block that "
                    "was saved are thrown away; run again to go on with what is there now."
                )
            self._seen[source] = now


def sources(plan: CampaignPlan) -> Iterator[Source]:
    """List the plug-ins of a plan and the files that they read."""
    for name, parts in plan.parts.items():
        yield from sources_of(parts, name, plan.folders[name], plan.path.parent)
    for name, loaded in plan.files.scenarios.items():
        yield from driver_sources(loaded.spec, name, loaded.path.parent)


def sources_of(parts: Parts, name: str, folder: Path, odd_folder: Path) -> Iterator[Source]:
    """List the plug-ins of an architecture and of its ODD, and the files that they read."""
    user = f"architecture {name}"
    for part in parts.plugins:
        yield Source(part.name, user, folder, part.source_digest)
    for file in parts.files:
        yield Source(file.name, user, folder, file.digest, folder / file.name)
    for part in parts.metrics:
        yield Source(part.name, "the ODD", odd_folder, part.source_digest)


def driver_sources(scenario: LogicalScenario, name: str, folder: Path) -> Iterator[Source]:
    """List the FMUs that drive actors of a scenario."""
    for driver in scenario.drivers.values():
        path = folder / driver.file
        yield Source(driver.file, f"scenario {name}", folder, driver.digest, path)


def _signature(source: Source) -> _Signature:
    paths = source.paths()
    links = [] if source.path is None else [link for path in paths for link in _links(path)]
    return (*links, *_states(paths))


def _states(paths: Iterable[Path]) -> _Signature:
    found = []
    for path in paths:
        try:
            found.append(_told_of(path, path.stat()))
        except OSError:
            found.append((str(path), _GONE, _GONE, _GONE, _GONE))
    return tuple(found)


def _told_of(path: Path, told: os.stat_result) -> tuple[str, int, int, int, int]:
    return str(path), told.st_ino, told.st_size, told.st_mtime_ns, told.st_ctime_ns


def _links(path: Path) -> list[tuple[str, int, int, int, int]]:
    """Tell of the symbolic links that lead to a file: one that is switched leads to another."""
    found = []
    waiting, seen = [Path.cwd() / path], set()
    while waiting:
        place = waiting.pop()
        for item in (place, *place.parents):
            if item not in seen:
                seen.add(item)
                with suppress(OSError):
                    waiting.append(item.parent / item.readlink())
                    found.append(_told_of(item, item.lstat()))
    return found


def _written(before: _Signature | None, now: _Signature) -> str:
    """Name the files that were written: of a package only those of which that is known."""
    known = before or (now if len(now) > 1 else ())
    changed = sorted({item[0] for item in set(now) ^ set(known)})
    return f": {', '.join(changed)}" if changed else ""
