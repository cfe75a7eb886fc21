"""The version, apart from the public face, so that rooms below it can write it down.

It is that of the tag that git found when the package was built or installed, or says how many
commits after which tag that was.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("flowborne")
except PackageNotFoundError:
    __version__ = "0+not.installed"
