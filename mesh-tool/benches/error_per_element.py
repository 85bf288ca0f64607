#!/usr/bin/env python3
"""Error against the number of elements, for four ways of making them.

    error_per_element.py FOLDER_OF_PROGRAMS [SCENE ...] [--elements N,N,...] [--matrix E] [--ways WAY,WAY,...]

Runs mesh, factors and solution for every way, and compares the irradiance that is gathered at the points of
tests/reference with the values there. Prints one table per scene, in Markdown: root mean square of the relative error over
points and channels; where light is weak, relative to a hundredth of the channel's mean.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = {"cornell_blocks": "cornell_blocks.csv", "room": "room.csv", "penumbra": "penumbra_lines.csv"}
CHANNELS = "rgb"
# Name, whether sizes follow the light, lines.
WAYS = [
    ("uniform", False, "off"),
    ("adaptive", True, "off"),
    ("lines d1", False, "d1"),
    ("lines d2", False, "d2"),
    ("both, d1", True, "d1"),
    ("both, d2", True, "d2"),
]


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode not in (0, 3):
        sys.exit(f"{command}: {done.stderr}")


class Chain:
    def __init__(self, programs, scene, folder, matrix):
        self.programs, self.folder, self.matrix = programs, folder, matrix
        self.scene = ROOT / "tests/scenes" / f"{scene}.obj"
        self.points, self.wanted = reference(ROOT / "tests/reference" / SCENES[scene])

    def tool(self, name, *arguments):
        run(self.programs / name, *arguments, "--quiet")

    def file(self, ending):
        return self.folder / f"s.{ending}"

    def build(self, *size, lines):
        self.tool("mesh-tool", "build", self.scene, "-o", self.file("mesh"), "--discontinuity", lines, *size)
        return json.loads(self.file("mesh.report.json").read_text())

    def mesh(self, count, lit, lines):
        """A mesh of about `count` elements; the number it has."""
        even = [] if lit else ["--even"]
        return self.build("--elements", count, *even, lines=lines)["counters"]["elements"]

    def error(self):
        """Root mean square of the relative error."""
        self.tool("formfactor-tool", "compute", self.file("mesh"), "-o", self.file("ff"), "--tolerance", self.matrix)
        self.tool("solve-tool", "solve", self.file("ff"), "--mesh", self.file("mesh"), "-o", self.file("sol"), "--tolerance", self.matrix)
        self.file("points.csv").write_text("x,y,z,nx,ny,nz\n" + "".join(f"{','.join(p)}\n" for p in self.points))
        self.tool("shade-tool", "probe", self.file("sol"), "--mesh", self.file("mesh"), "--points", self.file("points.csv"), "-o", self.file("out.csv"))
        got = [[float(row[f"H_{c}"]) for c in CHANNELS] for row in csv.DictReader(self.file("out.csv").open())]
        means = [sum(w[c] for w in self.wanted) / len(self.wanted) for c in range(3)]
        errors = [
            (g[c] - w[c]) / max(w[c], 0.01 * means[c])
            for g, w in zip(got, self.wanted)
            for c in range(3)
            if w[c + 3] <= 0.02 * w[c]
        ]
        return (sum(e * e for e in errors) / len(errors)) ** 0.5


def reference(path):
    """Points with normals, and irradiance with its standard error, per channel."""
    rows = list(csv.DictReader(path.open()))
    points = [[row["x"], row["y"], row["z"], row.get("nx", "0"), row.get("ny", "1"), row.get("nz", "0")] for row in rows]
    wanted = [[float(row[f"E_{c}"]) for c in CHANNELS] + [float(row.get(f"seE_{c}", 0)) for c in CHANNELS] for row in rows]
    return points, wanted


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--elements", default="500,1000,2000,4000")
    parser.add_argument("--matrix", default="1e-3")
    parser.add_argument("--ways", default=",".join(name.replace(", ", " ") for name, _, _ in WAYS))
    asked = parser.parse_args()
    names = asked.ways.split(",")
    ways = [way for name in names for way in WAYS if way[0].replace(", ", " ") == name]
    counts = [int(n) for n in asked.elements.split(",")]
    for scene in asked.scenes or SCENES:
        print(f"| {scene} | " + " | ".join(f"{n}" for n in counts) + " |")
        print("|---|" + "---|" * len(counts))
        for name, lit, lines in ways:
            cells = []
            for count in counts:
                with tempfile.TemporaryDirectory() as folder:
                    chain = Chain(asked.programs, scene, pathlib.Path(folder), asked.matrix)
                    found = chain.mesh(count, lit, lines)
                    cells.append(f"{100 * chain.error():.2f} % ({found})")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
        print()


if __name__ == "__main__":
    main()
