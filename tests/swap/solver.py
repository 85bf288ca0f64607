"""Radiosity by Jacobi's iteration in numpy, in place of solve-tool: solver.py solve s.ff --mesh s.mesh -o s.sol

B = E + rho H, H = F B, until the power still on its way, divided by 1 - the largest reflectance, is below the tolerance times
the emitted power.
"""
import argparse
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs"))
import radiosity_files as rf


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("command", choices=["solve"])
    arguments.add_argument("matrix")
    arguments.add_argument("-o", "--output", required=True)
    arguments.add_argument("--mesh", required=True)
    arguments.add_argument("--materials")
    arguments.add_argument("--tolerance", type=float, default=1e-6)
    asked = arguments.parse_args()

    mesh, matrix = rf.read(asked.mesh), rf.read(asked.matrix)
    if matrix.record["mesh"] != mesh.digest:
        sys.exit("solver.py: %s was not computed for %s" % (asked.matrix, asked.mesh))
    table = rf.read(asked.materials or os.path.splitext(asked.mesh)[0] + ".materials")
    values = table["values"][[table["names"].index(name) for name in mesh["materials"]]]
    reflectance, exitance = values[rf.element_materials(mesh)][:, 0:3], np.pi * values[rf.element_materials(mesh)][:, 3:6]

    factors, areas = rf.dense(matrix), matrix["areas"][:, None]
    emitted = (areas * exitance).sum(axis=0)
    radiosity, unshot, left = exitance.copy(), exitance.copy(), np.inf
    while left > asked.tolerance:
        unshot = reflectance * (factors @ unshot)
        radiosity += unshot
        power = (areas * unshot).sum(axis=0) / (1 - reflectance.max(axis=0))
        left = (power / np.where(emitted > 0, emitted, np.inf)).max()
    rf.write_solution(asked.output, mesh, matrix, table, radiosity, factors @ radiosity, asked.tolerance, left,
                      "solver.py", ["--tolerance %g" % asked.tolerance], exitance=exitance,
                      row_sums=factors.sum(axis=1))


if __name__ == "__main__":
    main()
