"""An interval, and the normal distribution that several need."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Interval:
    """Two ends and what lies between them.

    Attributes:
        low: Lower end.
        high: Upper end.
        confidence: Nominal coverage.
    """

    low: float
    high: float
    confidence: float


def normal_quantile(share: float) -> float:
    """Give the value below which a share of the standard normal distribution lies."""
    from scipy.special import ndtri

    return float(ndtri(share))


def normal_share(quantile: float) -> float:
    """Give the share of the standard normal distribution below a value."""
    from scipy.special import ndtr

    return float(ndtr(quantile))
