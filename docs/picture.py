"""Take the picture of the report that the README shows: headline, verdicts and a replay.

    python docs/picture.py reports/motorway_chauffeur.html

Needs Chromium. The page is the real one; only the sections in between are left out.
"""

from __future__ import annotations

import base64
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "images" / "report.png"
WIDTH = 1280
SCALE = 0.75
MAX_BYTES = 400_000
KEPT = ("summary", "verdicts", "replays")
MOMENT = 0.6
"""Part of the run after which the replay is shown."""

sys.path.insert(0, str(ROOT))


def take(report: Path) -> bytes:
    """Open the report and return the picture as PNG."""
    from tests.report.browser import Browser

    with tempfile.TemporaryDirectory() as profile, Browser(Path(profile)) as tab:
        tab.open(report.resolve(), width=WIDTH)
        kept = ", ".join(f"#{name}" for name in KEPT)
        tab.run(f"document.querySelectorAll('main section:not({kept})').forEach(s => s.remove())")
        tab.run(f"scrub.value = {MOMENT} * scrub.max; scrub.dispatchEvent(new Event('input'))")
        bottom = tab.run(
            "Math.ceil(document.querySelector('.plot').getBoundingClientRect().bottom"
            " + window.scrollY + 16)"
        )
        clip = {"x": 0, "y": 0, "width": WIDTH, "height": bottom, "scale": SCALE}
        shot = tab.call(
            "Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip
        )
        return base64.b64decode(shot["data"])


def main(arguments: Sequence[str]) -> int:
    """Write the picture; returns the exit code."""
    picture = take(Path(arguments[0]))
    if len(picture) > MAX_BYTES:
        sys.stderr.write(f"the picture has {len(picture)} bytes, more than {MAX_BYTES}\n")
        return 1
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    PICTURE.write_bytes(picture)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
