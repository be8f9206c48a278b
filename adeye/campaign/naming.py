"""Which campaign is meant: by an ODD's file or id, a number or a digest, and what was edited.

Files are planned only where one is named: whoever asks by a number needs neither scenarios nor
channels, and waits for none of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import UsageError
from adeye.store.read.campaigns import LATEST
from adeye.store.records import LEFT_OUT

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from adeye.campaign.plan import CampaignPlan
    from adeye.store.records import CampaignInfo
    from adeye.store.repository import Repository

_WORDS: Final = {"plugins": "plug-ins", "scenarios": "scenarios and sweeps"}
"""Keys of an ODD that people call otherwise."""


@dataclass(frozen=True)
class Meant:
    """The campaign that a file means.

    Attributes:
        campaign: The campaign.
        edits: Why it is not what the file plans now; empty if it is.
    """

    campaign: CampaignInfo
    edits: str = ""


def is_file_name(name: str) -> bool:
    """Tell whether a name is that of an ODD's file.

    >>> is_file_name("odd/first.yaml"), is_file_name("first")
    (True, False)
    """
    return Path(name).suffix in {".yaml", ".yml"}


def is_campaign_name(text: str) -> bool:
    """Tell whether a word can be the number or digest of a campaign, or its place in time.

    >>> is_campaign_name("3"), is_campaign_name("3f2a91"), is_campaign_name("@{-1}")
    (True, True, True)
    >>> is_campaign_name("camera_radar")
    False
    """
    is_number = text.isascii() and text.isdecimal()
    return (
        is_number
        or text == LATEST
        or text.startswith("@{-")
        or (len(text) >= 4 and set(text) <= set("0123456789abcdef"))
    )


def campaign_called(repository: Repository, name: str) -> CampaignInfo | None:
    """Find a campaign by its ODD, number or digest; None for a word that can be none of them.

    Raises:
        InputError: The ODD's file is wrong, has no campaign, or was edited since: what is told of
            the old one would be taken for what the file asks for.
    """
    if is_file_name(name):
        meant = campaign_of_file(repository, name)
        if meant.edits:
            number = meant.campaign.number
            raise UsageError(
                f"{name} plans something else than campaign {number}; edited: {meant.edits}",
                remedy=f"Run adeye run {name} first, or name campaign {number}, not the file.",
            )
        return meant.campaign
    of_odd = repository.latest_campaign(name)
    if of_odd is None and is_campaign_name(name):
        return repository.find_campaign(name)
    return of_odd


def find_called(
    repository: Repository, name: str | None, *, may_be_edited: bool = False
) -> CampaignInfo:
    """Find a campaign by its ODD's file or id, its number or digest, or the latest.

    Args:
        repository: The database.
        name: What it is called.
        may_be_edited: Whether the file need not plan what it has planned: the latest campaign of
            its ODD is meant then.

    Raises:
        InputError: There is none, or it is not what the file plans.
    """
    if may_be_edited and name is not None and is_file_name(name):
        return _latest_of_file(repository, name)
    found = None if name is None else campaign_called(repository, name)
    return repository.find_campaign(name) if found is None else found


def planned_as(campaign: CampaignInfo, path: str | Path) -> CampaignPlan:
    """Plan an ODD's file as it is now, with the traffic that a campaign was planned with.

    Raises:
        InputError: Anything is wrong in the files.
    """
    from adeye.campaign.plan import make_plan

    made = {name: campaign.provenance.get(name) for name in ("backend", "variant")}
    given: dict[str, Any] = {name: str(value) for name, value in made.items() if value}
    return make_plan(path, **given)


def _latest_of_file(repository: Repository, path: str | Path) -> CampaignInfo:
    from adeye.spec.load import load_odd

    latest = repository.latest_campaign(load_odd(path).odd.spec.odd)
    if latest is None:
        repository.require_no_campaign_gone()
        raise UsageError(
            f"{path} has no campaign in the database", remedy=f"Run adeye run {path} first."
        )
    return latest


def campaign_of_file(repository: Repository, path: str | Path) -> Meant:
    """Find the campaign that an ODD's file plans, by the traffic that its latest campaign has.

    Args:
        repository: The database.
        path: The ODD's file.

    Returns:
        The latest campaign of the ODD, and what was edited, if none is what the file plans.

    Raises:
        InputError: Anything is wrong in the files, or the ODD has no campaign.
    """
    from adeye.store.write.planning import identify

    latest = _latest_of_file(repository, path)
    plan = planned_as(latest, path)
    record = plan.record()
    wanted = identify(record, plan.planned())
    for campaign in (latest, *repository.campaigns()):
        if campaign.id == wanted:
            return Meant(campaign)
    concept = record.concept.model_dump(mode="json")
    then = repository.content("odd", latest.odd_digest)
    before = repository.content("concept", latest.concept_digest)
    edits = [*_odd_edits(then, record.odd.content), *_concept_edits(before, concept)]
    if not edits and len(plan.cases) != latest.planned:
        edits = [
            f"a map, of which {len(plan.cases):,} test cases are planned for {latest.planned:,}"
        ]
    return Meant(latest, "; ".join(edits) or "the code of adeye or of a plug-in")


def _odd_edits(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    for key in _edited(then["odd"], now["odd"]):
        yield _WORDS.get(key, key)
    for kind in ("scenarios", "architectures", "data", LEFT_OUT):
        edited = _edited(then.get(kind, {}), now.get(kind, {}))
        if edited:
            word = "places of" if kind == LEFT_OUT else kind
            yield f"{word} {', '.join(edited)}"


def _concept_edits(then: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    fsrs = [{item["id"]: item for item in side["requirements"]} for side in (then, now)]
    edited = _edited(*fsrs)
    if edited:
        yield f"requirements {', '.join(edited)}"
    others = {key for key in {*then, *now} - {"requirements"} if then.get(key) != now.get(key)}
    if others:
        yield f"concept ({', '.join(sorted(others))})"


def _edited(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    return sorted(name for name in {*then, *now} if then.get(name) != now.get(name))
