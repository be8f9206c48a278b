"""One file per schema version after the first; a released one is never edited.

No view or table is described here that ``tables`` and ``views`` do not have. Begin with
``0017_initial``, before which nothing is upgraded.
"""
