#!/usr/bin/env python3
"""Time against the number of discontinuity lines kept: k x k tables under one lamp.

    tables.py FOLDER_OF_PROGRAMS [--tables K,K,...] [--order d1|d2] [--max-edge L]

Prints one Markdown row per k: lines kept, elements, CPU seconds, and CPU milliseconds per line and per element.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import tempfile

TABLE_TOP = 0.7
ROOM_HEIGHT = 3.0


def box(low, high, first):
    """Vertices and faces of a box, normals outward."""
    corners = [[(low, high)[bit >> axis & 1][axis] for axis in range(3)] for bit in range(8)]
    rings = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    lines = ["v " + " ".join(map(str, corner)) for corner in corners]
    return lines + ["f " + " ".join(str(first + corner) for corner in ring) for ring in rings]


def scene(k):
    """A floor, a lamp above its middle, and k x k table tops; nothing is commensurate."""
    side = 1.7 * k + 1.3
    half = 0.31
    text = ["mtllib tables.mtl", "usemtl white"]
    text += [f"v {x} {y} 0" for x, y in [(0, 0), (side, 0), (side, side), (0, side)]] + ["f 1 2 3 4"]
    middle = side / 2
    lamp = [(-half, -half), (-half, half), (half, half), (half, -half)]
    text += [f"v {middle + x} {middle + y} {ROOM_HEIGHT}" for x, y in lamp] + ["usemtl lamp", "f 5 6 7 8", "usemtl white"]
    first = 9
    for i in range(k):
        for j in range(k):
            x, y = 1.7 * i + 1.03, 1.7 * j + 0.97
            text += box((x, y, TABLE_TOP - 0.05), (x + 0.83, y + 0.71, TABLE_TOP), first)
            first += 8
    return "\n".join(text) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--tables", default="2,4,8,16")
    parser.add_argument("--order", default="d1")
    parser.add_argument("--max-edge", default="0.5")
    asked = parser.parse_args()
    print("| tables | lines kept | elements | CPU s, all | CPU ms per line | CPU ms per element | phases: lines, triangulate s |")
    print("|---|---|---|---|---|---|---|")
    for k in map(int, asked.tables.split(",")):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "tables.mtl").write_text("newmtl white\nKd .5 .5 .5\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n")
            (folder / "tables.obj").write_text(scene(k))
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            command = [asked.programs / "mesh-tool", "build", folder / "tables.obj", "-o", folder / "s.mesh", "--quiet"]
            command += ["--max-edge", asked.max_edge, "--discontinuity", asked.order]
            subprocess.run([str(word) for word in command], check=True)
            seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
            report = json.loads((folder / "s.mesh.report.json").read_text())
        counters = report["counters"]
        left_out = "skipped: segments merged into others", "skipped: lines of a higher order than asked", "skipped: lines too close to others"
        kept = counters["wedge segments"] - sum(counters[name] for name in left_out)
        phases = [sum(p["seconds"] for p in report["phases"] if p["name"] == name) for name in ("lines", "triangulate")]
        per = [1000 * seconds / kept, 1000 * seconds / counters["elements"]]
        print(f"| {k} x {k} | {kept} | {counters['elements']} | {seconds:.2f} | {per[0]:.2f} | {per[1]:.3f} | {phases[0]:.2f}, {phases[1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
