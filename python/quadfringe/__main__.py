"""`python -m quadfringe` is the command line."""

from quadfringe.cli import app

app()
