"""Test an autonomous driving architecture, in closed loop, against its operating conditions."""

__version__ = "0.1.0"
