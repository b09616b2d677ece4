"""Helpers for tests alone; pytest puts the folder `tests` on the path."""
