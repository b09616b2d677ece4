"""Pictures of shots and shapes: reports, movies, and the live page in the browser.

The modules are imported one by one, because each needs another optional library: `report` needs matplotlib, `viewer`
needs viser, `movie` and `colours` need OpenCV only.
"""

__all__ = ["colours", "movie", "report", "viewer"]
