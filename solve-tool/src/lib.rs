//! Exchange matrix and materials to radiosity.
