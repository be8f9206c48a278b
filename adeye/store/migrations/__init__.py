"""Migrations of the database, shipped in the package and run by ``schema.upgrade``."""
