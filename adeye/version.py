"""The version of the package, and the releases of others."""

__version__ = "0.1.0"


def release_of(package: str) -> str:
    """Return the installed release of a package; empty if it is not there."""
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""
