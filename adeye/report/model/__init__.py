"""The record of a report, which the page and every file are made of.

No builder and no text for people is here. Begin with ``report``.
"""
