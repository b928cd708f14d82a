"""Bones of imported files in Blender, as JSON: `PYTHON blender_bones.py` with a request as input.

This script runs in the Python that has the module `bpy`, and imports nothing of the project. A
request is a JSON object: `file`, `fps` (a whole number), `first` (the frame of the scene at which
the file's first frame is), `frames` (numbers of frames of the file), and `scale`, metres of a unit
of a BVH file.
"""

import json
import sys
from pathlib import Path
from typing import Any

import bpy


def imported_bones(request: dict[str, Any]) -> dict[str, Any]:
    """Return the version, counts of objects, and poses in the world at rest and in the frames."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = request["fps"]
    path = request["file"]
    if Path(path).suffix == ".bvh":
        bpy.ops.import_anim.bvh(
            filepath=path,
            axis_forward="-Z",
            axis_up="Y",
            global_scale=request["scale"],
            rotate_mode="QUATERNION",
        )
    else:
        bpy.ops.import_scene.gltf(filepath=path)
    armatures = [thing for thing in bpy.data.objects if thing.type == "ARMATURE"]
    armature = armatures[0]
    marks = [thing for thing in bpy.data.objects if thing.type == "EMPTY"]
    meshes = [
        thing for thing in bpy.data.objects if thing.type == "MESH" and thing.parent is not None
    ]
    rest = {
        bone.name: _rows(armature.matrix_world @ bone.matrix_local) for bone in armature.data.bones
    }
    bones: dict[str, list[Any]] = {name: [] for name in rest}
    sites: dict[str, list[Any]] = {mark.name: [] for mark in marks}
    for frame in request["frames"]:
        scene.frame_set(request["first"] + frame)
        for bone in armature.pose.bones:
            bones[bone.name].append(_rows(armature.matrix_world @ bone.matrix))
        for mark in marks:
            sites[mark.name].append(_rows(mark.matrix_world))
    return {
        "version": bpy.app.version_string,
        "armatures": len(armatures),
        "actions": len(bpy.data.actions),
        "meshes": len(meshes),
        "rest": rest,
        "bones": bones,
        "sites": sites,
    }


def _rows(matrix: Any) -> list[list[float]]:
    return [list(row) for row in matrix]


if __name__ == "__main__":
    answer = imported_bones(json.load(sys.stdin))
    print(json.dumps(answer))
