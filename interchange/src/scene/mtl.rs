//! MTL reader.
