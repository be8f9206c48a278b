"""A failed channel never goes unmentioned."""

from typing import Any, cast

from adeye.campaign.summary import failed_channels


class _Repository:
    @staticmethod
    def failed_channels(_campaign: str) -> Any:
        return (("own", "nominal", "channel_error", 1200),)


def test_failed_channels_are_named_with_their_runs() -> None:
    text = failed_channels(cast("Any", _Repository()), "a")
    assert text == "channel_error of channel nominal in 1,200 runs of own"
