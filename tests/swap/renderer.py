"""A picture of a solution as VTK holds it, in place of shade-tool: renderer.py render s.sol --mesh s.mesh -o s.exr --camera c.toml

It knows none of our files: solve-tool (found on the path or in RADIOSITY_SOLVE_TOOL) exports a .vtu, and this program casts
a ray for every pixel and interpolates the radiosities of the points it finds there.
"""
import argparse
import base64
import os
import struct
import subprocess
import sys
import tempfile
import tomllib
import xml.etree.ElementTree as xml
import zlib

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from form_factors import first_hits

TYPES = {"Float64": "<f8", "Int64": "<i8", "UInt32": "<u4", "UInt8": "u1"}


def read_vtu(path):
    """Every array of an unstructured grid by its name; those of the cells as `cell NAME`."""
    found = {}
    for part in xml.parse(path).getroot().iter():
        for array in part.findall("DataArray") if part.tag in ("Points", "Cells", "PointData", "CellData") else ():
            content = base64.b64decode(array.text)[8:]
            columns = int(array.get("NumberOfComponents", 1))
            name = ("cell " if part.tag == "CellData" else "") + array.get("Name")
            values = np.frombuffer(content, TYPES[array.get("type")])
            found[name] = values.reshape(-1, columns) if columns > 1 else values
    return found


def rays(camera, size):
    """Directions through the centres of the pixels, row after row from the top left."""
    eye, aim = np.array(camera["eye"], float), np.array(camera["look_at"], float)
    forward = (aim - eye) / np.linalg.norm(aim - eye)
    right = np.cross(forward, np.array(camera.get("up", [0, 1, 0]), float))
    right /= np.linalg.norm(right)
    half = camera["film"][0] / camera["focal_length"] / 2
    x = (2 * (np.arange(size[0]) + 0.5) / size[0] - 1) * half
    y = (1 - 2 * (np.arange(size[1]) + 0.5) / size[1]) * half * size[1] / size[0]
    across, down = np.meshgrid(x, y)
    directions = forward + across.reshape(-1, 1) * right + down.reshape(-1, 1) * np.cross(right, forward)
    return eye, directions / np.linalg.norm(directions, axis=1)[:, None]


def picture(grid, eye, directions):
    """Radiance B / pi of every ray: linear within the triangles of the cells' fans, black from behind."""
    ends = grid["offsets"]
    cells = np.split(grid["connectivity"], ends[:-1])
    corners = np.array([[cell[0], cell[k], cell[k + 1]] for cell in cells for k in range(1, len(cell) - 1)])
    a, b, c = (grid["Points"][corners[:, k]] for k in range(3))
    pixels = np.zeros((len(directions), 3))
    for some in np.array_split(np.arange(len(directions)), max(1, len(directions) // 512)):
        d = directions[some]
        hit, front = first_hits(np.broadcast_to(eye, d.shape), d, a, b - a, c - a, 0.0)
        seen = (hit >= 0) & front
        t, d = hit[seen], d[seen]
        p = np.cross(d, c[t] - a[t])
        determinant = np.einsum("rk,rk->r", b[t] - a[t], p)
        u = np.einsum("rk,rk->r", eye - a[t], p) / determinant
        v = np.einsum("rk,rk->r", d, np.cross(eye - a[t], b[t] - a[t])) / determinant
        at = grid["B"][corners[t]]
        pixels[some[seen]] = (at[:, 0] * (1 - u - v)[:, None] + at[:, 1] * u[:, None] + at[:, 2] * v[:, None]) / np.pi
    return pixels


def write_exr(path, pixels, size):
    """OpenEXR, uncompressed lines of 32-bit floats."""
    text = lambda s: s.encode() + b"\0"
    attribute = lambda name, kind, data: text(name) + text(kind) + struct.pack("<I", len(data)) + data
    channels = b"".join(text(name) + struct.pack("<IIII", 2, 0, 1, 1) for name in "BGR") + b"\0"
    box = struct.pack("<4i", 0, 0, size[0] - 1, size[1] - 1)
    head = b"\x76\x2f\x31\x01\x02\0\0\0" + attribute("channels", "chlist", channels)
    head += attribute("compression", "compression", b"\0") + attribute("dataWindow", "box2i", box)
    head += attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", bytes(8)) + attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    head += b"\0"
    lines = np.ascontiguousarray(pixels.reshape(size[1], size[0], 3)[..., ::-1].swapaxes(1, 2), "<f4")
    bytes_of_line = 8 + 12 * size[0]
    first = len(head) + 8 * size[1]
    with open(path, "wb") as out:
        out.write(head + b"".join(struct.pack("<Q", first + y * bytes_of_line) for y in range(size[1])))
        for y, line in enumerate(lines):
            out.write(struct.pack("<II", y, 12 * size[0]) + line.tobytes())


def write_png(path, pixels, size):
    """sRGB bytes; the brightest hundredth shows as white."""
    shown = np.clip(pixels / max(np.quantile(pixels.max(axis=1), 0.99), 1e-30), 0, 1)
    shown = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
    rows = np.round(255 * shown).astype(np.uint8).reshape(size[1], -1)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    body = b"".join(b"\0" + row.tobytes() for row in rows)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", *size, 8, 2, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b""))


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("command", choices=["render"])
    arguments.add_argument("solution")
    arguments.add_argument("--mesh", required=True)
    arguments.add_argument("-o", "--output", required=True)
    arguments.add_argument("--png")
    arguments.add_argument("--camera", required=True)
    arguments.add_argument("--size")
    arguments.add_argument("--tolerance", type=float, help="taken and not used: what is in the file is shown")
    asked = arguments.parse_args()
    with open(asked.camera, "rb") as file:
        camera = tomllib.load(file)["camera"]
    size = [int(x) for x in asked.size.split("x")] if asked.size else camera["resolution"]
    with tempfile.TemporaryDirectory() as folder:
        vtu = os.path.join(folder, "s.vtu")
        tool = os.environ.get("RADIOSITY_SOLVE_TOOL", "solve-tool")
        subprocess.run([tool, "export", asked.solution, "--mesh", asked.mesh, "-o", vtu], check=True)
        grid = read_vtu(vtu)
    pixels = picture(grid, *rays(camera, size))
    write_exr(asked.output, pixels, size)
    if asked.png:
        write_png(asked.png, pixels, size)


if __name__ == "__main__":
    main()
