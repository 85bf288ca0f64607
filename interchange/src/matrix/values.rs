//! Entries in the precision in which they are stored.

use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Storage of the entries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Precision {
    /// 32-bit entries.
    F32,
    /// 64-bit entries.
    F64,
}

impl Precision {
    /// Bytes of an entry.
    pub fn bytes(self) -> usize {
        match self {
            Precision::F32 => size_of::<f32>(),
            Precision::F64 => size_of::<f64>(),
        }
    }

    /// What a person calls it.
    pub fn name(self) -> &'static str {
        match self {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }
}

/// Entries in their stored precision.
#[derive(Debug, Clone, Copy)]
pub enum Values<'a> {
    /// 32-bit.
    F32(&'a [f32]),
    /// 64-bit.
    F64(&'a [f64]),
}

impl<'a> Values<'a> {
    /// The first `count` numbers packed into words.
    pub(super) fn of_words(words: &'a [u64], count: usize, precision: Precision) -> Self {
        match precision {
            Precision::F32 => Values::F32(&bytemuck::cast_slice(words)[..count]),
            Precision::F64 => Values::F64(&bytemuck::cast_slice(words)[..count]),
        }
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        match self {
            Values::F32(v) => v.len(),
            Values::F64(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Entry `i`.
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Values::F32(v) => f64::from(v[i]),
            Values::F64(v) => v[i],
        }
    }

    /// Some of them.
    pub fn slice(&self, range: Range<usize>) -> Values<'a> {
        match self {
            Values::F32(v) => Values::F32(&v[range]),
            Values::F64(v) => Values::F64(&v[range]),
        }
    }

    /// How they are stored.
    pub fn precision(&self) -> Precision {
        match self {
            Values::F32(_) => Precision::F32,
            Values::F64(_) => Precision::F64,
        }
    }

    /// Their bytes.
    pub fn bytes(&self) -> &'a [u8] {
        match self {
            Values::F32(v) => bytemuck::cast_slice(v),
            Values::F64(v) => bytemuck::cast_slice(v),
        }
    }
}
