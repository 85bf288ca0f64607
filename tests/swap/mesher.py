"""Even grids on every face, in place of mesh-tool: mesher.py build scene.obj -o s.mesh [--elements N]

Quadrilaterals are cut into k x k quadrilaterals, triangles into k x k triangles, with one k for all faces of a size; nothing
is cut where blocks touch the floor or where light jumps. Colours are mesh-tool's business (`materials`), which is found on
the path or in RADIOSITY_MESH_TOOL.
"""
import argparse
import os
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs"))
import radiosity_files as rf


def read_obj(path):
    """Vertices, and group, material and corners of every face; polygons are taken as they stand."""
    vertices, faces, group, material = [], [], "(none)", "(none)"
    for line in open(path, encoding="utf-8"):
        word, _, rest = line.split("#")[0].strip().partition(" ")
        if word == "v":
            vertices.append([float(x) for x in rest.split()[:3]])
        elif word in ("g", "o"):
            group = rest.strip()
        elif word == "usemtl":
            material = rest.strip()
        elif word == "f":
            numbers = [int(corner.split("/")[0]) for corner in rest.split()]
            faces.append((group, material, [n - 1 if n > 0 else len(vertices) + n for n in numbers]))
    return np.array(vertices), faces


def pieces(corners):
    """A face as plane triangles and quadrilaterals."""
    normal = rf.vector_areas([corners])[0]
    height = abs((corners - corners[0]) @ normal).max() / np.linalg.norm(normal)
    if len(corners) == 4 and height <= 1e-9 * np.ptp(corners, axis=0).max():
        return [corners]
    return [corners[[0, k, k + 1]] for k in range(1, len(corners) - 1)]


def grid(corners, k):
    """Points and cells of a face cut k times along each side."""
    steps = np.arange(k + 1) / k
    if len(corners) == 4:
        a, b, c, d = corners
        s, t = np.meshgrid(steps, steps)
        s, t = s[..., None], t[..., None]
        points = ((1 - s) * (1 - t) * a + s * (1 - t) * b + s * t * c + (1 - s) * t * d).reshape(-1, 3)
        at = lambda i, j: j * (k + 1) + i
        cells = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for j in range(k) for i in range(k)]
        return points, cells
    a, b, c = corners
    places = {(i, j): n for n, (i, j) in enumerate((i, j) for j in range(k + 1) for i in range(k + 1 - j))}
    points = np.array([a + (b - a) * i / k + (c - a) * j / k for i, j in places])
    cells = [[places[i, j], places[i + 1, j], places[i, j + 1]] for j in range(k) for i in range(k - j)]
    cells += [[places[i + 1, j], places[i + 1, j + 1], places[i, j + 1]] for j in range(k) for i in range(k - j - 1)]
    return points, cells


def flat(rows):
    return np.cumsum([0] + [len(row) for row in rows]), np.array([x for row in rows for x in row])


def build(scene, output, elements):
    vertices, faces = read_obj(scene)
    table = rf.read(os.path.splitext(output)[0] + ".materials")
    if table["values"][:, 17].any():
        sys.exit("mesher.py: two-sided materials are not known here")
    groups = list(dict.fromkeys(group for group, _, _ in faces))
    plane = [(number, piece) for number, (_, _, corners) in enumerate(faces) for piece in pieces(vertices[corners])]
    areas = np.linalg.norm(rf.vector_areas([piece for _, piece in plane]), axis=1)
    cuts = np.maximum(1, np.round(np.sqrt(elements * areas / areas.sum()))).astype(int)

    points, cells, of_face, corners = [], [], [], []
    for face, ((_, piece), k) in enumerate(zip(plane, cuts)):
        new, cut = grid(piece, k)
        first = len(points)
        points.extend(new)
        cells.extend([[first + c for c in cell] for cell in cut])
        of_face.extend([face] * len(cut))
        ends = [0, k, (k + 1) ** 2 - 1, k * (k + 1)] if len(piece) == 4 else [0, k, len(new) - 1]
        corners.append([first + c for c in ends])
    material = [table["names"].index(faces[number][1]) for number, _ in plane]
    starts, flat_cells = flat(cells)
    face_starts, face_corners = flat(corners)
    arrays = {
        "vertices": np.array(points), "node_vertices": np.arange(len(points)),
        "element_starts": starts, "element_corners": flat_cells,
        "element_node_starts": starts, "element_nodes": flat_cells, "element_faces": np.array(of_face),
        "face_starts": face_starts, "face_corners": face_corners,
        "face_inputs": np.array([number for number, _ in plane]),
        "face_groups": np.array([groups.index(faces[number][0]) for number, _ in plane]),
        "face_materials": np.array(material), "face_flags": (table["values"][material, 3:6] > 0).any(axis=1),
        "occluder_starts": face_starts, "occluder_corners": face_corners, "occluder_faces": np.arange(len(plane)),
    }
    rf.write_mesh(output, arrays, groups, table["names"], len(faces), "mesher.py", ["--elements %d" % elements])


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("command", choices=["materials", "build"])
    arguments.add_argument("scene")
    arguments.add_argument("-o", "--output", required=True)
    arguments.add_argument("--elements", type=int, default=300)
    arguments.add_argument("--depfile")
    asked = arguments.parse_args()
    ours = [os.environ.get("RADIOSITY_MESH_TOOL", "mesh-tool"), "materials", asked.scene]
    table = os.path.splitext(asked.output)[0] + ".materials"
    depfile = ["--depfile", asked.depfile] if asked.depfile else []
    subprocess.run(ours + ["-o", asked.output if asked.command == "materials" else table] + depfile, check=True)
    if asked.command == "build":
        build(asked.scene, asked.output, asked.elements)


if __name__ == "__main__":
    main()
