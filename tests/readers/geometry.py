"""Reads exported geometry with other people's libraries: geometry.py MESHIO_FILES... -- TRIMESH_FILES...

One line of JSON for each file: number of cells, area, and the names of the fields of cells and points.
"""

import json
import sys

import meshio
import numpy as np
import trimesh


def area_of_cells(mesh):
    total = 0.0
    # meshio takes the colours in an OBJ, which stand behind the coordinates, for more of them.
    points = mesh.points[:, :3]
    for cells in mesh.cells:
        corners = points[cells.data]
        first = corners[:, 0]
        for k in range(1, corners.shape[1] - 1):
            cross = np.cross(corners[:, k] - first, corners[:, k + 1] - first)
            total += 0.5 * np.linalg.norm(cross, axis=1).sum()
    return total


def with_meshio(path):
    mesh = meshio.read(path)
    return {
        "cells": sum(len(cells.data) for cells in mesh.cells),
        "area": area_of_cells(mesh),
        "cell_fields": sorted(mesh.cell_data),
        "point_fields": sorted(mesh.point_data),
    }


def with_trimesh(path):
    mesh = trimesh.load(path, force="mesh")
    return {"cells": len(mesh.faces), "area": float(mesh.area)}


split = sys.argv.index("--")
for path in sys.argv[1:split]:
    print(json.dumps(with_meshio(path)))
for path in sys.argv[split + 1 :]:
    print(json.dumps(with_trimesh(path)))
