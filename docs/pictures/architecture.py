"""Draw docs/pictures/architecture.svg: the rooms of the packages and the imports between them.

Run with `python docs/pictures/architecture.py` in the project's folder. The arrows come from the
imports in the source, also those inside functions and under TYPE_CHECKING; an arrow that follows
from others (a -> c from a -> b -> c) is left out of the drawing. `tests/docs/test_architecture.py`
compares the list of arrows in the picture's description with the source.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PICTURE = Path(__file__).with_suffix(".svg")
PACKAGES = ("plots", "generator", "springs")
EXTERNAL = ("exudyn", "matplotlib", "viser", "distributed")
VALUES = "generator/*.py"

WHAT: Mapping[str, str] = {
    "plots": "claims and pictures",
    "generator/cli": "one module a command",
    "generator/viewer": "the page in the browser",
    "generator/identification": "springs from a measured motion",
    "generator/inverse": "moments of a measured motion",
    "generator/study": "many runs of one figure",
    "generator/comparison": "what differs between motions",
    "generator/conversion.py": "motions, figures and models",
    "generator/person": "a body from sex, stature, mass",
    "generator/hold": "postures beside strengths",
    "generator/simulation": "model, steps, error control",
    "generator/motion_files": "action csv npz glb bvh mot html",
    "generator/model_files": "MJCF URDF OpenSim DYSPAM",
    "generator/kinematics": "tree, placement, loops, balance",
    "generator/recording.py": "the result of a run",
    "generator/model.py": "a figure, springs, parts",
    "generator/run_options.py": "options of a run",
    "generator/contact": "props, spheres, forces, record",
    "generator/geometry": "psurf, meshes, mass properties",
    "generator/input_files": "pose loads drives links moments",
    "generator/passive_curve.py": "moments beside published ones",
    "generator/springs_file": "springs of a figure, bound",
    "generator/contact_file": "parts that touch props",
    "generator/toml_file": "TOML with places and bounds",
    "generator/figure_file": "the figure language",
    VALUES: "figure, joints, rotations, units",
    "springs": "torque laws, published tables",
    "distributed": "clusters",
    "exudyn": "the engine",
    "matplotlib": "drawing",
    "viser": "pages",
}
COLUMN: Mapping[str, float] = {
    "plots": 0.0,
    "matplotlib": -2.1,
    "generator/cli": 0.0,
    "generator/viewer": 0.0,
    "generator/identification": -1.7,
    "generator/inverse": 2.3,
    "generator/study": -1.5,
    "generator/comparison": 1.6,
    "generator/conversion.py": 0.85,
    "generator/person": -2.35,
    "generator/hold": -0.6,
    "generator/simulation": -0.9,
    "generator/motion_files": 2.1,
    "generator/model_files": 0.5,
    "generator/kinematics": 0.85,
    "generator/input_files": 0.6,
    "generator/recording.py": 2.05,
    "generator/model.py": -0.85,
    "generator/run_options.py": 0.6,
    "generator/contact": 2.05,
    "generator/geometry": 2.05,
    "generator/passive_curve.py": -2.3,
    "generator/springs_file": -0.9,
    "generator/contact_file": -2.35,
    "generator/toml_file": 0.6,
    "generator/figure_file": 0.6,
    VALUES: 0.6,
    "springs": -1.8,
    "distributed": -2.7,
    "exudyn": -2.75,
    "viser": 2.8,
}
"""Horizontal place of each room; the height follows from the arrows."""


def room_of(name: str) -> str | None:
    """The room of an imported name; None for what the picture leaves out."""
    parts = name.split(".")
    if parts[0] in (*EXTERNAL, "springs", "plots"):
        return parts[0]
    if parts[0] != "generator" or len(parts) == 1:
        return None
    room = f"generator/{parts[1]}"
    return room if (ROOT / room).is_dir() else f"{room}.py" if f"{room}.py" in WHAT else VALUES


def imported_names(source: str) -> Iterator[str]:
    """Every module or name that a source imports, at any depth."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def arrows() -> dict[str, set[str]]:
    """The rooms that each room imports."""
    result: dict[str, set[str]] = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            dotted = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            room = room_of(dotted.removesuffix(".__init__"))
            if room is not None:
                names = imported_names(path.read_text(encoding="utf-8"))
                result.setdefault(room, set()).update(
                    target for name in names if (target := room_of(name)) not in (None, room)
                )
    return result


def description(graph: Mapping[str, set[str]]) -> str:
    """The arrows as text, one room after the other."""
    return "; ".join(f"{room}: {' '.join(sorted(graph[room]))}" for room in sorted(graph))


def drawn_description() -> str:
    """The description within the picture."""
    found = re.search(
        r"<dc:description>(.*?)</dc:description>", PICTURE.read_text(encoding="utf-8"), re.DOTALL
    )
    return found[1] if found else ""


def reachable(graph: Mapping[str, set[str]], room: str) -> set[str]:
    """All rooms that a room imports, directly or not."""
    direct = graph.get(room, set())
    return direct.union(*(reachable(graph, target) for target in direct))


def reduced(graph: Mapping[str, set[str]]) -> dict[str, set[str]]:
    """The arrows without those that follow from others."""
    return {
        room: targets - set().union(*(reachable(graph, target) for target in targets))
        for room, targets in graph.items()
    }


def height(graph: Mapping[str, set[str]], room: str) -> int:
    """Length of the longest way down from a room."""
    return max((1 + height(graph, target) for target in graph.get(room, ())), default=0)


def main() -> None:
    """Draw the picture."""
    import matplotlib as mpl

    mpl.use("Agg")
    mpl.rcParams["svg.hashsalt"] = "architecture"
    mpl.rcParams["svg.fonttype"] = "none"
    import matplotlib.pyplot as plt

    graph = arrows()
    drawn = reduced(graph)
    rooms = sorted(graph.keys() | {target for targets in graph.values() for target in targets})
    place = {room: (COLUMN[room], float(height(graph, room))) for room in rooms}
    users = ("generator/simulation", "plots", "generator/viewer", "generator/study")
    for external, user in zip(EXTERNAL, users, strict=True):
        place[external] = COLUMN[external], place[user][1] - (external == "exudyn")
    picture, axes = plt.subplots(figsize=(9.5, 9.0), dpi=72)  # as SVG is drawn
    boxes = {
        room: axes.text(
            x,
            y,
            f"{room}\n{WHAT[room]}",
            ha="center",
            va="center",
            fontsize=9,
            zorder=2,
            bbox={
                "boxstyle": "round,pad=0.45",
                "facecolor": "#eeeeee" if room in EXTERNAL else "#dce8f4",
                "edgecolor": "0.5",
            },
        )
        for room, (x, y) in place.items()
    }
    axes.set_xlim(-3.1, 3.1)
    axes.set_ylim(-0.6, max(y for _, y in place.values()) + 0.6)
    axes.set_axis_off()
    picture.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=1.0)
    picture.canvas.draw()  # places the boxes, at which arrows end
    for room in rooms:
        for target in sorted(drawn.get(room, ())):
            axes.annotate(
                "",
                xy=place[target],
                xytext=place[room],
                arrowprops={
                    "arrowstyle": "-|>",
                    "color": "0.35",
                    "patchA": boxes[room].get_bbox_patch(),
                    "patchB": boxes[target].get_bbox_patch(),
                    "shrinkA": 0,
                    "shrinkB": 1,
                },
                zorder=1,
            )
    picture.savefig(PICTURE, metadata={"Description": description(graph), "Date": None})


if __name__ == "__main__":
    main()
