//! Index newtypes: a row of the matrix cannot be asked for with the number of a vertex.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable, Serialize, Deserialize)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// As an index into the array it counts.
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// From an index into the array it counts. Files hold at most 2^32 - 1 of anything.
            pub fn new(index: usize) -> Self {
                debug_assert!(index < u32::MAX as usize, "index {index} does not fit 32 bits");
                Self(index as u32)
            }
        }
    };
}

id!(
    /// A vertex of the mesh: a place in space.
    VertexId
);
id!(
    /// A node: a place where radiosity is interpolated from; several may share one vertex.
    NodeId
);
id!(
    /// An element: one unknown, one row of the matrix; numbered in cluster order.
    ElementId
);
id!(
    /// A planar face of the cleaned scene: what blocks light.
    FaceId
);
id!(
    /// A group of the user's (`g` or `o` in the OBJ).
    GroupId
);
id!(
    /// A material of the user's (`usemtl`).
    MaterialId
);
