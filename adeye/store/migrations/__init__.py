"""Migrations of the database, shipped in the package and run by ``schema.upgrade``.

A new database needs none: it is made from the code that describes it. Begin with ``versions``.
"""
