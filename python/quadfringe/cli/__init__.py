"""The command line. Heavy imports stand inside the commands: `quadfringe --help` answers at once."""

from quadfringe.cli.app import app

__all__ = ["app"]
