"""Draw which packages of quadfringe import which, as a Mermaid graph, and count rooms, arrows and floors.

    python docs/draw_imports.py

The installed package is drawn; `PYTHONPATH=FOLDER` draws the package in another folder. Rooms are the modules and
packages at the top level, without the compiled one. An arrow is an import between two of them that happens at run time.
Floors are the rooms on the longest path of arrows.
"""

from __future__ import annotations

from graphlib import TopologicalSorter

import grimp

PACKAGE = "quadfringe"


def room(module: str) -> str:
    return module.split(".")[1]


def imports() -> dict[str, set[str]]:
    """Give for every room the rooms that it imports."""
    graph = grimp.build_graph(PACKAGE, exclude_type_checking_imports=True, cache_dir=None)
    rooms: dict[str, set[str]] = {room(module): set() for module in graph.find_children(PACKAGE)}
    for module in graph.modules - {PACKAGE}:
        imported = graph.find_modules_directly_imported_by(module) - {PACKAGE}
        rooms[room(module)] |= {room(other) for other in imported} - {room(module)}
    return rooms


def main() -> None:
    rooms = imports()
    floors: dict[str, int] = {}
    for name in TopologicalSorter(rooms).static_order():
        floors[name] = 1 + max((floors[other] for other in rooms[name]), default=0)
    print("graph TD")
    for name in sorted(rooms, key=lambda name: -floors[name]):
        print(*(f"    {name} --> {other}" for other in sorted(rooms[name])), sep="\n", end="\n" * bool(rooms[name]))
    print(f"{len(rooms)} rooms, {sum(map(len, rooms.values()))} arrows, {max(floors.values())} floors")


if __name__ == "__main__":
    main()
