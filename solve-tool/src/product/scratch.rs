//! Buffers that outlive a product. A solve asks for some dozen products of one size; memory fresh from the system each
//! time costs page faults. They begin at cache lines, so that no chunk of the kernel lies in two.

use crate::kernel::LANES;
use bytemuck::{Pod, Zeroable};
use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// A cache line of numbers.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Chunk([f64; LANES]);

/// Numbers in whole cache lines.
#[derive(Debug, Default)]
pub(super) struct Buffer(Vec<Chunk>);

impl Deref for Buffer {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        bytemuck::cast_slice(&self.0)
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

/// Buffers that no task uses at present.
#[derive(Debug, Default)]
pub(super) struct Scratch(Mutex<Vec<Buffer>>);

impl Scratch {
    /// A buffer of at least `len` zeros.
    pub fn zeros(&self, len: usize) -> Buffer {
        let mut buffer = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        buffer.0.clear();
        buffer.0.resize(len.div_ceil(LANES), Chunk::zeroed());
        buffer
    }

    /// A buffer that begins with `values`.
    pub fn copy(&self, values: &[f64]) -> Buffer {
        let mut buffer = self.zeros(values.len());
        buffer[..values.len()].copy_from_slice(values);
        buffer
    }

    /// Keeps buffers for later.
    pub fn give_back(&self, buffers: impl Iterator<Item = Buffer>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(buffers);
    }
}

impl Clone for Scratch {
    /// Buffers hold nothing worth a copy.
    fn clone(&self) -> Self {
        Self::default()
    }
}
