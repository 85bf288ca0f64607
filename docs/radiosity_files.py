"""Reads and writes the files between the radiosity tools with numpy; interchange/FORMAT.md specifies every byte.

    import radiosity_files as rf
    mesh = rf.read("box.mesh")
    mesh["vertices"]                        # (n, 3) float64, mapped: nothing is read before it is used
    rf.corners(mesh, 7)                     # corners of element 7
    matrix = rf.read("box.ff")
    rf.row(matrix, 7)                       # F from element 7 to every other
    rf.factors(matrix)                      # F as a scipy CSR matrix; rf.dense(matrix) as an array
    rf.write_matrix("new.ff", mesh, S)      # any S = diag(A) F: dense array or scipy matrix
    rf.write_solution("new.sol", mesh, matrix, materials, B, H)

A file is a dictionary of its arrays, with `kind`, `record`, `provenance` and `digest` as attributes.
`python3 radiosity_files.py FILE` prints what is in it. Needs Python 3.9 and numpy; scipy for `factors` only.
"""
import hashlib
import os
import struct
import sys
import tempfile
import zlib

import numpy as np

KINDS = {b"MSH": "mesh", b"MAT": "materials", b"FFM": "matrix", b"SOL": "solution"}
RECORDS = {  # field and type, in order
    "mesh": [(name, "I") for name in "vertices elements nodes faces occluders groups materials input_faces".split()],
    "materials": [("materials", "I")],
    "matrix": [("elements", "I"), ("mesh", "digest"), ("precision", "I"), ("symmetric", "?"), ("extended", "?"),
               ("tolerance", "d"), ("part", "I"), ("parts", "I")],
    "solution": [("elements", "I"), ("mesh", "digest"), ("matrix", "digest"), ("materials", "digest"),
                 ("solver", "string"), ("tolerance", "d"), ("achieved", "d")],
}
BLOCK = np.dtype([("row", "<u4"), ("rows", "<u4"), ("column", "<u4"), ("columns", "<u4"), ("code", "<u4"),
                  ("rank", "<u4"), ("offset", "<u8")])
LINK = np.dtype([("first", "<u4"), ("second", "<u4"), ("error", "<f8")])
F8 = np.dtype("<f8")
TYPES = {  # section: type and numbers of an item; every other section is u32
    "vertices": (F8, 3), "lines": (np.dtype("<u4"), 5), "clusters": (np.dtype("<u4"), 4), "hidden_areas": (F8, 1),
    "blocks": (BLOCK, 1), "areas": (F8, 1), "row_errors": (F8, 1), "radiosity": (F8, 3), "irradiance": (F8, 3),
    "history": (F8, 3), "exitance": (F8, 3), "row_sums": (F8, 1), "unshot": (F8, 3), "ambient": (F8, 3),
    "lower": (F8, 3), "upper": (F8, 3), "element_errors": (F8, 3), "error_links": (LINK, 1), "thermal": (F8, 2),
}
DENSE, TRIANGLE, SPARSE = 0, 1, 2


class FormatError(ValueError):
    """A file that is not what it should be."""


class File(dict):
    """Arrays by name; `kind`, `version`, `record`, `provenance`, `digest` (hex) and `path` as attributes."""


# ---- Reading ---------------------------------------------------------------------------------------------------------


def read(path, verify=True):
    """A file with its arrays mapped. `verify=False` leaves out the checksums of the arrays: nothing large is read then."""
    data = np.memmap(path, np.uint8, "r")
    head = bytes(data[:32])
    _need(len(head) == 32 and head[0] == 0x8F and head[4:8] == b"\r\n\x1a\n", path, "not a file of this format")
    _need(head[1:4] in KINDS, path, "an unknown kind of file")
    kind = KINDS[head[1:4]]
    major, minor, length, checksum = struct.unpack_from("<HHII", head, 8)
    _need(major == 1, path, "version %d.%d: only 1.x is known; update this reader" % (major, minor))
    _need(length <= 1 << 20 and 32 + length <= len(data) and not any(head[20:]), path, "the envelope is damaged")
    header = bytes(data[32:32 + length])
    _need(zlib.crc32(header) == checksum, path, "the header is damaged")

    cursor = _Cursor(path, header)
    file = File()
    file.path, file.kind, file.version = path, kind, (major, minor)
    file.digest = hashlib.sha256(head + header).hexdigest()
    file.provenance = {"tool": cursor.string(), "version": cursor.string()}
    file.provenance["flags"] = [cursor.string() for _ in range(cursor.number("Q"))]
    file.provenance["inputs"] = {cursor.string(): cursor.take(32).hex() for _ in range(cursor.number("Q"))}
    sections = [(cursor.string(), cursor.number("Q"), cursor.number("Q"), cursor.number("I"))
                for _ in range(cursor.number("Q"))]
    readers = {"digest": lambda: cursor.take(32).hex(), "string": cursor.string}
    file.record = {name: readers.get(code, lambda: cursor.number(code))() for name, code in RECORDS[kind]}
    _need(cursor.at == length, path, "the header has bytes left over")

    end = 32 + length
    for name, offset, size, checksum in sections:
        _need(name not in file and offset == -(-end // 64) * 64 and offset + size <= len(data), path, name + " is misplaced")
        content = data[offset:offset + size]
        _need(not verify or zlib.crc32(content) == checksum, path, name + " is damaged")
        file[name] = _array(path, file, name, content)
        end = offset + size
    _need(end == len(data), path, "bytes are left over at the end")
    return file


def corners(mesh, element):
    """Corners of an element, counter-clockwise seen from its front: (k, 3)."""
    start, end = mesh["element_starts"][element:element + 2]
    return mesh["vertices"][mesh["element_corners"][start:end]]


def polygons(mesh, of="element"):
    """Corners of all elements, faces or occluders."""
    starts, flat = mesh[of + "_starts"], mesh["vertices"][mesh[of + "_corners"]]
    return [flat[a:b] for a, b in zip(starts[:-1], starts[1:])]


def vector_areas(polygons):
    """Area times unit normal of each polygon: (n, 3)."""
    return np.array([0.5 * np.cross(p[1:-1] - p[0], p[2:] - p[0]).sum(axis=0) for p in polygons])


def element_materials(mesh):
    """Material number of each element."""
    return mesh["face_materials"][mesh["element_faces"]]


def blocks(matrix):
    """Rows, columns and entries S of every block: two slices and a dense array (of a triangle the upper half)."""
    _need(matrix.record["parts"] == 1, matrix.path, "a part of a matrix: put the parts together with formfactor-tool merge")
    values, sparse, at = matrix["values"], matrix.get("sparse"), 0
    for block in matrix["blocks"]:
        row, m, column, n, code, rank, offset = (int(x) for x in block)
        if code == DENSE:
            entries = values[offset:offset + m * n].reshape(m, n)
        elif code == TRIANGLE:
            entries = np.zeros((m, m), values.dtype)
            entries[np.triu_indices(m)] = values[offset:offset + m * (m + 1) // 2]
        elif code == SPARSE:
            starts, columns = sparse[at:at + m + 1], sparse[at + m + 1:at + m + 1 + rank]
            at += m + 1 + rank
            entries = np.zeros((m, n), values.dtype)
            entries[np.repeat(np.arange(m), np.diff(starts.astype(np.int64))), columns] = values[offset:offset + rank]
        else:
            raise FormatError("%s: storage %d is not known; update this reader" % (matrix.path, code))
        yield slice(row, row + m), slice(column, column + n), entries


def row(matrix, element):
    """F from one element to every other, from the mapped file."""
    found = np.zeros(matrix.record["elements"])
    for rows, columns, entries in blocks(matrix):
        if rows.start <= element < rows.stop:
            found[columns] += entries[element - rows.start]
        if matrix.record["symmetric"] and columns.start <= element < columns.stop:
            found[rows] += entries[:, element - columns.start]
            if rows.start <= element < rows.stop:  # on the diagonal both visits met the entry to itself
                found[element] -= entries[element - rows.start, element - columns.start]
    return found / matrix["areas"][element]


def dense(matrix):
    """F as an array, n x n float64."""
    n = matrix.record["elements"]
    exchange = np.zeros((n, n))
    for rows, columns, entries in blocks(matrix):
        exchange[rows, columns] = entries
        if matrix.record["symmetric"]:
            if rows == columns:
                exchange[rows, columns] += np.triu(entries, 1).T
            else:
                exchange[columns, rows] = entries.T
    return exchange / matrix["areas"][:, None]


def factors(matrix):
    """F as a scipy CSR matrix."""
    import scipy.sparse
    n = matrix.record["elements"]
    parts = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
    for rows, columns, entries in blocks(matrix):
        i, j = np.nonzero(entries)
        values = entries[i, j].astype(float)
        i, j = i + rows.start, j + columns.start
        parts.append((i, j, values))
        if matrix.record["symmetric"]:
            parts.append((j[i != j], i[i != j], values[i != j]))
    i, j, values = (np.concatenate(list(part)) for part in zip(*parts))
    return scipy.sparse.csr_matrix((values / matrix["areas"][i], (i, j)), shape=(n, n))


# ---- Writing ---------------------------------------------------------------------------------------------------------


def write_mesh(path, arrays, groups, materials, input_faces, tool="numpy", flags=(), inputs=None):
    """A mesh. `arrays`: the sections of FORMAT.md, section 3, without names; those left out are empty or follow from others."""
    count = len(arrays["element_starts"]) - 1
    sections = {"lines": np.zeros((0, 5), "<u4"), "clusters": np.array([[0, count, 0, 0]]),
                "element_sides": np.zeros(count), **arrays}
    sections = {name: np.ascontiguousarray(a, TYPES.get(name, ("<u4", 1))[0]) for name, a in sections.items()}
    record = struct.pack("<8I", len(sections["vertices"]), count, len(sections["node_vertices"]),
                         len(sections["face_starts"]) - 1, len(sections["occluder_starts"]) - 1, len(groups),
                         len(materials), input_faces)
    sections.update(groups=_names(groups), materials=_names(materials))
    _write(path, b"MSH", record, sections, tool, flags, inputs or {})


def write_matrix(path, mesh, exchange, row_errors=None, tolerance=0.0, tool="numpy", flags=(), size=256):
    """A symmetric matrix S = diag(A) F of a mesh that `read` gave, in blocks of `size` rows; blocks of zeros are left out."""
    n = mesh.record["elements"]
    areas = np.linalg.norm(vector_areas(polygons(mesh)), axis=1)
    values, listed, offset, sums = [], [], 0, np.zeros(n)
    for a in range(0, n, size):
        for b in range(a, n, size):
            part = exchange[a:a + size, b:b + size]
            part = np.asarray(part.todense() if hasattr(part, "todense") else part, F8)
            if not part.any():
                continue
            stored = part[np.triu_indices(len(part))] if a == b else part.ravel()
            listed.append((a, part.shape[0], b, part.shape[1], TRIANGLE if a == b else DENSE, 0, offset))
            values.append(stored)
            offset += len(stored)
            sums[a:a + size] += part.sum(axis=1)
            if a != b:
                sums[b:b + size] += part.sum(axis=0)
    sections = {"areas": areas, "values": np.concatenate(values) if values else np.zeros(0),
                "blocks": np.array(listed, BLOCK), "row_errors": np.zeros(n) if row_errors is None else row_errors,
                "sparse": np.zeros(0, "<u4"), "row_sums": sums / areas}
    sections = {name: np.ascontiguousarray(a, F8) if a.dtype.kind == "f" else a for name, a in sections.items()}
    record = struct.pack("<I32sI??dII", n, bytes.fromhex(mesh.digest), 1, True, False, tolerance, 0, 1)
    _write(path, b"FFM", record, sections, tool, flags, {"mesh": mesh.digest})


def write_solution(path, mesh, matrix, materials, radiosity, irradiance, tolerance=0.0, achieved=0.0, tool="numpy",
                   flags=(), **details):
    """A solution; `details` are optional sections such as exitance=..., row_sums=... (FORMAT.md, section 6)."""
    solver = tool.encode()
    digests = [file.digest for file in (mesh, matrix, materials)]
    record = struct.pack("<I", len(radiosity)) + b"".join(bytes.fromhex(d) for d in digests)
    record += struct.pack("<Q", len(solver)) + solver + struct.pack("<dd", tolerance, achieved)
    sections = {"radiosity": radiosity, "irradiance": irradiance, "history": np.zeros((0, 3)), **details}
    sections = {name: np.ascontiguousarray(a, F8) for name, a in sections.items()}
    _write(path, b"SOL", record, sections, tool, flags, dict(zip(("mesh", "matrix", "materials"), digests)))


def _write(path, letters, record, sections, tool, flags, inputs):
    text = lambda s: struct.pack("<Q", len(s.encode())) + s.encode()
    head = text(tool) + text("1") + struct.pack("<Q", len(flags)) + b"".join(map(text, flags))
    head += struct.pack("<Q", len(inputs)) + b"".join(text(role) + bytes.fromhex(d) for role, d in inputs.items())
    head += struct.pack("<Q", len(sections))
    contents = [np.ascontiguousarray(content).tobytes() for content in sections.values()]
    end = 32 + len(head) + sum(8 + len(name.encode()) + 20 for name in sections) + len(record)
    body = b""
    for name, content in zip(sections, contents):
        padding = -end % 64
        head += text(name) + struct.pack("<QQI", end + padding, len(content), zlib.crc32(content))
        body += b"\0" * padding + content
        end += padding + len(content)
    header = head + record
    envelope = b"\x8f" + letters + b"\r\n\x1a\n" + struct.pack("<HHII", 1, 1, len(header), zlib.crc32(header)) + bytes(12)
    # Beside the target and renamed, so that nobody sees half a file.
    handle, partial = tempfile.mkstemp(dir=os.path.dirname(os.path.abspath(path)))
    with os.fdopen(handle, "wb") as out:
        out.write(envelope + header + body)
    os.chmod(partial, 0o644)
    os.replace(partial, path)


# ---- Bytes -----------------------------------------------------------------------------------------------------------


class _Cursor:
    def __init__(self, path, data):
        self.path, self.data, self.at = path, data, 0

    def take(self, count):
        _need(count <= len(self.data) - self.at, self.path, "the header ends too early")
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, code):
        return struct.unpack("<" + code, self.take(struct.calcsize("<" + code)))[0]

    def string(self):
        return self.take(self.number("Q")).decode("utf-8")


def _array(path, file, name, content):
    if (file.kind, name) in (("mesh", "groups"), ("mesh", "materials"), ("materials", "names")):
        count = file.record["materials" if name == "names" else name]
        lengths = np.frombuffer(content, "<u4", count)
        text, at = bytes(content[4 * count:]), np.concatenate([[0], np.cumsum(lengths)]).astype(int)
        return [text[a:b].decode("utf-8") for a, b in zip(at[:-1], at[1:])]
    item, columns = TYPES.get(name, (np.dtype("<u4"), 1))
    if (file.kind, name) == ("materials", "values"):
        item, columns = F8, 18
    if (file.kind, name) == ("matrix", "values"):
        item = np.dtype("<f8" if file.record["precision"] == 1 else "<f4")
    _need(len(content) % (item.itemsize * columns) == 0, path, name + " has an odd length")
    array = content.view(item) if len(content) else np.zeros(0, item)
    return array.reshape(-1, columns) if columns > 1 else array


def _names(names):
    data = [name.encode() for name in names]
    return np.frombuffer(struct.pack("<%dI" % len(data), *map(len, data)) + b"".join(data), np.uint8)


def _need(condition, path, message):
    if not condition:
        raise FormatError("%s: %s" % (path, message))


def main():
    file = read(sys.argv[1])
    print(file.kind, file.digest[:12], "by", file.provenance["tool"], *file.provenance["flags"])
    for name, value in file.record.items():
        print("  %-12s %s" % (name, value))
    for name, array in file.items():
        print("  %-20s %s" % (name, array if isinstance(array, list) else "%s %s" % (array.dtype, array.shape)))


if __name__ == "__main__":
    main()
