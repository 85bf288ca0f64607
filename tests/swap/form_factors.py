"""Form factors by ray tracing, in place of formfactor-tool: form_factors.py compute s.mesh -o s.ff [--rays N]

From random points of each element rays leave with the cosine's density (Malley's method: points of the unit disk, raised to
the hemisphere); F_ij is the part of them that meets the front of element j first. The standard deviation of a factor is
sqrt(F (1 - F) / N); both sides of a pair are averaged.
"""
import argparse
import os
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs"))
import radiosity_files as rf


def triangles_of(polygons):
    """Corner, two edges and polygon of each triangle: polygons are convex, so fans cover them."""
    fans = [(i, p[0], p[k] - p[0], p[k + 1] - p[0]) for i, p in enumerate(polygons) for k in range(1, len(p) - 1)]
    return (np.array(column) for column in zip(*fans))


def first_hits(origins, directions, a, u, v, tiny):
    """Triangle that each ray meets first and whether it meets its front (Moeller & Trumbore 1997); -1 where none."""
    p = np.cross(directions[:, None], v[None])
    determinant = np.einsum("tk,rtk->rt", u, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origins[:, None] - a[None]
        x = np.einsum("rtk,rtk->rt", s, p) / determinant
        q = np.cross(s, u[None])
        y = np.einsum("rk,rtk->rt", directions, q) / determinant
        distance = np.einsum("tk,rtk->rt", v, q) / determinant
    distance[~((x >= 0) & (y >= 0) & (x + y <= 1) & (distance > tiny))] = np.inf
    # Both sides of a two-sided face lie in one place: the one that looks at the ray is met.
    nearest = np.argmin(np.where(determinant > 0, distance, distance * (1 + 1e-9)), axis=1)
    rays = np.arange(len(origins))
    return np.where(np.isfinite(distance[rays, nearest]), nearest, -1), determinant[rays, nearest] > 0


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("command", choices=["compute"])
    arguments.add_argument("mesh")
    arguments.add_argument("-o", "--output", required=True)
    arguments.add_argument("--rays", type=int, default=1024)
    arguments.add_argument("--tolerance", type=float, default=0.0)
    asked = arguments.parse_args()

    mesh = rf.read(asked.mesh)
    polygons = rf.polygons(mesh)
    owner, a, u, v = triangles_of(polygons)
    n, rays, random = len(polygons), asked.rays, np.random.default_rng(1)
    tiny = 1e-9 * np.ptp(mesh["vertices"], axis=0).max()
    areas = rf.vector_areas(polygons)
    factors = np.zeros((n, n))
    for i in range(n):
        own = np.flatnonzero(owner == i)
        chosen = own[random.choice(len(own), rays, p=_shares(u[own], v[own]))]
        s, t = random.random((2, rays, 1))
        flip = s + t > 1
        s, t = np.where(flip, 1 - s, s), np.where(flip, 1 - t, t)
        origins = a[chosen] + s * u[chosen] + t * v[chosen]
        normal = areas[i] / np.linalg.norm(areas[i])
        across = np.cross(normal, np.eye(3)[np.argmin(abs(normal))])
        across /= np.linalg.norm(across)
        radius, angle = np.sqrt(random.random((rays, 1))), 2 * np.pi * random.random((rays, 1))
        directions = radius * (np.cos(angle) * across + np.sin(angle) * np.cross(normal, across))
        directions += np.sqrt(1 - radius**2) * normal
        hit, front = first_hits(origins, directions, a, u, v, tiny)
        factors[i] = np.bincount(owner[hit[(hit >= 0) & front]], minlength=n) / rays
    exchange = np.linalg.norm(areas, axis=1)[:, None] * factors
    errors = np.sqrt(factors * (1 - factors) / rays).sum(axis=1)
    rf.write_matrix(asked.output, mesh, (exchange + exchange.T) / 2, errors, asked.tolerance, "form_factors.py",
                    ["--rays %d" % rays])


def _shares(u, v):
    areas = np.linalg.norm(np.cross(u, v), axis=1)
    return areas / areas.sum()


if __name__ == "__main__":
    main()
