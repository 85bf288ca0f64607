//! Buffers that outlive a product. A solve asks for some dozen products of one size; memory fresh from the system each
//! time costs page faults.

use std::sync::{Mutex, PoisonError};

/// Buffers that no task uses at present.
#[derive(Debug, Default)]
pub(super) struct Scratch(Mutex<Vec<Vec<f64>>>);

impl Scratch {
    /// A buffer of `len` zeros.
    pub fn zeros(&self, len: usize) -> Vec<f64> {
        let mut buffer = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        buffer.clear();
        buffer.resize(len, 0.0);
        buffer
    }

    /// Keeps buffers for later.
    pub fn give_back(&self, buffers: impl Iterator<Item = Vec<f64>>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(buffers);
    }
}

impl Clone for Scratch {
    /// Buffers hold nothing worth a copy.
    fn clone(&self) -> Self {
        Self::default()
    }
}
