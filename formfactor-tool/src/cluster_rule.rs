//! Whole clusters that see each other from afar: all their pairs from one interpolated kernel.

use crate::scene::{Cluster, Scene};
use geometry::cluster_kernel::{Basis, Kernel, ORDERS};
use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Fewer pairs than these are served faster one by one.
const FEWEST_PAIRS: usize = 36;
/// An order whose kernels are more than this many times the pairs is not worth its time.
const KERNELS_PER_PAIR: usize = 8;
/// The error of order p over the mean kernel is about q^3 (DECAY q)^(p - 3), q the sizes over the distance (a cube of 2400
/// squares): orders for which that is more than [`HOPE`] times what is asked are not tried.
const DECAY: f64 = 0.2;
const HOPE: f64 = 4.0;
/// Below this relative error elements within rounding of their cluster's plane may count.
const TIGHTEST: f64 = 1e-7;

/// Bases of the clusters, made when they are first needed.
#[derive(Debug)]
pub struct ClusterRule {
    bases: Vec<[OnceLock<Box<Basis>>; ORDERS.len()]>,
    /// Bytes of those that are kept, and the most that may be; others are made anew each time, with the same bits.
    kept: AtomicUsize,
    allowed: AtomicUsize,
    /// Error of a row's factors over their sum.
    relative: f64,
}

impl ClusterRule {
    /// For the clusters of a scene; `None` where the error asked is too small.
    pub fn new(scene: &Scene, relative: f64) -> Option<Self> {
        (relative >= TIGHTEST).then(|| {
            let bases = scene.clusters.iter().map(|_| Default::default()).collect();
            Self { bases, kept: AtomicUsize::new(0), allowed: AtomicUsize::new(0), relative }
        })
    }

    /// Allows so many bytes for bases that are kept.
    pub fn allow(&self, bytes: usize) {
        self.allowed.store(bytes, Relaxed);
    }

    /// The exchange factors of all pairs of two clusters, each wholly in front of the other, row after row into `values`, and
    /// the error of each per area of both patches; `None` where the clusters are too near or too small.
    pub fn block(
        &self,
        scene: &Scene,
        (first, second): (&Cluster, &Cluster),
        values: &mut Vec<f64>,
    ) -> Option<f64> {
        let pairs = first.len() * second.len();
        let middle = |cluster: &Cluster| 0.5 * (cluster.hull[0] + cluster.hull[2]);
        if pairs < FEWEST_PAIRS || first.hull.len() != 4 || second.hull.len() != 4 {
            return None;
        }
        let nearness = (first.radius + second.radius) / (middle(first) - middle(second)).length();
        let expected = |order: usize| nearness.powi(3) * (DECAY * nearness).powi(order as i32 - 3);
        let hopeful = |order: usize| nearness < 1.0 && expected(order) <= HOPE * self.relative;
        for (at, &order) in ORDERS.iter().enumerate() {
            if order.pow(4) > KERNELS_PER_PAIR * pairs {
                return None;
            }
            if hopeful(order) {
                let (p, q) = (self.basis(scene, first, at)?, self.basis(scene, second, at)?);
                let kernel: Kernel = p.kernel(&q)?;
                if kernel.error <= self.relative * kernel.mean {
                    p.exchange(&q, &kernel, values);
                    return Some(kernel.error);
                }
            }
        }
        None
    }

    /// Whether parts of two clusters may have enough pairs.
    pub fn is_worth_splitting(&self, first: &Cluster, second: &Cluster) -> bool {
        first.len() * second.len() >= 2 * FEWEST_PAIRS
    }

    fn basis(&self, scene: &Scene, cluster: &Cluster, at: usize) -> Option<Cow<'_, Basis>> {
        let place = &self.bases[cluster.number][at];
        if let Some(basis) = place.get() {
            return Some(Cow::Borrowed(basis));
        }
        let corners: [_; 4] = cluster.hull.as_slice().try_into().ok()?;
        let patches = scene.patches[cluster.range.clone()].iter().map(|p| p.corners.as_slice());
        let basis = Basis::new(corners, cluster.plane?.normal, patches, ORDERS[at]);
        if self.kept.fetch_add(basis.bytes(), Relaxed) + basis.bytes() > self.allowed.load(Relaxed) {
            self.kept.fetch_sub(basis.bytes(), Relaxed);
            return Some(Cow::Owned(basis));
        }
        Some(Cow::Borrowed(place.get_or_init(|| Box::new(basis))))
    }
}
