//! Numbers and vectors of several receiver points side by side: plain loops over arrays, which the compiler turns into wide
//! registers where the calling function is compiled for them. No operation is fused, so every width gives the same bytes.

use glam::DVec3;

/// Points looked at together: a register of AVX-512, two of AVX2.
pub const LANES: usize = 8;

/// One number per point.
pub type Lane = [f64; LANES];

/// One vector per point.
#[derive(Debug, Clone, Copy)]
pub struct Vectors {
    /// First coordinates.
    pub x: Lane,
    /// Second coordinates.
    pub y: Lane,
    /// Third coordinates.
    pub z: Lane,
}

/// `of` for every lane.
#[inline(always)]
pub fn lanes(of: impl Fn(usize) -> f64) -> Lane {
    [of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)]
}

/// Whether `of` holds in every lane.
#[inline(always)]
pub fn all(of: impl Fn(usize) -> bool) -> bool {
    let mut holds = true;
    for k in 0..LANES {
        holds &= of(k);
    }
    holds
}

/// Number of lanes in which `of` holds.
#[inline(always)]
pub fn count(of: impl Fn(usize) -> bool) -> usize {
    let mut number = 0;
    for k in 0..LANES {
        number += usize::from(of(k));
    }
    number
}

impl Vectors {
    /// Zero in every lane.
    pub const ZERO: Vectors = Vectors { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };

    /// `place` seen from each of the points.
    #[inline(always)]
    pub fn seen_from(place: DVec3, points: &[DVec3; LANES]) -> Vectors {
        Vectors {
            x: lanes(|k| place.x - points[k].x),
            y: lanes(|k| place.y - points[k].y),
            z: lanes(|k| place.z - points[k].z),
        }
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub fn same(v: DVec3) -> Vectors {
        Vectors { x: [v.x; LANES], y: [v.y; LANES], z: [v.z; LANES] }
    }

    /// Scalar products.
    #[inline(always)]
    pub fn dot(&self, o: &Vectors) -> Lane {
        lanes(|k| self.x[k] * o.x[k] + self.y[k] * o.y[k] + self.z[k] * o.z[k])
    }

    /// Scalar products with one vector.
    #[inline(always)]
    pub fn along(&self, n: DVec3) -> Lane {
        lanes(|k| n.x * self.x[k] + n.y * self.y[k] + n.z * self.z[k])
    }

    /// Vector products.
    #[inline(always)]
    pub fn cross(&self, o: &Vectors) -> Vectors {
        Vectors {
            x: lanes(|k| self.y[k] * o.z[k] - self.z[k] * o.y[k]),
            y: lanes(|k| self.z[k] * o.x[k] - self.x[k] * o.z[k]),
            z: lanes(|k| self.x[k] * o.y[k] - self.y[k] * o.x[k]),
        }
    }

    /// self - o.
    #[inline(always)]
    pub fn minus(&self, o: &Vectors) -> Vectors {
        Vectors {
            x: lanes(|k| self.x[k] - o.x[k]),
            y: lanes(|k| self.y[k] - o.y[k]),
            z: lanes(|k| self.z[k] - o.z[k]),
        }
    }

    /// self + t d.
    #[inline(always)]
    pub fn plus(&self, t: &Lane, d: &Vectors) -> Vectors {
        Vectors {
            x: lanes(|k| self.x[k] + t[k] * d.x[k]),
            y: lanes(|k| self.y[k] + t[k] * d.y[k]),
            z: lanes(|k| self.z[k] + t[k] * d.z[k]),
        }
    }

    /// `o` in the lanes that `takes` names.
    #[inline(always)]
    pub fn replace(&mut self, o: &Vectors, takes: impl Fn(usize) -> bool) {
        self.x = lanes(|k| if takes(k) { o.x[k] } else { self.x[k] });
        self.y = lanes(|k| if takes(k) { o.y[k] } else { self.y[k] });
        self.z = lanes(|k| if takes(k) { o.z[k] } else { self.z[k] });
    }
}
